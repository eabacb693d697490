"""Algorithm 1: the factorised separator, and object estimation alone.

Estimators are frozen bags of settings with ``init``, ``step`` and ``terminate``; everything that
changes is in the state, so a run can be paused, resumed and stepped back exactly.
"""

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

from vsep._arrays import ComplexArray, InputError, from_db, require_range, to_db
from vsep.inference.elbo import noise_bound, weights_bound
from vsep.inference.interference import InterferenceWorkspace
from vsep.inference.objects import ObjectWorkspace, no_objects
from vsep.inference.sbl import threshold_from_false_alarm_rate
from vsep.inference.schedule import Schedule, schedule_by_name
from vsep.inference.state import (
    ComponentEvent,
    EventKind,
    IterationInfo,
    SeparationState,
    Termination,
)
from vsep.signal.atoms import line_factors, project
from vsep.signal.template import SignalModel

SETTLED_DEVIATIONS = 0.01  # objects move by less than this share of their standard deviation ...
SETTLED_NOISE = 1e-4  # ... and lambda by less than this share (its own is 1/sqrt(PN)): converged


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


@dataclass(frozen=True, kw_only=True, slots=True)
class ObjectOnlySeparator:
    """Algorithm 3 alone: interference is neglected.

    Parameters
    ----------
    model : SignalModel
        Size, sampling and assumed filter (which plays no part here).
    false_alarm_rate : float
        Expected false alarms in a noise-only frame; sets the object threshold.
    object_threshold_db : float or None
        The threshold itself, in place of the rate.
    max_iterations : int
        Where a run stops at the latest.
    """

    model: SignalModel
    false_alarm_rate: float = 0.05
    object_threshold_db: float | None = None
    max_iterations: int = 100

    def __post_init__(self) -> None:
        """Check the settings."""
        require_range("false_alarm_rate", self.false_alarm_rate, 1e-9, 1e3, "per frame")
        if self.object_threshold_db is not None:
            require_range("object_threshold_db", self.object_threshold_db, 0.0, 100.0, "dB")
        require_range("max_iterations", self.max_iterations, 1, 100_000)

    @property
    def threshold_db(self) -> float:
        """Object threshold T_alpha in force, dB."""
        if self.object_threshold_db is not None:
            return self.object_threshold_db
        shape = self.model.shape
        return float(to_db(threshold_from_false_alarm_rate(self.false_alarm_rate, *shape)))

    def init(self, received: ComplexArray) -> SeparationState:
        """State before the first step: no component, lambda = 2 (NP - 1) / ||r||^2.

        Raises
        ------
        InputError
            If the frame has another shape, is all zero, or holds a value that is not finite.
        """
        received = self.model.check(received)
        return SeparationState(
            iteration=0,
            objects=no_objects(),
            interference=(None,) * self.model.num_ramps,
            noise_precision=2.0 * (received.size - 1) / float(np.sum(np.abs(received) ** 2)),
            object_signal=np.zeros(self.model.shape, dtype=np.complex128),
            interference_signal=np.zeros(self.model.shape, dtype=np.complex128),
            next_component_id=0,
        )

    def step(
        self, received: ComplexArray, state: SeparationState
    ) -> tuple[SeparationState, IterationInfo]:
        """One iteration of Algorithm 3 on the received signal itself."""
        objects = _run_objects(received, state, self.threshold_db)
        error = _expected_error(received, objects.signal, np.zeros(()), objects.active.trace())
        noise_precision = received.size / error
        bound = weights_bound(
            objects.active.amplitudes, objects.active.covariance, objects.active.precisions
        ) + noise_bound(received.size, noise_precision, error)
        new_state = replace(
            state,
            iteration=state.iteration + 1,
            objects=objects.components(),
            noise_precision=noise_precision,
            object_signal=objects.signal,
            next_component_id=objects.next_id,
        )
        return new_state, IterationInfo(
            elbo=bound,
            events=tuple(objects.events),
            max_frequency_change=objects.max_frequency_change,
            noise_precision_change=noise_precision / state.noise_precision - 1.0,
            searched=False,
            separability_ratio_db=float("nan"),
        )

    def terminate(self, state: SeparationState, info: IterationInfo) -> Termination:
        """Converged when nothing happened, nothing moved and lambda is steady."""
        return _termination(state, self.max_iterations, is_quiet(info))


@dataclass(frozen=True, kw_only=True, slots=True)
class FactorisedSeparator:
    """Algorithm 1, the factorised posterior q(alpha) q(beta).

    Parameters
    ----------
    model : SignalModel
        Size, sampling and assumed filter.
    false_alarm_rate : float
        Expected false alarms in a noise-only frame; sets the object threshold.
    object_threshold_db : float or None
        The threshold itself, in place of the rate; the paper's 9 dB is set here.
    interference_threshold_db : float or None
        T_beta; None takes the schedule's (6 dB robust, 3 dB paper).
    schedule : {"robust", "paper"}
        Order of the updates, see `vsep.inference.schedule`.
    max_iterations : int
        Where a run stops at the latest.

    Examples
    --------
    >>> from vsep.signal.filters import RaisedCosineFilter
    >>> model = SignalModel(num_ramps=16, num_samples=128, sample_rate_hz=5.1e6,
    ...                     anti_aliasing_filter=RaisedCosineFilter(cutoff_hz=1.275e6, rolloff=0.25))
    >>> round(FactorisedSeparator(model=model, false_alarm_rate=0.05).threshold_db, 1)
    11.2
    """

    model: SignalModel
    false_alarm_rate: float = 0.05
    object_threshold_db: float | None = None
    interference_threshold_db: float | None = None
    schedule: str = "robust"
    max_iterations: int = 100

    def __post_init__(self) -> None:
        """Check the settings."""
        self._object_only()
        schedule_by_name(self.schedule)
        if self.interference_threshold_db is not None:
            name = "interference_threshold_db"
            require_range(name, self.interference_threshold_db, 0.0, 100.0, "dB")

    def _object_only(self) -> ObjectOnlySeparator:
        return ObjectOnlySeparator(
            model=self.model,
            false_alarm_rate=self.false_alarm_rate,
            object_threshold_db=self.object_threshold_db,
            max_iterations=self.max_iterations,
        )

    @property
    def threshold_db(self) -> float:
        """Object threshold T_alpha in force, dB."""
        return self._object_only().threshold_db

    def init(self, received: ComplexArray) -> SeparationState:
        """State before the first step; see `ObjectOnlySeparator.init`."""
        return self._object_only().init(received)

    def step(
        self, received: ComplexArray, state: SeparationState
    ) -> tuple[SeparationState, IterationInfo]:
        """One main iteration of Algorithm 1: interference, lambda, objects, lambda, weights."""
        schedule = schedule_by_name(self.schedule)
        interference = self._interference_workspace(schedule, state)
        residual = received - state.object_signal
        searched = schedule.search_due(state.iteration) or state.search_pending
        if searched:
            interference.search(residual, state.noise_precision)
        interference.update(residual, state.noise_precision)

        object_trace = _object_trace(state)
        error = _expected_error(
            received, state.object_signal, interference.signal, object_trace + interference.trace
        )
        state = replace(state, noise_precision=received.size / error)
        objects = _run_objects(received - interference.signal, state, self.threshold_db)
        object_signal = objects.signal
        traces = objects.active.trace() + interference.trace
        error = _expected_error(received, object_signal, interference.signal, traces)
        noise_precision = received.size / error
        interference.recompute(received - object_signal, noise_precision)

        info = IterationInfo(
            elbo=_separation_bound(received, objects, interference, noise_precision),
            events=(*interference.events, *objects.events),
            max_frequency_change=objects.max_frequency_change,
            noise_precision_change=noise_precision / state.noise_precision - 1.0,
            searched=searched,
            separability_ratio_db=_separability_ratio_db(objects, interference.signal),
        )
        new_state = replace(
            state,
            iteration=state.iteration + 1,
            objects=objects.components(),
            interference=interference.frozen_ramps(),
            noise_precision=noise_precision,
            object_signal=object_signal,
            interference_signal=interference.signal,
            next_component_id=objects.next_id,
            search_pending=schedule.search_before_convergence and is_quiet(info) and not searched,
        )
        return new_state, info

    def _interference_workspace(
        self, schedule: Schedule, state: SeparationState
    ) -> InterferenceWorkspace:
        threshold_db = self.interference_threshold_db
        if threshold_db is None:
            threshold_db = schedule.interference_threshold_db
        return InterferenceWorkspace(
            self.model, schedule, float(from_db(threshold_db)), state.interference
        )

    def terminate(self, state: SeparationState, info: IterationInfo) -> Termination:
        """Converged when quiet, and (robust schedule) a burst search agreed."""
        schedule = schedule_by_name(self.schedule)
        confirmed = info.searched or not schedule.search_before_convergence
        return _termination(state, self.max_iterations, confirmed and is_quiet(info))


def is_quiet(info: IterationInfo) -> bool:
    """Whether a step changed nothing that matters."""
    return (
        all(event.kind is EventKind.OBJECT_REJECTED for event in info.events)
        and info.max_frequency_change < SETTLED_DEVIATIONS
        and abs(info.noise_precision_change) < SETTLED_NOISE
    )


def count_events(events: Iterable[ComponentEvent], kind: EventKind) -> int:
    """Count the events of one kind."""
    return sum(event.kind is kind for event in events)


def require_estimator(name: str) -> type[FactorisedSeparator] | type[ObjectOnlySeparator]:
    """Return the estimator class a user names.

    Raises
    ------
    InputError
        If there is none of that name.
    """
    if name not in ESTIMATORS:
        raise InputError(f"estimator is {name!r}; it must be one of {', '.join(ESTIMATORS)}.")
    return ESTIMATORS[name]


ESTIMATORS: dict[str, type[FactorisedSeparator] | type[ObjectOnlySeparator]] = {
    "factorised": FactorisedSeparator,
    "object-only": ObjectOnlySeparator,
}


def _run_objects(
    residual: ComplexArray, state: SeparationState, threshold_db: float
) -> ObjectWorkspace:
    workspace = ObjectWorkspace(
        state.objects,
        residual,
        state.noise_precision,
        threshold=float(from_db(threshold_db)),
        next_id=state.next_component_id,
    )
    workspace.add_components(1)
    workspace.update_components()
    return workspace


def _termination(state: SeparationState, max_iterations: int, converged: bool) -> Termination:
    if converged:
        return Termination.CONVERGED
    if state.iteration >= max_iterations:
        return Termination.MAX_ITERATIONS
    return Termination.RUNNING


def _expected_error(
    received: ComplexArray, objects: ComplexArray, interference: ComplexArray, traces: float
) -> float:
    """Denominator of (65): residual energy plus the energy of the weights' uncertainty."""
    return float(np.sum(np.abs(received - objects - interference) ** 2)) + traces


def _object_trace(state: SeparationState) -> float:
    """tr(Phi C Phi^H) from ``lambda C G + C Gamma = I``: (L - sum gamma C_ll) / lambda."""
    objects = state.objects
    beat = line_factors(objects.beats, state.object_signal.shape[1])
    doppler = line_factors(objects.dopplers, state.object_signal.shape[0])
    gram = (beat.conj() @ beat.T) * (doppler.conj() @ doppler.T)
    return float(np.sum(objects.covariance * gram.T).real)


def _separation_bound(
    received: ComplexArray,
    objects: ObjectWorkspace,
    interference: InterferenceWorkspace,
    noise_precision: float,
) -> float:
    traces = objects.active.trace() + interference.trace
    error = _expected_error(received, objects.signal, interference.signal, traces)
    active = objects.active
    bound = weights_bound(active.amplitudes, active.covariance, active.precisions)
    for ramp in interference.ramps:
        if ramp is not None:
            bound += weights_bound(ramp.amplitudes, ramp.covariance, ramp.precisions)
    return bound + noise_bound(received.size, noise_precision, error)


def _separability_ratio_db(objects: ObjectWorkspace, interference: ComplexArray) -> float:
    """Condition (27): 20 log10 of ||Phi^H Phi alpha|| over ||Phi^H U Psi beta||."""
    factors = objects.beat_factors, objects.doppler_factors
    own = np.linalg.norm(project(objects.signal, *factors))
    other = np.linalg.norm(project(interference, *factors))
    if own == 0.0 or other == 0.0:
        return float("nan")
    return float(20.0 * np.log10(own / other))
