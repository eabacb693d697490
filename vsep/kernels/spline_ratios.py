"""Activation ratios of the filter correction's splines while none is active.

A spline s of a ramp has the column ``a_s``: its modified response along the course of every burst,
times the burst's chirp and channel. With the channel columns X and their posterior covariance C the
ramps together see the energy ``a_s^H a_s - lambda a_s^H X C X^H a_s`` of it, and what the channels
leave of the residual has the inner product ``a_s^H (r - X beta)`` with it; the activation ratio
(23)-(24) is lambda times the square of the one over the other, both summed over the ramps.
"""

from typing import NamedTuple

import numpy as np

from vsep._typing import ComplexArray, FloatArray
from vsep.kernels.channel import ramp_columns
from vsep.kernels.cis import cis
from vsep.kernels.compiler import compiled
from vsep.kernels.complex_parts import ComplexParts, add_scaled, inner, split_row
from vsep.kernels.ramps import FlatRamps, channel_of, templates_of
from vsep.kernels.splines import integrals


class SplineGrid(NamedTuple):
    """Cubic B-splines: knots (S + 4,) in cycles per sample, equidistant, and `SMOOTH`."""

    knots: FloatArray
    table: FloatArray


@compiled
def add_spline_columns(
    start: float, slope: float, line: ComplexParts, grid: SplineGrid, columns: ComplexParts
) -> None:
    """Add the columns of one burst to those of its ramp, rows (S, N).

    Parameters
    ----------
    start, slope : float
        Of the burst, cycles per sample and cycles per sample squared.
    line : (1, N) row
        Its channel Psi beta.
    grid : SplineGrid
    columns : (S, N) rows
        Changed in place.
    """
    num_samples = line.real.shape[1]
    rows = np.empty((5, 5, 2, num_samples))  # of the last five knots
    course, distances = np.empty(num_samples), np.empty(num_samples)
    chirp, bspline = np.empty((2, num_samples)), np.empty((2, num_samples))
    height = 1.0 / (grid.knots[1] - grid.knots[0]) ** 3
    for n in range(num_samples):
        course[n] = start + slope * n  # instantaneous frequency f(n)
        # chirp times channel, all but the spline's response
        value = height * cis(n * (start + 0.5 * slope * n))
        value *= complex(line.real[0, n], line.imag[0, n])
        chirp[0, n], chirp[1, n] = value.real, value.imag
    for k in range(len(grid.knots)):
        for n in range(num_samples):
            distances[n] = course[n] - grid.knots[k]
        integrals(distances, slope, grid.table, rows[k % 5])
        if k < 4:
            continue
        for part in range(2):
            lowest, low = rows[(k - 4) % 5, 4, part], rows[(k - 3) % 5, 4, part]
            middle, high = rows[(k - 2) % 5, 4, part], rows[(k - 1) % 5, 4, part]
            highest, total = rows[k % 5, 4, part], bspline[part]
            for n in range(num_samples):
                outer, inner = lowest[n] + highest[n], low[n] + high[n]
                # fourth difference of H_3: the B-spline's response
                total[n] = outer - 4.0 * inner + 6.0 * middle[n]
        _add_products(bspline, chirp, columns.real[k - 4], columns.imag[k - 4])


@compiled
def _add_products(a: FloatArray, b: FloatArray, real: FloatArray, imag: FloatArray) -> None:
    """Add the products of complex numbers, all as real and imaginary parts (2, N)."""
    a_real, a_imag, b_real, b_imag = a[0], a[1], b[0], b[1]
    for n in range(len(real)):
        real[n] += a_real[n] * b_real[n] - a_imag[n] * b_imag[n]
    for n in range(len(imag)):
        imag[n] += a_real[n] * b_imag[n] + a_imag[n] * b_real[n]


@compiled
def _explained(crossed: FloatArray, covariance: ComplexArray, size: int) -> FloatArray:
    """(S,) values ``c^H C c`` of the columns c of `crossed` (2, K, S), C flat (K^2,)."""
    explained = np.zeros(crossed.shape[2])
    for i in range(size):
        for j in range(i + 1):
            weight = covariance[i * size + j] * (2.0 if j < i else 1.0)
            left_real, left_imag = crossed[0, i], crossed[1, i]
            real, imag = crossed[0, j], crossed[1, j]
            for s in range(len(explained)):
                # c^H C c
                explained[s] += weight.real * (left_real[s] * real[s] + left_imag[s] * imag[s])
                explained[s] -= weight.imag * (left_real[s] * imag[s] - left_imag[s] * real[s])
    return explained


@compiled
def _ramp_columns(
    ramps: FlatRamps,
    r: int,
    courses: tuple[FloatArray, FloatArray],
    amplitudes: ComplexArray,
    grid: SplineGrid,
) -> tuple[ComplexParts, ComplexParts]:
    """Columns of the splines (S, N) and of the channels (K, N) of one ramp."""
    channel, templates = channel_of(ramps, r), templates_of(ramps, r)
    num_bursts, num_samples = templates.shape
    atoms, channels = ramp_columns(templates, channel)
    shape = (len(grid.knots) - 4, num_samples)
    columns = ComplexParts(np.zeros(shape), np.zeros(shape))
    for b in range(num_bursts):
        line = ComplexParts(np.zeros((1, num_samples)), np.zeros((1, num_samples)))
        for k in range(len(channel.owners)):
            if channel.owners[k] == b:
                add_scaled(amplitudes[ramps.first_column[r] + k], atoms, k, line, 0)  # Psi beta
        burst = ramps.first_burst[r] + b
        add_spline_columns(courses[0][burst], courses[1][burst], line, grid, columns)
    return columns, channels


@compiled
def first_ratios(
    ramps: FlatRamps,
    courses: tuple[FloatArray, FloatArray],
    weights: tuple[ComplexArray, ComplexArray],
    noise_residual: ComplexArray,
    noise_precision: float,
    grid: SplineGrid,
    unseen: float,
) -> FloatArray:
    """(S,) activation ratios of all splines of R ramps while none is active.

    Parameters
    ----------
    ramps : FlatRamps
        The bursts and their channels.
    courses : tuple of (B,) float
        Start frequencies and slopes of the bursts, cycles per sample (squared).
    weights : tuple of (sum of K^2,) and (K,) complex
        Covariances and means of the channel weights.
    noise_residual : (R, N) complex
        What the channels leave of the residual.
    noise_precision : float
        lambda.
    grid : SplineGrid
    unseen : float
        Share of a column's energy; of what is below, the channels explain all but rounding.
    """
    num_splines = len(grid.knots) - 4
    innovations = np.zeros(num_splines, dtype=np.complex128)
    energies = np.zeros(num_splines)
    place = 0
    for r in range(len(noise_residual)):
        columns, channels = _ramp_columns(ramps, r, courses, weights[1], grid)
        size = len(channels.real)
        crossed = np.empty((2, size, num_splines))
        for k in range(size):
            for s in range(num_splines):
                product = inner(channels, k, columns, s)  # X^H a_s
                crossed[0, k, s], crossed[1, k, s] = product.real, product.imag
        explained = _explained(crossed, weights[0][place:], size)
        place += size * size
        row = split_row(noise_residual[r])
        for s in range(num_splines):
            innovations[s] += inner(row, 0, columns, s)  # a_s^H (r - X beta)
            own = inner(columns, s, columns, s).real
            seen = own - noise_precision * explained[s]  # a_s^H (I - lambda X C X^H) a_s
            energies[s] += 0.0 if seen <= unseen * own else seen
    ratios = np.zeros(num_splines)
    for s in range(num_splines):
        if energies[s] > 0.0:
            power = innovations[s].real ** 2 + innovations[s].imag ** 2
            # omega^2/rho of (23)-(24) with no spline active
            ratios[s] = noise_precision * power / energies[s]
    return ratios
