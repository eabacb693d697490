"""What the splines of the filter's correction could explain while none is active.

A spline s of a ramp has the column ``a_s``: its modified response along the course of every burst,
times the burst's chirp and channel. With the channel columns X and their posterior covariance C the
ramps together see the energy ``a_s^H a_s - lambda a_s^H X C X^H a_s`` of it, and what the channels
leave of the residual has the inner product ``a_s^H (r - X beta)`` with it; the activation ratio
(23)-(24) is lambda times the square of the one over the other, both summed over the ramps.
"""

from typing import NamedTuple

import numpy as np

from vsep._arrays import ComplexArray, FloatArray
from vsep.kernels.channel import channel_columns, grid_atoms
from vsep.kernels.compiler import compiled
from vsep.kernels.ramps import FlatPosterior, FlatRamps
from vsep.kernels.splines import integrals
from vsep.kernels.turns import turn


class SplineGrid(NamedTuple):
    """Cubic B-splines: knots (S + 4,) in cycles per sample, equidistant, and `SMOOTH`."""

    knots: FloatArray
    table: FloatArray


@compiled
def add_spline_columns(
    start: float, slope: float, line: ComplexArray, grid: SplineGrid, columns: FloatArray
) -> None:
    """Add the columns of one burst to those of its ramp (S, 2, N), real and imaginary parts.

    Parameters
    ----------
    start, slope : float
        Of the burst, cycles per sample and cycles per sample squared.
    line : (N,) complex
        Its channel Psi beta.
    grid : SplineGrid
    columns : (S, 2, N) float
        Changed in place.
    """
    num_samples = len(line)
    rows = np.empty((5, 5, 2, num_samples))  # of the last five knots
    course, distances = np.empty(num_samples), np.empty(num_samples)
    chirp, bspline = np.empty((2, num_samples)), np.empty((2, num_samples))
    height = 1.0 / (grid.knots[1] - grid.knots[0]) ** 3
    for n in range(num_samples):
        course[n] = start + slope * n
        value = height * line[n] * turn(n * (start + 0.5 * slope * n))
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
                total[n] = outer - 4.0 * inner + 6.0 * middle[n]
        _add_products(bspline, chirp, columns[k - 4])


@compiled
def _add_products(a: FloatArray, b: FloatArray, sums: FloatArray) -> None:
    """Add the products of complex numbers, all as real and imaginary parts (2, N)."""
    a_real, a_imag, b_real, b_imag = a[0], a[1], b[0], b[1]
    real, imag = sums[0], sums[1]
    for n in range(len(real)):
        real[n] += a_real[n] * b_real[n] - a_imag[n] * b_imag[n]
    for n in range(len(imag)):
        imag[n] += a_real[n] * b_imag[n] + a_imag[n] * b_real[n]


@compiled
def _inner(a: FloatArray, b: FloatArray) -> complex:
    """Inner product a^H b of real and imaginary parts (2, N)."""
    real = imag = 0.0
    a_real, a_imag, b_real, b_imag = a[0], a[1], b[0], b[1]
    for n in range(len(a_real)):
        real += a_real[n] * b_real[n] + a_imag[n] * b_imag[n]
        imag += a_real[n] * b_imag[n] - a_imag[n] * b_real[n]
    return complex(real, imag)


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
) -> tuple[FloatArray, FloatArray]:
    """Columns of the splines (S, 2, N) and of the channels (K, 2, N) of one ramp."""
    first, last = ramps.first_column[r], ramps.first_column[r + 1]
    first_burst, last_burst = ramps.first_burst[r], ramps.first_burst[r + 1]
    num_samples = ramps.templates.shape[1]
    owners = ramps.owners[first:last]
    atoms = grid_atoms(num_samples, ramps.bins[first:last], ramps.twiddle)
    columns = np.zeros((len(grid.knots) - 4, 2, num_samples))
    for b in range(first_burst, last_burst):
        line = np.zeros(num_samples, dtype=np.complex128)
        for k in range(last - first):
            if owners[k] == b - first_burst:
                for n in range(num_samples):
                    line[n] += amplitudes[first + k] * atoms[k, n]
        add_spline_columns(courses[0][b], courses[1][b], line, grid, columns)
    channels = channel_columns(ramps.templates[first_burst:last_burst], atoms, owners)
    parts = np.empty((last - first, 2, num_samples))
    parts[:, 0], parts[:, 1] = channels.real, channels.imag
    return columns, parts


@compiled
def first_ratios(
    ramps: FlatRamps,
    courses: tuple[FloatArray, FloatArray],
    posterior: FlatPosterior,
    rest: ComplexArray,
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
    posterior : FlatPosterior
        Of the channel weights.
    rest : (R, N) complex
        What the channels leave of the residual.
    noise_precision : float
        lambda.
    grid : SplineGrid
    unseen : float
        Share of a column's energy; of what is below, the channels explain all but rounding.
    """
    num_splines, num_samples = len(grid.knots) - 4, rest.shape[1]
    innovations = np.zeros(num_splines, dtype=np.complex128)
    energies = np.zeros(num_splines)
    row, place = np.empty((2, num_samples)), 0
    for r in range(len(rest)):
        columns, channels = _ramp_columns(ramps, r, courses, posterior.amplitudes, grid)
        size = len(channels)
        crossed = np.empty((2, size, num_splines))
        for k in range(size):
            for s in range(num_splines):
                product = _inner(channels[k], columns[s])
                crossed[0, k, s], crossed[1, k, s] = product.real, product.imag
        explained = _explained(crossed, posterior.covariances[place : place + size * size], size)
        place += size * size
        row[0], row[1] = rest[r].real, rest[r].imag
        for s in range(num_splines):
            innovations[s] += _inner(row, columns[s])
            own = _inner(columns[s], columns[s]).real
            seen = own - noise_precision * explained[s]
            energies[s] += 0.0 if seen <= unseen * own else seen
    ratios = np.zeros(num_splines)
    for s in range(num_splines):
        if energies[s] > 0.0:
            power = innovations[s].real ** 2 + innovations[s].imag ** 2
            ratios[s] = noise_precision * power / energies[s]
    return ratios
