"""What every estimator offers, and when a run has settled."""

from typing import Protocol

from vsep._typing import ComplexArray
from vsep.errors import InputError
from vsep.inference.core.progress import EventKind, IterationInfo, Termination
from vsep.inference.core.state import SeparationState
from vsep.signal.template import SignalModel

SETTLED_DEVIATIONS = 0.01  # objects move by less than this share of their standard deviation ...
SETTLED_NOISE = 1e-3  # ... and lambda by less than this share (its own is 1/sqrt(PN)): converged
# A channel component at its threshold may come and go for ever; what it moves is looked at instead.
SETTLING_EVENTS = {EventKind.OBJECT_REJECTED, EventKind.CHANNEL_ADDED, EventKind.CHANNEL_PRUNED}


class Estimator(Protocol):
    """What every estimator offers: a state, a pure step, and when to stop."""

    @property
    def model(self) -> SignalModel:
        """Size, sampling and assumed filter."""

    @property
    def threshold_db(self) -> float:
        """Object threshold T_alpha in force, dB."""

    def init(self, received: ComplexArray) -> SeparationState:
        """State before the first step; raises `InputError` for an unusable frame."""

    def step(
        self, received: ComplexArray, state: SeparationState
    ) -> tuple[SeparationState, IterationInfo]:
        """One main iteration: a pure function of its two arguments."""

    def terminate(self, state: SeparationState, info: IterationInfo) -> Termination:
        """Whether a run goes on after this step."""


def require_one_antenna(model: SignalModel, name: str) -> None:
    """Raise `InputError` where an estimator is asked to take several antennas together."""
    if model.num_antennas > 1:
        raise InputError(
            f"The {name} estimator is given {model.num_antennas} antennas; it takes 1, factorised "
            "and object-only take several."
        )


def is_quiet(info: IterationInfo) -> bool:
    """Whether a step changed nothing that matters."""
    return (
        all(event.kind in SETTLING_EVENTS for event in info.events)
        and info.max_frequency_change < SETTLED_DEVIATIONS
        and abs(info.noise_precision_change) < SETTLED_NOISE
    )


def settle(state: SeparationState, max_iterations: int, *, converged: bool) -> Termination:
    """Verdict after a step."""
    if converged:
        return Termination.CONVERGED
    if state.iteration >= max_iterations:
        return Termination.MAX_ITERATIONS
    return Termination.RUNNING
