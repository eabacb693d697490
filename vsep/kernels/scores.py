"""Scores ``|a^H r|^2 / ||a||^2`` of single chirps: the best of a correlation, and around it."""

import numpy as np
from numpy.typing import NDArray

from vsep._arrays import FloatArray, IntArray
from vsep.kernels.compiler import compiled


@compiled
def best_centres(
    correlations: NDArray[np.complex64], first: int, inverse_energy: FloatArray
) -> tuple[IntArray, FloatArray]:
    """Best centre of every slope.

    Parameters
    ----------
    correlations : (S, F) complex
        Circular correlations of a ramp with the kernel of each slope.
    first : int
        Lag of the first centre; negative lags lie at the end of a row.
    inverse_energy : (S, C) float
        1/||a||^2.

    Returns
    -------
    column : (S,) int
        Which centre.
    score : (S,) float
    """
    num_slopes, num_centres = inverse_energy.shape
    size = correlations.shape[1]
    columns = np.zeros(num_slopes, dtype=np.int64)
    scores = np.zeros(num_slopes)
    for s in range(num_slopes):
        best = -1.0
        for c in range(num_centres):
            lag = first + c
            value = correlations[s, lag if lag >= 0 else lag + size]
            score = (value.real**2 + value.imag**2) * inverse_energy[s, c]
            if score > best:
                best = score
                columns[s] = c
        scores[s] = best
    return columns, scores


@compiled
def polish(
    residual: NDArray[np.complex64],
    kernels: NDArray[np.complex64],
    inverse_energy: FloatArray,
    first: int,
    slopes: IntArray,
    columns: IntArray,
    reach: tuple[int, int],
) -> tuple[int, int, float]:
    """Best chirp around several places of the grid of slopes and centres, by direct sums.

    Parameters
    ----------
    residual : (A, N) complex
        One ramp as every antenna received it.
    kernels : (S, 2 R) complex
        Kernel of every slope around its centre, the centre at R.
    inverse_energy : (S, C) float
        1/||a||^2.
    first : int
        Sample of the first centre.
    slopes, columns : (M,) int
        The places.
    reach : tuple of int
        How far the surroundings extend in slopes and in centres.

    Returns
    -------
    slope, column : int
    score : float
    """
    middle = kernels.shape[1] // 2
    best_slope, best_column, best = slopes[0], columns[0], -1.0
    for place in range(len(slopes)):
        for s in range(slopes[place] - reach[0], slopes[place] + reach[0] + 1):
            if not 0 <= s < kernels.shape[0]:
                continue
            for c in range(columns[place] - reach[1], columns[place] + reach[1] + 1):
                if not 0 <= c < inverse_energy.shape[1]:
                    continue
                offset = middle - first - c
                power = 0.0
                for antenna in range(len(residual)):
                    real = imag = 0.0
                    for n in range(residual.shape[1]):
                        a, b = residual[antenna, n], kernels[s, n + offset]
                        real += a.real * b.real + a.imag * b.imag
                        imag += a.imag * b.real - a.real * b.imag
                    power += real * real + imag * imag
                score = power * inverse_energy[s, c]
                if score > best:
                    best_slope, best_column, best = s, c, score
    return best_slope, best_column, best
