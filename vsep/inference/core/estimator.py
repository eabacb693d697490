"""Protocol and record of the estimators, and when a run has settled."""

from dataclasses import dataclass
from inspect import signature
from typing import ClassVar, Protocol

from vsep._typing import ComplexArray
from vsep.errors import InputError
from vsep.inference.core.progress import EventKind, IterationInfo, Termination
from vsep.inference.core.state import SeparationState
from vsep.registry import Entry
from vsep.signal.dithered_atoms import RampDither
from vsep.signal.template import SignalModel

SETTLED_DEVIATIONS = 0.01  # objects move by less than this share of their standard deviation ...
SETTLED_NOISE = 1e-3  # ... and lambda by less than this share (its own is 1/sqrt(PN)): converged
# A channel component at its threshold may come and go for ever; what it moves is looked at instead.
SETTLING_EVENTS = {EventKind.OBJECT_REJECTED, EventKind.CHANNEL_ADDED, EventKind.CHANNEL_PRUNED}


class Estimator(Protocol):
    """A frozen bag of settings with ``init``, ``step`` and ``terminate``."""

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


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class EstimatorEntry(Entry):
    """An estimator.

    It stands in the tuple ``ENTRIES`` of the estimator's own file, or another distribution declares
    it or the estimator's class as an entry point of ``vsep.estimators``. The usual settings are
    ``false_alarm_rate``, ``object_threshold_db``, ``interference_threshold_db``, ``schedule``,
    ``max_iterations`` and, for the samples to ignore, ``mask``.

    Parameters
    ----------
    name, factory, label, help, group, position
        As of `vsep.registry.Entry`; the factory makes an `Estimator` and takes a ``model``,
        and ``missing``, the samples that were never received, if it can leave samples out.
    several_antennas : bool
        Whether it takes what several antennas received apart together.
    in_every_study : bool
        Whether studies run it that do not name their methods.

    Examples
    --------
    >>> from vsep.inference.objects.object_only import ObjectOnlySeparator
    >>> EstimatorEntry(name="mine", factory=ObjectOnlySeparator).settings
    ('false_alarm_rate', 'object_threshold_db', 'max_iterations', 'range_migration')
    """

    kind: ClassVar[str] = "estimator"
    # What was never received belongs to the frame, as the model does.
    bound: ClassVar[tuple[str, ...]] = ("model", "missing")

    several_antennas: bool = False
    in_every_study: bool = True

    @property
    def takes_missing(self) -> bool:
        """Whether it can be told which samples were never received."""
        return "missing" in signature(self.factory).parameters

    @property
    def needs_mask(self) -> bool:
        """Whether it is told which samples to ignore."""
        return "mask" in self.settings


def require_one_antenna(model: SignalModel, name: str) -> None:
    """Raise `InputError` where an estimator is asked to take several antennas together."""
    if model.num_antennas > 1:
        raise InputError(
            f"The {name} estimator is given {model.num_antennas} antennas; it takes 1, factorised "
            "and object-only take several."
        )


def require_stationary(model: SignalModel, name: str) -> None:
    """Raise `InputError` where an estimator is asked to model range migration or dithering."""
    if isinstance(model.migration, RampDither):
        raise InputError(
            f"The ramps are dithered, which the {name} estimator does not model; factorised, "
            "object-only and masked do."
        )
    if not model.is_stationary:
        raise InputError(
            f"The {name} estimator does not model range migration; factorised, object-only and "
            "masked do. With range_migration neglected it can be used."
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
