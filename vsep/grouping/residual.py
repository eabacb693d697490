"""Remainder of a frame beside an estimate: cells of range and velocity, weak lines in them."""

from dataclasses import dataclass
from typing import Final

import numpy as np

from vsep._typing import BoolArray, ComplexArray, FloatArray, IntArray
from vsep.grouping.windows import Cells, Window
from vsep.inference.core.state import ObjectComponents, SeparationState
from vsep.inference.core.thresholds import threshold_from_false_alarm_rate
from vsep.inference.objects.workspace import (
    ObjectThreshold,
    ObjectWorkspace,
    candidate_grid,
    no_objects,
)
from vsep.kernels.moving_atoms import fold_width
from vsep.signal.keystone import SingleComplexArray, keystone_dopplers
from vsep.signal.radar import ChirpSequence

FALSE_LINES: Final = 0.1  # in a window of noise alone
MOST_LINES: Final = 8  # below the threshold, of a group
LOUD_FRAMES: Final = 0.01  # of frames of noise have a sample that is taken for a burst's


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class Residual:
    """The residual of an estimate.

    Parameters
    ----------
    state : SeparationState
        The estimate.
    left : (A P, N) complex
        What was received, without interference and objects.
    radar : ChirpSequence
        Which radar received it.
    cells : Cells
        The residual over the noise; columns begin at the lowest beat of the radar. Rows are those
        of the first interval of Doppler frequency: lines this weak do not tell theirs.
    dopplers : (R,) float
        Of the rows.
    first_row : int
        Row of `candidate_grid` that is the first of the cells.
    """

    state: SeparationState
    left: ComplexArray
    radar: ChirpSequence
    cells: Cells
    dopplers: FloatArray
    first_row: int

    def places(self) -> list[tuple[int, int]]:
        """Row and column of every object of the estimate."""
        objects, num_columns = self.state.objects, self.radar.num_samples
        apart = (objects.dopplers[:, None] - self.dopplers) / self._interval
        rows = np.argmin(abs(apart - np.rint(apart)), axis=1)
        beats = (objects.beats - self.radar.lowest_beat) * num_columns
        columns = np.rint(beats).astype(np.int64) % num_columns
        return [(int(row), int(column)) for row, column in zip(rows, columns, strict=True)]

    @property
    def _interval(self) -> float:
        """Doppler frequencies that differ by it are the same, but for the migration."""
        moving = self.radar.motion.coupling != 0.0
        return fold_width(self.radar.motion, self.radar.num_samples) if moving else 1.0

    def beats_of(self, window: Window) -> FloatArray:
        """Beats of the first and the last cell of a window."""
        ends = np.array([window.first, window.first + window.num_cells - 1])
        return np.asarray(self.radar.lowest_beat + ends / self.radar.num_samples)


def residual_of(
    received: ComplexArray,
    state: SeparationState,
    radar: ChirpSequence,
    missing: BoolArray | None = None,
) -> Residual:
    """Return what an estimate leaves of a frame.

    Parameters
    ----------
    received : (P, N) or (A, P, N) complex
        The frame.
    state : SeparationState
        The estimate.
    radar : ChirpSequence
        Which radar received it.
    missing : (A P, N) bool, optional
        Samples that were never received.
    """
    left = state.cleaned(received.reshape(state.object_signal.shape)) - state.object_signal
    if missing is not None:
        left[missing.reshape(left.shape)] = 0.0
    left[_loud(left)] = 0.0
    signals = left.reshape(-1, *radar.shape)
    weights, share = state.sample_weights, state.used_share
    if weights is not None:
        share = float(np.mean(weights**2))
    transforms = candidate_grid(signals.astype(np.complex64), radar.motion)
    dopplers, first_row = _rows(radar)
    chosen = transforms[:, first_row : first_row + len(dopplers), _columns(radar)]
    powers = np.sum(chosen.real.astype(np.float64) ** 2 + chosen.imag**2, axis=0)
    powers *= _scale(transforms, radar) * state.noise_precision / share
    beats = radar.lowest_beat + np.arange(radar.num_samples) / radar.num_samples
    if state.relative_noise is not None:
        powers /= state.relative_noise.level(beats)
    return Residual(
        state=state,
        left=left,
        radar=radar,
        cells=Cells(powers=powers, num_antennas=len(signals)),
        dopplers=dopplers,
        first_row=first_row,
    )


def _loud(left: ComplexArray) -> BoolArray:
    """Find samples louder than noise ever is: those of a burst that the estimate does not explain.

    The power of noise is exponentially distributed, its mean the median over log 2: in all but
    `LOUD_FRAMES` of the frames of noise no sample reaches the limit. Extended objects are below the
    noise in every sample; a burst in a few ramps has power at all ranges, as long groups have.
    """
    powers = left.real**2 + left.imag**2
    mean = np.median(powers[powers > 0.0]) / np.log(2.0) if np.any(powers) else 0.0
    return np.asarray(powers > mean * np.log(left.size / LOUD_FRAMES))


def _rows(radar: ChirpSequence) -> tuple[FloatArray, int]:
    """Doppler frequencies of the first interval in `candidate_grid`, and the row of the first."""
    num_rows = 1 if radar.num_ramps == 1 else 2 * radar.num_ramps
    if radar.motion.coupling == 0.0:
        return np.arange(num_rows) / num_rows, 0
    first = num_rows * radar.motion.folds
    return keystone_dopplers(radar.shape, radar.motion)[first : first + num_rows], first


def _columns(radar: ChirpSequence) -> IntArray:
    """Columns of the grid of candidates that are whole cells apart, from the lowest beat on."""
    size = 2 * radar.num_samples
    return (round(radar.lowest_beat * size) + 2 * np.arange(radar.num_samples)) % size


def _scale(transforms: SingleComplexArray, radar: ChirpSequence) -> float:
    """Factor of squared magnitudes that makes the transforms products with unit-norm atoms."""
    if radar.motion.coupling != 0.0:
        return 1.0
    return float(transforms[0].size) ** 2 / (radar.num_ramps * radar.num_samples)


def weak_lines(residual: Residual, window: Window) -> ObjectComponents:
    """Estimate the lines of a group in a window, each above the noise of that window only.

    The threshold is that of `FALSE_LINES` false alarms in a frame as large as the window.

    Parameters
    ----------
    residual : Residual
        Of an estimate.
    window : Window
        Of the group.
    """
    state, radar = residual.state, residual.radar
    num_antennas = residual.cells.num_antennas
    size = min(radar.num_ramps, 2), window.num_cells, num_antennas
    num_rows = len(residual.dopplers) * (2 * radar.motion.folds + 1)
    searched = np.zeros((num_rows, 2 * radar.num_samples), dtype=np.bool_)
    first = round(2 * radar.num_samples * radar.lowest_beat) + 2 * window.first
    columns = np.arange(first - 1, first + 2 * window.num_cells) % (2 * radar.num_samples)
    rows = np.array(residual.cells.rows_beside(window.row)) + residual.first_row
    searched[rows[:, None], columns] = True
    workspace = ObjectWorkspace(
        no_objects(num_antennas),
        residual.left,
        state.noise_precision,
        threshold=ObjectThreshold(
            threshold_from_false_alarm_rate(FALSE_LINES, *size), state.relative_noise
        ),
        next_id=state.next_component_id,
        num_antennas=num_antennas,
        migration=radar.motion,
    )
    workspace.searched = searched
    workspace.add_components(MOST_LINES)
    return workspace.components()
