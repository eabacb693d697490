"""Posterior of the object weights at given frequencies, and the object signal."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vsep._typing import ComplexArray, FloatArray
from vsep.kernels.compiler import compiled
from vsep.kernels.complex_parts import (
    ComplexParts,
    empty_rows,
    line_products,
    row_of,
    rows_to,
    split,
)
from vsep.kernels.line_spectra import Columns, by_ramps, fill_lines
from vsep.kernels.moving_atoms import (
    Migration,
    add_moving_signals,
    is_moving,
    moving_jets,
    moving_products,
)
from vsep.kernels.posterior import weight_posterior


class ObjectPosterior(NamedTuple):
    """Columns at A antennas and the posterior of their K weights.

    ``beat_factors`` (K, N), ``doppler_factors`` (K, P), ``gram`` (K, K), ``projections`` (K, A),
    ``covariance`` (K, K), ``amplitudes`` (K, A), and log|C|, NaN where there is none.
    """

    beat_factors: ComplexArray
    doppler_factors: ComplexArray
    gram: ComplexArray
    projections: ComplexArray
    covariance: ComplexArray
    amplitudes: ComplexArray
    log_determinant: float


@compiled
def separable_gram(beat: ComplexParts, doppler: ComplexParts) -> ComplexArray:
    """(K, K) inner products of separable columns (K, N) x (K, P)."""
    size = len(beat.real)
    gram = np.empty((size, size), dtype=np.complex128)
    beats, dopplers = empty_rows(1, size), empty_rows(1, size)
    for k in range(size):
        # (a (x) b)^H (c (x) d) = (a^H c) (b^H d); the Gram matrix is Hermitian.
        line_products(rows_to(beat, k + 1), row_of(beat, k), beats)
        line_products(rows_to(doppler, k + 1), row_of(doppler, k), dopplers)
        for i in range(k + 1):
            beat_product = complex(beats.real[0, i], beats.imag[0, i])
            product = beat_product * complex(dopplers.real[0, i], dopplers.imag[0, i])
            gram[k, i], gram[i, k] = product, product.conjugate()
        gram[k, k] = gram[k, k].real  # exactly
    return gram


@compiled
def separable_products(
    signals: ComplexParts, beat: ComplexParts, doppler: ComplexParts
) -> ComplexArray:
    """(K, A) inner products of separable columns with A signals (A P, N)."""
    num_ramps = doppler.real.shape[1]
    num_antennas = len(signals.real) // num_ramps
    products = np.empty((len(beat.real), num_antennas), dtype=np.complex128)
    along, whole = empty_rows(1, len(signals.real)), empty_rows(1, num_antennas)
    for k in range(len(products)):
        # phi^H r: first along the samples of each ramp, then along the ramps
        line_products(signals, row_of(beat, k), along)
        line_products(by_ramps(along, num_ramps), row_of(doppler, k), whole)
        for a in range(num_antennas):
            products[k, a] = complex(whole.real[0, a], whole.imag[0, a])
    return products


@compiled
def lines_trace(
    points: FloatArray, covariance: ComplexArray, num_ramps: int, num_samples: int
) -> float:
    """tr(Phi C Phi^H) of atoms at points (2, L), with the covariance (L, L) of their weights."""
    size = len(covariance)
    beat_factors = np.empty((size, num_samples), dtype=np.complex128)
    doppler_factors = np.empty((size, num_ramps), dtype=np.complex128)
    fill_lines(points[0], beat_factors)
    fill_lines(points[1], doppler_factors)
    gram = separable_gram(split(beat_factors), split(doppler_factors))
    trace = 0.0
    for i in range(size):
        for k in range(size):
            # tr(Phi^H Phi C), a term of (65)
            trace += (gram[i, k].conjugate() * covariance[i, k]).real
    return trace


@compiled
def place_columns(
    points: FloatArray,
    background: tuple[ComplexArray, ComplexArray],
    precisions: FloatArray,
    residual: ComplexArray,
    noise_precision: float,
) -> ObjectPosterior:
    """Posterior (58)-(59) of all columns with the objects at the given points.

    Parameters
    ----------
    points : (L, 2) float
        Beats and Dopplers.
    background : tuple of (M, N) and (M, P) complex
        Columns that do not move.
    precisions : (L + M,) float
        Prior precisions of the objects, then of the background.
    residual : (A P, N) complex
        Received signal minus what is not among the columns.
    noise_precision : float
        lambda.
    """
    count, size = len(points), len(precisions)
    beat_factors = np.empty((size, background[0].shape[1]), dtype=np.complex128)
    doppler_factors = np.empty((size, background[1].shape[1]), dtype=np.complex128)
    # Phi(zeta), (10)
    fill_lines(points[:, 0], beat_factors[:count])
    fill_lines(points[:, 1], doppler_factors[:count])
    # Columns of the other source, which share the posterior (footnote 4)
    for k in range(count, size):
        for n in range(beat_factors.shape[1]):
            beat_factors[k, n] = background[0][k - count, n]
        for p in range(doppler_factors.shape[1]):
            doppler_factors[k, p] = background[1][k - count, p]
    beat, doppler = split(beat_factors), split(doppler_factors)
    projections = separable_products(split(residual), beat, doppler)  # Phi^H r
    gram = separable_gram(beat, doppler)  # Phi^H Phi
    return columns_posterior(
        beat_factors, doppler_factors, gram, projections, precisions, noise_precision
    )


@compiled
def columns_posterior(
    beat_factors: ComplexArray,
    doppler_factors: ComplexArray,
    gram: ComplexArray,
    projections: ComplexArray,
    precisions: FloatArray,
    noise_precision: float,
) -> ObjectPosterior:
    """Posterior (58)-(59) of columns with their Gram matrix and projections (K, A)."""
    size = len(precisions)
    # C from (59)
    fit = weight_posterior(gram, projections[:, 0].copy(), precisions, noise_precision)
    amplitudes = np.zeros_like(projections)
    for k in range(size):
        for i in range(size):
            for a in range(projections.shape[1]):
                # alpha from (58), for each antenna
                amplitudes[k, a] += noise_precision * fit.covariance[k, i] * projections[i, a]
    return ObjectPosterior(
        beat_factors,
        doppler_factors,
        gram,
        projections,
        fit.covariance,
        amplitudes,
        fit.log_determinant,
    )


@compiled
def place_moving_columns(
    points: FloatArray,
    num_ramps: int,
    precisions: FloatArray,
    residual: ComplexArray,
    noise_precision: float,
    migration: Migration,
) -> ObjectPosterior:
    """Posterior (58)-(59) of objects that move, at the given points; as `place_columns`.

    The factors are those of objects that stand still.
    """
    num_samples = residual.shape[1]
    beat_factors = np.empty((len(points), num_samples), dtype=np.complex128)
    doppler_factors = np.empty((len(points), num_ramps), dtype=np.complex128)
    fill_lines(points[:, 0], beat_factors)
    fill_lines(points[:, 1], doppler_factors)
    gram = moving_jets(points, migration, num_ramps, num_samples, 1)[0]
    projections = moving_products(points, migration, num_ramps, residual)
    return columns_posterior(
        beat_factors, doppler_factors, gram, projections, precisions, noise_precision
    )


@compiled
def add_signals(
    beat_factors: ComplexArray,
    doppler_factors: ComplexArray,
    weights: ComplexArray,
    total: ComplexParts,
) -> None:
    """Add separable columns (K, N) x (K, P) with weights (K, A) to signals (A P, N)."""
    num_ramps = doppler_factors.shape[1]
    beat = split(beat_factors)
    for row in range(len(total.real)):
        a, p = row // num_ramps, row % num_ramps
        for k in range(len(weights)):
            # alpha_l times the entry of the Doppler line
            weight = weights[k, a] * doppler_factors[k, p]
            c, d = weight.real, weight.imag
            for n in range(beat.real.shape[1]):
                total.real[row, n] += beat.real[k, n] * c - beat.imag[k, n] * d
                total.imag[row, n] += beat.real[k, n] * d + beat.imag[k, n] * c


@compiled
def object_signals(
    beat_factors: ComplexArray, doppler_factors: ComplexArray, weights: ComplexArray
) -> ComplexArray:
    """Object signals (A P, N) of separable columns (K, N) x (K, P) with weights (K, A)."""
    shape = weights.shape[1] * doppler_factors.shape[1], beat_factors.shape[1]
    total = ComplexParts(np.zeros(shape), np.zeros(shape))
    add_signals(beat_factors, doppler_factors, weights, total)
    signals = np.empty(shape, dtype=np.complex128)
    for row in range(shape[0]):
        for n in range(shape[1]):
            signals[row, n] = complex(total.real[row, n], total.imag[row, n])
    return signals


@compiled
def subtract_columns(residual: ComplexArray, columns: Columns) -> NDArray[np.complex64]:
    """Residual (A P, N) without the columns, (A, P, N).

    In single precision: the peaks of its transform are starting points of Newton's method.
    """
    parts = split(residual)
    num_rows, num_samples = residual.shape
    # r - Phi alpha
    if is_moving(columns.migration):
        num_ramps = columns.doppler_factors.shape[1]
        weights = -columns.amplitudes
        add_moving_signals(columns.points, weights, columns.migration, num_ramps, parts)
    else:
        add_signals(columns.beat_factors, columns.doppler_factors, -columns.amplitudes, parts)
    signals = np.empty((num_rows, num_samples), dtype=np.complex64)
    for row in range(num_rows):
        for n in range(num_samples):
            signals[row, n] = complex(parts.real[row, n], parts.imag[row, n])
    return signals.reshape((columns.amplitudes.shape[1], -1, num_samples))
