"""One frame of a sequence, separated from what the frame before it predicts.

Objects begin where the last frame's have moved to. They are fitted to the samples that hold no
interference; where there is none, objects are all there is to estimate. Otherwise the bursts are
searched in what the objects leave, which is free of them, and a short schedule follows. What the
prediction does not fit is separated like the first frame.
"""

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from typing import Final, Literal, NamedTuple

import numpy as np

from vsep._typing import ComplexArray
from vsep.inference.accelerating import (
    AcceleratingSeparator,
    fitted_signal,
    joined_objects,
)
from vsep.inference.core.estimator import Estimator
from vsep.inference.core.progress import Solution, Termination
from vsep.inference.core.run import run
from vsep.inference.core.schedule import ROBUST, Schedule
from vsep.inference.core.state import BurstComponents, ObjectComponents, SeparationState
from vsep.inference.factorised import FactorisedSeparator
from vsep.inference.objects.object_only import ObjectOnlySeparator, ObjectSettings
from vsep.kernels.clock import computing_s
from vsep.signal.radar import ChirpSequence
from vsep.tracking.accelerating import taken_off
from vsep.tracking.bursts import fitted_bursts
from vsep.tracking.clean_frame import separate_clean
from vsep.tracking.clean_samples import fit_clean_samples
from vsep.tracking.prediction import predicted_state

Start = Literal["cold", "warm", "clean", "repeated"]
"""Ways in which a frame was separated."""

WARM: Final[Schedule] = replace(
    ROBUST,
    name="warm",
    # Objects and bursts are known but for what is new, and for bursts under others.
    early_search=(0, 1),
    early_burst_range_db=ROBUST.burst_range_db,
    correct_filter=(1, 8),
    weigh_from=1,
    objects_nearby=True,
    noise_from=1,
)
"""Order of the updates that follow the fits to clean samples and bursts."""

FLOODED: Final = 2.0  # times what is known to be there: interference for certain


@dataclass(frozen=True, slots=True, eq=False)
class FrameSolution:
    """Outcome of one frame of a sequence.

    Parameters
    ----------
    solution : Solution
        Last state and diagnostics; its seconds are those of the steps.
    start : {"cold", "warm", "clean", "repeated"}
        From nothing; from the last frame's objects; likewise, without interference; the same frame
        again.
    seconds : float
        Time of the whole frame.
    """

    solution: Solution
    start: Start
    seconds: float


def separate_warm(
    separator: FactorisedSeparator,
    received: ComplexArray,
    last: SeparationState,
    radar: ChirpSequence,
    elapsed_s: float,
    before: ObjectComponents | None = None,
    *,
    accelerating: bool = False,
) -> FrameSolution:
    """Separate a frame from what another predicts, or from nothing where that does not fit.

    Parameters
    ----------
    separator : FactorisedSeparator
        Settings; its schedule is that of frames from nothing.
    received : (P, N) or (A, P, N) complex
        The frame.
    last : SeparationState
        The end of the frame before.
    radar : ChirpSequence
        The victim.
    elapsed_s : float
        From that frame to this one.
    before : ObjectComponents, optional
        Of the frame before that one, see `vsep.tracking.prediction.predicted_objects`.
    accelerating : bool
        Whether objects that accelerate are modelled, see `vsep.tracking.accelerating`.

    Raises
    ------
    InputError
        If the frame cannot be used.
    """
    began = computing_s()
    rows = separator.model.check(received)
    with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
        predicted = predicted_state(last, radar, elapsed_s, before)
        separate = _with_accelerating if accelerating else _from_prediction
        try:
            outcome = separate(separator, rows, predicted, last.bursts)
        except np.linalg.LinAlgError:
            outcome = None
    if outcome is None:
        outcome = separate_cold(separator, rows, last, accelerating=accelerating)
    return replace(outcome, seconds=computing_s() - began)


def _from_prediction(
    separator: FactorisedSeparator,
    rows: ComplexArray,
    predicted: SeparationState,
    last_bursts: Sequence[BurstComponents],
) -> FrameSolution | None:
    """Separate a frame from what another predicts; None where that does not fit."""
    possible = separator.missing is None and separator.model.is_stationary
    if possible and not _is_flooded(rows, predicted):
        clean = separate_clean(_object_only(separator), rows, predicted)
        if clean is not None:
            return FrameSolution(clean, "clean", 0.0)
    fitted = _fitted(separator, rows, predicted, last_bursts)
    return None if fitted is None else _ended(fitted.estimator, rows, fitted.state, fitted.start)


def _with_accelerating(
    separator: FactorisedSeparator,
    rows: ComplexArray,
    predicted: SeparationState,
    last_bursts: Sequence[BurstComponents],
) -> FrameSolution | None:
    """As `_from_prediction`, beside objects that accelerate."""
    model = separator.model
    fits, others = taken_off(rows, predicted, model)
    signal = fitted_signal(fits, model.shape, model.num_antennas)
    fitted = _fitted(separator, rows - signal, others, last_bursts)
    if fitted is None:
        return None
    state = fitted.state
    objects = joined_objects(state.objects, fits, state.effective_precision)
    state = replace(state, objects=objects, object_signal=state.object_signal + signal)
    return _ended(AcceleratingSeparator(inner=fitted.estimator), rows, state, fitted.start)


class _Fitted(NamedTuple):
    """What a run begins with."""

    start: Start
    estimator: Estimator
    state: SeparationState


def _fitted(
    separator: FactorisedSeparator,
    rows: ComplexArray,
    predicted: SeparationState,
    last_bursts: Sequence[BurstComponents],
) -> _Fitted | None:
    """Fit what is predicted to a frame; None where too few samples are without bursts."""
    fit = fit_clean_samples(separator, rows, predicted)
    if not fit.is_usable:
        return None
    if fit.is_clean:
        return _Fitted("clean", _object_only(separator), fit.state)
    warm = replace(separator, schedule=WARM)
    return _Fitted("warm", warm, fitted_bursts(warm, rows, fit.state, last_bursts, fit.interfered))


def _ended(
    estimator: Estimator, rows: ComplexArray, state: SeparationState, start: Start
) -> FrameSolution | None:
    """Run to the end; None where a value became infinite."""
    solution = run(estimator, rows, state)
    if solution.termination is Termination.NONFINITE:
        return None
    return FrameSolution(solution, start, 0.0)


def _is_flooded(rows: ComplexArray, predicted: SeparationState) -> bool:
    """Whether a sample is louder than all objects together could make it."""
    amplitudes = np.abs(predicted.objects.amplitudes)
    num_antennas = amplitudes.shape[1] if amplitudes.ndim == 2 else 1
    # unit-norm atoms: 1/sqrt(PN) in every sample of an antenna
    atom = np.sqrt(num_antennas / rows.size)
    largest = atom * amplitudes.sum(axis=0).max(initial=0.0)
    noise = np.sqrt(1.0 / predicted.noise_precision)
    return bool(max(rows.real.max(), rows.imag.max()) > FLOODED * (largest + 5.0 * noise))


def separate_cold(
    separator: FactorisedSeparator,
    received: ComplexArray,
    last: SeparationState | None = None,
    *,
    accelerating: bool = False,
) -> FrameSolution:
    """Separate a frame from nothing; identities of objects go on from those of another state."""
    began = computing_s()
    state = separator.init(received)
    if last is not None:
        state = replace(state, next_component_id=last.next_component_id)
    estimator = AcceleratingSeparator(inner=separator) if accelerating else separator
    return FrameSolution(run(estimator, received, state), "cold", computing_s() - began)


def _object_only(separator: FactorisedSeparator) -> ObjectOnlySeparator:
    """Return the object-only estimator with the settings that both have."""
    names = [each.name for each in fields(ObjectSettings)]
    return ObjectOnlySeparator(**{name: getattr(separator, name) for name in names})
