"""Calm iterations: they change next to nothing, and some of them in a row end a run.

Single channel components at their threshold come and go for ever. A run whose objects move by less
than a tenth of their deviation meanwhile is as good as converged.
"""

from typing import Final

import numpy as np

from vsep._typing import BoolArray, FloatArray
from vsep.inference.core.estimator import SETTLING_EVENTS
from vsep.inference.core.progress import IterationInfo
from vsep.inference.core.schedule import Schedule
from vsep.inference.core.state import ObjectComponents, SeparationState
from vsep.inference.objects.uncertainty import dispersion_std
from vsep.signal.template import SignalModel

CALM_ITERATIONS: Final = 2
CALM_DEVIATIONS: Final = 0.1  # by which an object moves at most
# Late in a run, where it shares a resolution cell with others: what moves on explains one smear.
CALM_WITHIN_A_CELL: Final = 1.0
CALM_NOISE: Final = 3e-3  # relative change of lambda at most


def calm_iterations(
    schedule: Schedule,
    state: SeparationState,
    info: IterationInfo,
    objects: ObjectComponents,
    model: SignalModel,
) -> int:
    """Calm iterations in a row, that from a state to its next objects included.

    Parameters
    ----------
    schedule : Schedule
        Says from when on iterations count: all parts of the model have begun.
    state : SeparationState
        Where the step started from.
    info : IterationInfo
        Of the step.
    objects : ObjectComponents
        After the step.
    model : SignalModel
        Size of the frame, and how objects move in it.
    """
    if not (schedule.ends_when_calm and schedule.weights_begun(state.iteration)):
        return 0
    settled = all(event.kind in SETTLING_EVENTS for event in info.events)
    if not settled or abs(info.noise_precision_change) >= CALM_NOISE:
        return 0
    change = info.max_frequency_change
    if change >= CALM_DEVIATIONS and state.iteration >= schedule.smears_from:
        # Within a resolution cell deviations are many times those of isolated lines.
        change = _largest_change(state, objects, model, schedule.smear_cells)
    return state.calm_iterations + 1 if change < CALM_DEVIATIONS else 0


def _largest_change(
    state: SeparationState, after: ObjectComponents, model: SignalModel, reach_cells: float
) -> float:
    """Largest change of a frequency in deviations that know of the other objects."""
    before, precision = state.objects, state.noise_precision
    deviation = dispersion_std(after, precision, model.shape, migration=model.migration)
    beats = _cyclic(after.beats - before.beats) / np.maximum(deviation.beats, 1e-300)
    dopplers = _cyclic(after.dopplers - before.dopplers) / np.maximum(deviation.dopplers, 1e-300)
    change = np.maximum(beats, dopplers)
    change[_share_a_cell(after, model.shape, reach_cells)] *= CALM_DEVIATIONS / CALM_WITHIN_A_CELL
    return float(change.max())


def _share_a_cell(
    objects: ObjectComponents, shape: tuple[int, int], reach_cells: float
) -> BoolArray:
    """(L,) whether another object is closer than some resolution cells along both axes."""
    num_ramps, num_samples = shape
    near = _cyclic(objects.beats[:, None] - objects.beats) * num_samples < reach_cells
    near &= _cyclic(objects.dopplers[:, None] - objects.dopplers) * num_ramps < reach_cells
    return np.asarray(near.sum(axis=1) > 1)


def _cyclic(change: FloatArray) -> FloatArray:
    return np.asarray(np.abs(change - np.rint(change)))
