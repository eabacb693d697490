"""Algorithm 1: the factorised separator, one burst and its channel per ramp beside the objects.

Estimators are frozen bags of settings with ``init``, ``step`` and ``terminate``; everything that
changes is in the state, so a run can be paused, resumed and stepped back exactly.
"""

from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from vsep._arrays import ComplexArray, InputError, from_db, require_range
from vsep.inference.elbo import noise_bound, weights_bound
from vsep.inference.estimator import is_quiet, settle
from vsep.inference.interference import InterferenceWorkspace
from vsep.inference.object_only import ObjectOnlySeparator, expected_error, update_objects
from vsep.inference.objects import ObjectWorkspace
from vsep.inference.schedule import Schedule, schedule_by_name
from vsep.inference.state import IterationInfo, SeparationState, Termination
from vsep.signal.atoms import gram, line_factors, project
from vsep.signal.template import SignalModel


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
    ...                     anti_aliasing_filter=RaisedCosineFilter(cutoff_hz=1e6, rolloff=0.25))
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

        traces = _object_trace(state) + interference.trace
        error = expected_error(residual - interference.signal, traces)
        state = replace(state, noise_precision=received.size / error)
        objects = update_objects(received - interference.signal, state, self.threshold_db)
        object_signal = objects.signal
        residual = received - object_signal
        traces = objects.active.trace() + interference.trace
        error = expected_error(residual - interference.signal, traces)
        noise_precision = received.size / error
        interference.recompute(residual, noise_precision)

        info = IterationInfo(
            elbo=_separation_bound(residual, objects, interference, noise_precision),
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
        return settle(state, self.max_iterations, converged=confirmed and is_quiet(info))


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


ESTIMATORS: Final[dict[str, type[FactorisedSeparator] | type[ObjectOnlySeparator]]] = {
    "factorised": FactorisedSeparator,
    "object-only": ObjectOnlySeparator,
}


def _object_trace(state: SeparationState) -> float:
    """tr(Phi C Phi^H) of the state the step starts from."""
    objects = state.objects
    num_ramps, num_samples = state.object_signal.shape
    factors = line_factors(objects.beats, num_samples), line_factors(objects.dopplers, num_ramps)
    return float(np.sum(objects.covariance * gram(*factors).T).real)


def _separation_bound(
    residual: ComplexArray,
    objects: ObjectWorkspace,
    interference: InterferenceWorkspace,
    noise_precision: float,
) -> float:
    traces = objects.active.trace() + interference.trace
    error = expected_error(residual - interference.signal, traces)
    active = objects.active
    bound = weights_bound(active.amplitudes, active.covariance, active.precisions)
    for ramp in interference.ramps:
        if ramp is not None:
            bound += weights_bound(ramp.amplitudes, ramp.covariance, ramp.precisions)
    return bound + noise_bound(residual.size, noise_precision, error)


def _separability_ratio_db(objects: ObjectWorkspace, interference: ComplexArray) -> float:
    """Condition (27): 20 log10 of ||Phi^H Phi alpha|| over ||Phi^H U Psi beta||."""
    factors = objects.beat_factors, objects.doppler_factors
    own = np.linalg.norm(project(objects.signal, *factors))
    other = np.linalg.norm(project(interference, *factors))
    if own == 0.0 or other == 0.0:
        return float("nan")
    return float(20.0 * np.log10(own / other))
