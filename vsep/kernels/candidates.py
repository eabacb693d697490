"""New object candidates: refined peaks of a periodogram."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vsep._typing import ComplexArray, FloatArray, IntArray
from vsep.kernels.compiler import compiled
from vsep.kernels.complex_parts import split
from vsep.kernels.doppler_intervals import favour_first_interval
from vsep.kernels.line_spectra import Columns, columns_as_parts
from vsep.kernels.moving_atoms import Migration, fold_width, is_moving
from vsep.kernels.newton_ascent import ascend
from vsep.kernels.object_cost import MIN_SCHUR, CostJet

NEW_COMPONENT_STEPS = 8  # Newton steps of a candidate from its grid point (half a cell at most)
CANDIDATE_PEAKS = 3  # grid peaks tried when the highest one runs into an existing component
ABSORBED_SHARE = 0.05  # 1/rho below this share of lambda: the others already explain the atom
BESIDE = 2  # grid points on either side of a peak that are not peaks of their own


class Candidate(NamedTuple):
    """A place where a new component might be, with its activation ratio and precision.

    ``absorbed`` says that the components already there explain its atom almost completely.
    """

    beat: float
    doppler: float
    ratio: float
    precision: float
    absorbed: bool


@compiled
def candidate_at(
    beat: float,
    doppler: float,
    jet: CostJet,
    num_antennas: int,
    noise_precision: float,
    level: float,
    moving: bool,
) -> Candidate:
    """Evaluate a point where the cost of a component without prior is `jet`.

    The ratio is that over the noise there, `level` times 1/lambda. Of a moving atom the Doppler
    frequency has no period.
    """
    beat = (beat + 0.5) % 1.0 - 0.5
    if not moving:
        doppler = (doppler + 0.5) % 1.0 - 0.5
    # nothing of the atom is left beside the others
    if jet.inverse_rho <= MIN_SCHUR * noise_precision:
        return Candidate(beat, doppler, 0.0, np.inf, True)
    ratio = jet.power / jet.inverse_rho / level  # omega^2 / rho, (23)-(24)
    mean = ratio / num_antennas
    # gamma = 1 / (omega^2 - rho), the fixed point (77)
    precision = jet.inverse_rho / (mean - 1.0) / level if mean > 1.0 else np.inf
    absorbed = jet.inverse_rho < ABSORBED_SHARE * noise_precision
    return Candidate(beat, doppler, ratio, precision, absorbed)


@compiled
def _highest(row: NDArray[np.float32]) -> int:
    best = 0
    for column in range(1, len(row)):
        if row[column] > row[best]:
            best = column
    return best


@compiled
def grid_power(transforms: NDArray[np.complex64]) -> NDArray[np.float32]:
    """(R, C) periodogram of A transforms (A, R, C), summed."""
    num_antennas, num_rows, num_columns = transforms.shape
    power = np.zeros((num_rows, num_columns), dtype=np.float32)
    for a in range(num_antennas):
        for row in range(num_rows):
            for column in range(num_columns):
                value = transforms[a, row, column]  # |phi^H (r - Phi mu)|^2 on the grid
                power[row, column] += value.real * value.real + value.imag * value.imag
    return power


@compiled
def next_peak(power: NDArray[np.float32], highest: IntArray) -> tuple[int, int]:
    """Find the largest value of a grid (R, C) that wraps around, and clear what lies beside it.

    Parameters
    ----------
    power : (R, C) float
        Cleared in place.
    highest : (R,) int
        Column of the largest value of each row; kept up to date.
    """
    num_rows, num_columns = power.shape
    best = 0
    for row in range(1, num_rows):
        if power[row, highest[row]] > power[best, highest[best]]:
            best = row
    column = highest[best]
    # The main lobe of a line is four points of a half-cell grid wide.
    for i in range(best - BESIDE, best + BESIDE + 1):
        row = i % num_rows
        for j in range(column - BESIDE, column + BESIDE + 1):
            power[row, j % num_columns] = 0.0
        highest[row] = _highest(power[row])
    return best, column


@compiled
def moving_doppler(row: int, num_rows: int, columns: Columns, migration: Migration | None) -> float:
    """Doppler frequency of a row of `keystone_transform`; zero without migration."""
    if migration is None:
        return 0.0
    width = fold_width(migration, columns.beat_factors.shape[1])
    doppler: float = width * (row - num_rows // 2) / (2.0 * columns.doppler_factors.shape[1])
    return doppler


@compiled
def candidate_peaks(
    transforms: NDArray[np.complex64], columns: Columns, levels: FloatArray
) -> tuple[NDArray[np.float32], IntArray]:
    """Power (R, C) of what the columns leave over the noise, and the highest column of each row.

    Parameters
    ----------
    transforms : (A, R, C) complex
        Fourier transforms of what the columns leave unexplained, on a grid of half a cell. With
        migration they are inner products with moving atoms, Doppler frequency zero in row R/2.
    columns : Columns
        The components there are.
    levels : (C,) or (1,) float
        Noise at the beats of the grid, or at all, in units of 1/lambda.
    """
    power = grid_power(transforms)
    num_rows, num_columns = power.shape
    if len(levels) > 1:
        for row in range(num_rows):
            for column in range(num_columns):
                power[row, column] /= np.float32(levels[column])  # in noise that is not white
    favour_first_interval(power, columns, columns.migration)
    # The best of each row is kept, so that the next peak costs one row search per cleared row.
    return power, np.array([_highest(power[row]) for row in range(num_rows)])


@compiled
def best_candidate(
    peaks: tuple[NDArray[np.float32], IntArray],
    residual: ComplexArray,
    columns: Columns,
    threshold: float,
    levels: FloatArray,
) -> Candidate:
    """Return the first usable of the highest grid peaks, refined if that stays clear.

    Parameters
    ----------
    peaks : (R, C) and (R,)
        See `candidate_peaks`; those that are tried are cleared.
    residual : (A P, N) complex
        Received signal minus the interference estimate.
    columns : Columns
        The components there are.
    threshold : float
        T, linear; the sum of the antennas' ratios is compared with it.
    levels : (C,) or (1,) float
        Noise at the beats of the grid, or at all, in units of 1/lambda.
    """
    parts, others = split(residual), columns_as_parts(columns)
    power, highest = peaks
    num_rows, num_columns = power.shape
    num_antennas, noise_precision = columns.amplitudes.shape[1], columns.noise_precision
    moving = is_moving(columns.migration)
    best = Candidate(0.0, 0.0, 0.0, 0.0, True)
    for _ in range(CANDIDATE_PEAKS):
        row, column = next_peak(power, highest)
        peak = np.array([column / num_columns, row / num_rows])
        if moving:
            peak[1] = moving_doppler(row, num_rows, columns, columns.migration)
        # zeta from (70) with gamma = 0
        top = ascend(peak, 0.0, parts, others, NEW_COMPONENT_STEPS)
        # The refined point first; where it ran into a component, the grid point itself.
        for beat, doppler, jet in (
            (top.beat, top.doppler, top.end),
            (peak[0], peak[1], top.start),
        ):
            level = levels[int(np.rint(beat * len(levels))) % len(levels)]
            candidate = candidate_at(
                beat, doppler, jet, num_antennas, noise_precision, level, moving
            )
            if candidate.ratio > threshold and not candidate.absorbed:
                return candidate
            if candidate.ratio > best.ratio:
                best = candidate
    return best
