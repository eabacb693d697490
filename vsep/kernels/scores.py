"""Scores ``|a^H r|^2 / ||a||^2`` of single chirps from correlations."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vsep._typing import FloatArray, IntArray
from vsep.kernels.compiler import compiled

SingleFloatArray = NDArray[np.float32]
SingleComplexArray = NDArray[np.complex64]


class ChirpGrid(NamedTuple):
    """Chirps on a grid of S slopes and C centres, in single precision.

    Parameters
    ----------
    kernels : (S, 2, 2 R) float
        What a chirp of each slope looks like around its centre at index R: real and imaginary part.
    inverse_energy : (S, C) float
        1/||a||^2 inside the ramp; zero where too little of the chirp lies inside.
    first : int
        Sample of the first centre.
    coarse : (M,) int
        Slopes that are correlated at every centre.
    spectra : (M, F) complex
        1/F times the conjugate spectra of their kernels, centred at `first`.
    reach : tuple of int
        How far the surroundings of a place extend in slopes and in centres.
    close_share : float
        Of the best coarse score: what a place must reach to have its surroundings tried.
    """

    kernels: SingleFloatArray
    inverse_energy: SingleFloatArray
    first: int
    coarse: IntArray
    spectra: SingleComplexArray
    reach: tuple[int, int]
    close_share: float


@compiled
def correlation_spectra(
    spectra: SingleComplexArray, kernels: SingleComplexArray, ramps: tuple[int, int]
) -> SingleComplexArray:
    """Products (A, last - first, M, F) of spectra (A, P, F) of some ramps and kernels (M, F)."""
    num_antennas, _, size = spectra.shape
    first, last = ramps
    products = np.empty((num_antennas, last - first, len(kernels), size), dtype=np.complex64)
    for a in range(num_antennas):
        for p in range(last - first):
            row = spectra[a, first + p]
            for m in range(len(kernels)):
                kernel, product = kernels[m], products[a, p, m]
                for f in range(size):
                    x, y = row[f], kernel[f]
                    product[f] = complex(  # conj(a) r in the frequency domain, all centres at once
                        x.real * y.real - x.imag * y.imag, x.real * y.imag + x.imag * y.real
                    )
    return products


@compiled
def coarse_scores(
    correlations: SingleComplexArray,
    grid: ChirpGrid,
    begin: int,
    scores: SingleFloatArray,
    best: SingleFloatArray,
) -> None:
    """Write the scores of some coarse slopes of some ramps, and the best of each slope.

    Parameters
    ----------
    correlations : (A, R, K, F) complex
        Circular correlations of R ramps, as A antennas received them, with K coarse kernels.
    grid : ChirpGrid
    begin : int
        The first of these coarse slopes.
    scores : (R, M, C) float
        Of all coarse slopes at all centres.
    best : (R, M) float
    """
    num_antennas, num_ramps, count, _ = correlations.shape
    largest_bits = best.view(np.int32)
    for p in range(num_ramps):
        for m in range(begin, begin + count):
            row, inverse_energy = scores[p, m], grid.inverse_energy[grid.coarse[m]]
            for c in range(len(row)):
                row[c] = np.float32(0.0)
            for a in range(num_antennas):
                values = correlations[a, p, m - begin]
                for c in range(len(row)):
                    # |a^H r|^2, summed over antennas
                    row[c] += values[c].real * values[c].real + values[c].imag * values[c].imag
            for c in range(len(row)):
                row[c] *= inverse_energy[c]  # / ||a||^2
            # The bits of positive numbers are ordered as they are; integers need no care for NaN.
            bits, largest = row.view(np.int32), np.int32(0)
            for c in range(len(bits)):
                largest = max(largest, bits[c])
            largest_bits[p, m] = largest


@compiled
def _chirp_score(parts: SingleFloatArray, grid: ChirpGrid, s: int, c: int) -> float:
    """Score of one place of the grid, by direct sums over `parts` (A, 2, N) of a ramp."""
    num_samples = parts.shape[2]
    offset = grid.kernels.shape[2] // 2 - grid.first - c
    kernel_real = grid.kernels[s, 0, offset : offset + num_samples]
    kernel_imag = grid.kernels[s, 1, offset : offset + num_samples]
    power = np.float32(0.0)
    for a in range(len(parts)):
        row_real, row_imag = parts[a, 0], parts[a, 1]
        real = imag = np.float32(0.0)
        for n in range(num_samples):
            real += row_real[n] * kernel_real[n] + row_imag[n] * kernel_imag[n]  # Re a^H r
            imag += row_imag[n] * kernel_real[n] - row_real[n] * kernel_imag[n]  # Im a^H r
        power += real * real + imag * imag
    return float(power * grid.inverse_energy[s, c])


@compiled
def polish(
    parts: SingleFloatArray, grid: ChirpGrid, slope: int, column: int
) -> tuple[int, int, float]:
    """Best slope, centre and score around a place of the grid, of `parts` (A, 2, N) of a ramp."""
    best_slope, best_column, best = slope, column, -1.0
    num_slopes, num_centres = grid.inverse_energy.shape
    for s in range(max(slope - grid.reach[0], 0), min(slope + grid.reach[0] + 1, num_slopes)):
        first = max(column - grid.reach[1], 0)
        for c in range(first, min(column + grid.reach[1] + 1, num_centres)):
            score = _chirp_score(parts, grid, s, c)
            if score > best:
                best_slope, best_column, best = s, c, score
    return best_slope, best_column, best


@compiled
def best_chirps(
    scores: SingleFloatArray,
    best: SingleFloatArray,
    rows: SingleComplexArray,
    first: int,
    grid: ChirpGrid,
    worthwhile: FloatArray,
) -> tuple[IntArray, IntArray, FloatArray]:
    """Best chirp of some ramps: of all coarse places, and of what surrounds the good ones.

    Parameters
    ----------
    scores : (R, M, C) float
        Of R ramps for the coarse slopes at all centres.
    best : (R, M) float
        The best of each slope.
    rows : (A, P, N) complex
        All ramps.
    first : int
        The first of the R.
    grid : ChirpGrid
    worthwhile : (P,) float
        What the best coarse score of a ramp must reach; else its place is returned as it is.

    Returns
    -------
    slope, column : (R,) int
        Where in the grid.
    score : (R,) float
    """
    num_ramps = len(scores)
    slopes, columns = np.zeros(num_ramps, dtype=np.int64), np.zeros(num_ramps, dtype=np.int64)
    found = np.zeros(num_ramps)
    parts = np.empty((len(rows), 2, rows.shape[2]), dtype=np.float32)
    for p in range(num_ramps):
        first_best = np.argmax(best[p])
        # The best place of the coarse grid
        slopes[p], columns[p] = grid.coarse[first_best], np.argmax(scores[p, first_best])
        found[p] = best[p, first_best]
        # nothing here reaches the threshold, however well refined
        if found[p] < worthwhile[first + p]:
            continue
        for a in range(len(rows)):
            for n in range(rows.shape[2]):
                value = rows[a, first + p, n]
                parts[a, 0, n], parts[a, 1, n] = value.real, value.imag
        least, found[p] = grid.close_share * found[p], -1.0
        for m in range(best.shape[1]):
            # Other coarse slopes close to the best may hide the true one.
            if best[p, m] >= least:
                place = polish(parts, grid, grid.coarse[m], int(np.argmax(scores[p, m])))
                if place[2] > found[p]:
                    slopes[p], columns[p], found[p] = place
    return slopes, columns, found
