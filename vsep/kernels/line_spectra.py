"""Object atoms and their inner products with the residual and other columns.

An atom is a Kronecker product phi of a line over the samples and one over the ramps. The columns,
all or all but one of the components, are such products too: matrix Phi, with weights of mean mu and
covariance C at each of A antennas. A downdated component leaves zeros in C and mu behind and
drops out of all sums.

Where objects move through range cells, atoms are no Kronecker products; `moving_atoms` has theirs.
"""

from typing import NamedTuple

import numpy as np

from vsep._typing import ComplexArray, FloatArray
from vsep.kernels.cis import cis
from vsep.kernels.compiler import compiled
from vsep.kernels.complex_parts import (
    ComplexParts,
    empty_row,
    empty_rows,
    line_moments,
    multiply,
    split,
)
from vsep.kernels.moving_atoms import Migration, frame_products, pair_products

EXACT = 4  # samples of an exponential set one by one; the others are these, rotated

# Which derivatives, by the beat and by the Doppler frequency, stand in the six rows of a jet.
BEAT_ORDERS = (0, 1, 0, 2, 1, 0)
DOPPLER_ORDERS = (0, 0, 1, 0, 1, 2)


NO_POINTS = np.empty((0, 2))


class Columns(NamedTuple):
    """Separable columns and the posterior of their weights.

    ``beat_factors`` (L, N), ``doppler_factors`` (L, P), ``covariance`` (L, L), ``amplitudes``
    (L, A), and the noise precision lambda. With migration, which else is None, the columns are the
    moving atoms at ``points`` (L, 2), and of the factors the sizes count.
    """

    beat_factors: ComplexArray
    doppler_factors: ComplexArray
    covariance: ComplexArray
    amplitudes: ComplexArray
    noise_precision: float
    points: FloatArray = NO_POINTS
    migration: Migration | None = None


class AtomJet(NamedTuple):
    """Inner products of an atom phi with the residual and the columns, and their derivatives.

    ``rows`` (6, L) are ``phi^H Phi`` and ``innovations`` (6, A) are ``phi^H (r - Phi mu)``: values,
    first (b, d) and second derivatives (bb, bd, dd). ``weighted`` (3, L) are ``C Phi^H phi``:
    values and first derivatives.
    """

    rows: ComplexParts
    innovations: ComplexParts
    weighted: ComplexParts


class Scratch(NamedTuple):
    """Memory of one atom's inner products, in use until the next one's.

    Its lines (N,) and (P,); moments with the residual, ``along`` (3, A P) the samples, the same
    memory ``by_ramps`` (3 A, P), and over the ``whole`` (3, 3 A) frame; moments ``beat`` and
    ``doppler`` (3, L) with the columns' factors. Of a moving atom: its ``point`` (2,), and
    ``courses`` (3 A + 2, N) over the samples.
    """

    beat_line: ComplexParts
    doppler_line: ComplexParts
    along: ComplexParts
    by_ramps: ComplexParts
    whole: ComplexParts
    beat: ComplexParts
    doppler: ComplexParts
    jet: AtomJet
    point: FloatArray
    courses: ComplexParts


class ComplexPartColumns(NamedTuple):
    """`Columns` with the parts of each array apart, and memory for an atom beside them."""

    beat_factors: ComplexParts
    doppler_factors: ComplexParts
    covariance: ComplexParts
    amplitudes: ComplexParts
    noise_precision: float
    scratch: Scratch
    points: FloatArray
    migration: Migration | None


@compiled
def by_ramps(along: ComplexParts, num_ramps: int) -> ComplexParts:
    """Give every antenna a row: (S, A P) or (A P,) inner products along the ramps to (S A, P)."""
    return ComplexParts(along.real.reshape((-1, num_ramps)), along.imag.reshape((-1, num_ramps)))


@compiled
def columns_as_parts(columns: Columns) -> ComplexPartColumns:
    """Take all arrays apart."""
    size, num_antennas = columns.amplitudes.shape
    num_ramps = columns.doppler_factors.shape[1]
    along = empty_rows(3, num_antennas * num_ramps)
    scratch = Scratch(
        empty_row(columns.beat_factors.shape[1]),
        empty_row(num_ramps),
        along,
        by_ramps(along, num_ramps),
        empty_rows(3, 3 * num_antennas),
        empty_rows(3, size),
        empty_rows(3, size),
        AtomJet(empty_rows(6, size), empty_rows(6, num_antennas), empty_rows(3, size)),
        np.zeros(2),
        empty_rows(3 * num_antennas + 2, columns.beat_factors.shape[1]),
    )
    return ComplexPartColumns(
        split(columns.beat_factors),
        split(columns.doppler_factors),
        split(columns.covariance),
        split(columns.amplitudes),
        columns.noise_precision,
        scratch,
        columns.points.copy(),
        columns.migration,
    )


@compiled
def fill_line(frequency: float, line: ComplexParts) -> None:
    """Write ``exp(-j 2 pi frequency m) / sqrt(M)`` for m = 0 ... M - 1."""
    real, imag = line
    size = len(real)
    scale = 1.0 / np.sqrt(size)
    # The first samples exactly; then the known ones, rotated, double their number each time.
    known = min(EXACT, size)
    for m in range(known):
        value = cis(-frequency * m)
        real[m], imag[m] = scale * value.real, scale * value.imag
    while known < size:
        step = cis(-frequency * known)
        for m in range(min(known, size - known)):
            real[known + m] = real[m] * step.real - imag[m] * step.imag
            imag[known + m] = real[m] * step.imag + imag[m] * step.real
        known *= 2


@compiled
def fill_lines(frequencies: FloatArray, lines: ComplexArray) -> None:
    """Write one exponential into every row (L, M)."""
    line = empty_row(lines.shape[1])
    for row in range(len(frequencies)):
        fill_line(frequencies[row], line)
        for m in range(lines.shape[1]):
            lines[row, m] = complex(line.real[m], line.imag[m])


@compiled
def apply_covariance(
    rows: ComplexParts, covariance: ComplexParts, weighted: ComplexParts, num_rows: int
) -> None:
    """Write ``C v`` of the first rows ``v^*``, each (L,)."""
    size = rows.real.shape[1]
    for s in range(num_rows):
        for k in range(size):
            real = imag = 0.0
            for other in range(size):
                a, b = covariance.real[k, other], covariance.imag[k, other]
                c, d = rows.real[s, other], rows.imag[s, other]
                # rows are v^*: C v needs their conjugate
                real += a * c + b * d
                imag += b * c - a * d
            weighted.real[s, k], weighted.imag[s, k] = real, imag


@compiled
def subtract_fit(
    rows: ComplexParts, amplitudes: ComplexParts, innovations: ComplexParts, num_rows: int
) -> None:
    """Take ``row mu`` off an atom's inner products with the residual, (A,) for each row (L,)."""
    for s in range(num_rows):
        for a in range(amplitudes.real.shape[1]):
            real = imag = 0.0
            for k in range(rows.real.shape[1]):
                c, d = amplitudes.real[k, a], amplitudes.imag[k, a]
                real += rows.real[s, k] * c - rows.imag[s, k] * d
                imag += rows.real[s, k] * d + rows.imag[s, k] * c
            innovations.real[s, a] -= real  # phi^H r - phi^H Phi mu
            innovations.imag[s, a] -= imag


@compiled
def atom_jet(
    beat_line: ComplexParts,
    doppler_line: ComplexParts,
    residual: ComplexParts,
    columns: ComplexPartColumns,
) -> AtomJet:
    """Inner products of one atom, given by its lines, in scratch; O(APN + L (N + P) + L^2).

    Parameters
    ----------
    beat_line, doppler_line : (N,) and (P,) complex
        The atom.
    residual : (A P, N) complex
        Received signal minus what is not among the columns.
    columns : ComplexPartColumns
        All columns, or all others.
    """
    along, along_ramps, whole, beat, doppler, jet = columns.scratch[2:8]
    # phi^H r by derivative of the beat line, (3, A P), then of the Doppler line
    line_moments(residual, beat_line, along)
    line_moments(along_ramps, doppler_line, whole)
    # phi^H Phi is the product of both factors' inner products.
    line_moments(columns.beat_factors, beat_line, beat)
    line_moments(columns.doppler_factors, doppler_line, doppler)
    num_antennas = columns.amplitudes.real.shape[1]
    for s in range(6):
        # Derivatives 1, b, d, bb, bd, dd as products of those of the lines
        i, j = BEAT_ORDERS[s], DOPPLER_ORDERS[s]
        multiply(beat, i, doppler, j, jet.rows, s)
        for a in range(num_antennas):
            jet.innovations.real[s, a] = whole.real[j, i * num_antennas + a]
            jet.innovations.imag[s, a] = whole.imag[j, i * num_antennas + a]
    subtract_fit(jet.rows, columns.amplitudes, jet.innovations, 6)  # q and its derivatives
    # C v; second derivatives meet it only from the left
    apply_covariance(jet.rows, columns.covariance, jet.weighted, 3)
    return jet


@compiled
def moving_products_at(
    beat: float,
    doppler: float,
    residual: ComplexParts,
    columns: ComplexPartColumns,
    migration: Migration | None,
    num_rows: int,
) -> None:
    """Inner products of one moving atom in scratch: all six rows of its jet, or values only."""
    if migration is None:
        return
    scratch = columns.scratch
    num_ramps, courses, jet = len(scratch.doppler_line.real), scratch.courses, scratch.jet
    scratch.point[0], scratch.point[1] = beat, doppler
    point = beat, doppler
    frame_products(point, migration, num_ramps, residual, courses, jet.innovations, num_rows)
    sums = ComplexParts(courses.real[:3], courses.imag[:3])
    pair_products(point, columns.points, migration, num_ramps, sums, jet.rows, num_rows)
    subtract_fit(jet.rows, columns.amplitudes, jet.innovations, num_rows)
    apply_covariance(jet.rows, columns.covariance, jet.weighted, min(3, num_rows))
