"""Run of one method of a comparison: its repair, if any, and the estimator that follows.

A mitigation method repairs the frame first; then the object-only estimator looks for objects in the
cleaned frame, iteration by iteration as well. An estimator works on the received frame at once.
"""

import time
from dataclasses import dataclass, replace

import numpy as np

from vsep._typing import BoolArray, ComplexArray
from vsep.errors import InputError
from vsep.inference.core.estimator import Estimator
from vsep.inference.core.progress import Termination
from vsep.inference.core.run import guarded_step
from vsep.inference.core.state import SeparationState
from vsep.mitigation.method import Mitigation, MitigationState


@dataclass(frozen=True, kw_only=True, eq=False)
class MethodRun:
    """A method that is ready to work on a frame."""

    name: str  #: The name a user calls it by.
    received: ComplexArray  #: (P, N) complex: The frame.
    mask: BoolArray  #: (P, N) bool: True where a sample is taken for interfered.
    repair: Mitigation | None  #: What cleans the frame; None for an estimator.
    estimator: Estimator  #: What finds the objects.
    #: Peaks of earlier frames that its prior knows; None for a method without a prior.
    num_prior_peaks: int | None = None


@dataclass(frozen=True, kw_only=True, eq=False)
class MethodRunState:
    """Where a method stands."""

    #: (P, N) complex: The frame as received or as repaired so far: what the estimator sees.
    observed: ComplexArray
    repair: MitigationState | None  #: State of the repair; None for an estimator.
    separation: SeparationState | None  #: State of the estimator; None before its turn.
    #: Seconds that the two stages took.
    repair_s: float = 0.0
    detection_s: float = 0.0
    termination: Termination = Termination.RUNNING  #: Whether it has ended, and why.

    @property
    def cleaned(self) -> ComplexArray:
        """(P, N) frame without what the method takes for interference."""
        if self.separation is None:
            return self.observed
        return self.separation.cleaned(self.observed)


def open_method_run(method_run: MethodRun) -> MethodRunState:
    """Return the state before the first iteration.

    Raises `InputError` if the method cannot work on the frame; the sentence names it.
    """
    try:
        if method_run.repair is None:
            separation = method_run.estimator.init(method_run.received)
            return MethodRunState(observed=method_run.received, repair=None, separation=separation)
        repair = method_run.repair.init(method_run.received, method_run.mask)
        state = MethodRunState(observed=method_run.received, repair=repair, separation=None)
        return _repaired(method_run, state, repair, 0.0)
    except InputError as error:
        raise _naming(method_run, error) from error


def advance_method_run(method_run: MethodRun, state: MethodRunState) -> MethodRunState:
    """Do one iteration of the stage that a method is in; one that has ended stays as it is.

    Raises `InputError` if no objects can be looked for in the repaired frame; the sentence names
    the method.
    """
    if state.termination is not Termination.RUNNING:
        return state
    try:
        if method_run.repair is not None and state.repair is not None and state.separation is None:
            start = time.perf_counter()
            repair = method_run.repair.step(method_run.received, method_run.mask, state.repair)
            return _repaired(method_run, state, repair, time.perf_counter() - start)
    except InputError as error:
        raise _naming(method_run, error) from error
    assert state.separation is not None
    step = guarded_step(method_run.estimator, state.observed, state.separation)
    return replace(
        state,
        separation=step.state,
        detection_s=state.detection_s + step.seconds,
        termination=step.termination,
    )


def _repaired(
    method_run: MethodRun, state: MethodRunState, repair: MitigationState, seconds: float
) -> MethodRunState:
    """Take an iteration of the repair; after the last one it is the estimator's turn."""
    assert method_run.repair is not None
    cleaned = np.asarray(repair.cleaned, dtype=np.complex128)
    finished = method_run.repair.terminate(repair) is not Termination.RUNNING
    return replace(
        state,
        observed=cleaned,
        repair=repair,
        separation=method_run.estimator.init(cleaned) if finished else None,
        repair_s=state.repair_s + seconds,
    )


def _naming(method_run: MethodRun, error: InputError) -> InputError:
    return InputError(f"{method_run.name}: {error}")
