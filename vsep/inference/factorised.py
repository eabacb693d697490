"""Algorithm 1: the factorised separator, one burst and its channel per ramp beside the objects.

Estimators are frozen bags of settings with ``init``, ``step`` and ``terminate``; everything that
changes is in the state, so a run can be paused, resumed and stepped back exactly.
"""

import math
from dataclasses import dataclass, replace

import numpy as np

from vsep._typing import ComplexArray
from vsep._validation import require_range
from vsep.inference.bursts.expected_bursts import ExpectedBursts
from vsep.inference.bursts.filter_correction import update_correction
from vsep.inference.bursts.outliers import drop_outliers
from vsep.inference.bursts.search import BurstSearch
from vsep.inference.bursts.workspace import InterferenceWorkspace
from vsep.inference.core.elbo import noise_bound, weights_bound
from vsep.inference.core.estimator import EstimatorEntry, is_quiet, settle
from vsep.inference.core.progress import IterationInfo, Termination
from vsep.inference.core.schedule import schedule_by_name
from vsep.inference.core.state import SeparationState
from vsep.inference.core.stopwatch import BURSTS, OBJECTS, SEARCH, part
from vsep.inference.objects.object_only import ObjectOnlySeparator, expected_error, update_objects
from vsep.inference.objects.workspace import ObjectWorkspace, objects_trace
from vsep.kernels.object_posterior import separable_projections
from vsep.signal.template import SignalModel
from vsep.units import from_db

STILL_DEVIATIONS = 0.003  # an object that moved by less promises too little to be moved again


@dataclass(frozen=True, kw_only=True, slots=True)
class FactorisedSeparator:
    """Algorithm 1, the factorised posterior q(alpha) q(beta).

    Parameters
    ----------
    model : SignalModel
        Size, sampling and assumed filter; with several antennas their frames are taken apart
        together, see `vsep.inference.objects.measurement_vectors`.
    false_alarm_rate : float
        Expected false alarms in a noise-only frame; sets the object threshold.
    object_threshold_db : float or None
        The threshold itself, in place of the rate; the paper's 9 dB is set here.
    interference_threshold_db : float or None
        T_beta; None takes the schedule's (6 dB robust, 3 dB paper).
    schedule : {"robust", "paper"}
        Order of the updates, see `vsep.inference.core.schedule`.
    max_iterations : int
        Where a run stops at the latest.
    expected_bursts : ExpectedBursts or None
        Where weak bursts are looked for as well, see `vsep.files.two_pass`.

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
    expected_bursts: ExpectedBursts | None = None

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
        with part(BURSTS):
            interference = self.interference_workspace(state)
        searched = self.search_due(state)
        if searched:
            with part(SEARCH):
                self.search(interference, received, state)
        used, num_used = self.set_aside(received, state)
        residual = used - state.object_signal
        with part(BURSTS):
            interference.update(residual, state.noise_precision)
            if self.correction_due(state, searched=searched):
                update_correction(interference, residual, state.noise_precision)

        traces = self._object_trace(state) + interference.trace
        bursts = interference.signal
        error = expected_error(residual - bursts, traces)
        with part(OBJECTS):
            objects = update_objects(
                used - bursts,
                replace(state, noise_precision=num_used / error),
                self.threshold_db,
                interference.schedule.object_additions(state.iteration),
                self.model.num_antennas,
            )
        residual = used - objects.signal
        traces = objects.active.trace() + interference.trace
        error = expected_error(residual - bursts, traces)
        noise_precision = num_used / error
        with part(BURSTS):
            interference.recompute(residual, noise_precision)
        bound = _separation_bound(residual, objects, interference, noise_precision, num_used)
        end = self.conclude(state, objects, interference, noise_precision, bound, searched)
        return self.confirmed(received, *end)

    def _object_trace(self, state: SeparationState) -> float:
        """tr(Phi C Phi^H) of the state the step starts from, at all antennas."""
        return objects_trace(state.objects, self.model.shape, self.model.num_antennas)

    def interference_workspace(self, state: SeparationState) -> InterferenceWorkspace:
        """Working copy of the interference estimate, with this separator's thresholds."""
        schedule = schedule_by_name(self.schedule)
        threshold_db = self.interference_threshold_db
        if threshold_db is None:
            threshold_db = schedule.interference_threshold_db
        return InterferenceWorkspace(
            self.model,
            schedule,
            float(from_db(threshold_db)),
            state.bursts,
            state.filter_correction,
            state.search_cache,
        )

    def search(
        self, interference: InterferenceWorkspace, received: ComplexArray, state: SeparationState
    ) -> None:
        """Look for bursts; late in a run only in what is not set aside."""
        schedule = interference.schedule
        if schedule.search_is_late(state.iteration):
            received, _ = self.set_aside(received, state)
        BurstSearch(
            interference,
            received - state.object_signal,
            state.noise_precision,
            weakest_share=schedule.weakest_burst_share(state.iteration),
            expected=self.expected_bursts,
        ).run()

    def set_aside(self, received: ComplexArray, state: SeparationState) -> tuple[ComplexArray, int]:
        """Replace samples that neither source explains, see `vsep.inference.bursts.outliers`.

        Returns
        -------
        received : (P, N) complex
            The frame to fit in this step.
        num_used : int
            Samples that count for the noise precision.
        """
        first = schedule_by_name(self.schedule).impute_from
        if first is None or state.iteration < first:
            return received, received.size
        return drop_outliers(received, state.object_signal + state.interference_signal)

    def correction_due(self, state: SeparationState, *, searched: bool) -> bool:
        """Whether the next step estimates the filter's correction: a first one with a search."""
        wanted = searched or state.filter_correction.num_splines > 0
        return wanted and schedule_by_name(self.schedule).correction_due(state.iteration)

    def search_due(self, state: SeparationState) -> bool:
        """Whether the next step searches every ramp for bursts."""
        due = schedule_by_name(self.schedule).search_due(state.iteration)
        return due or state.search_pending

    def conclude(
        self,
        state: SeparationState,
        objects: ObjectWorkspace,
        interference: InterferenceWorkspace,
        noise_precision: float,
        bound: float,
        searched: bool,
    ) -> tuple[SeparationState, IterationInfo]:
        """Freeze both working copies into the next state and its diagnostics."""
        components, object_signal = objects.components(), objects.signal
        signal = interference.signal
        info = IterationInfo(
            elbo=bound,
            events=(*interference.events, *objects.events),
            max_frequency_change=objects.max_frequency_change,
            noise_precision_change=noise_precision / state.noise_precision - 1.0,
            searched=searched,
            separability_ratio_db=_separability_ratio_db(objects, signal),
        )
        search_again = schedule_by_name(self.schedule).search_before_convergence and not searched
        new_state = replace(
            state,
            iteration=state.iteration + 1,
            objects=components,
            bursts=interference.frozen_bursts(),
            filter_correction=interference.correction,
            noise_precision=noise_precision,
            object_signal=object_signal,
            interference_signal=signal,
            next_component_id=objects.next_id,
            search_pending=search_again and is_quiet(info),
            search_cache=interference.search_cache,
        )
        return new_state, info

    def confirmed(
        self, received: ComplexArray, state: SeparationState, info: IterationInfo
    ) -> tuple[SeparationState, IterationInfo]:
        """Spare the next step if all it would begin with, a search, finds nothing new.

        That is, where it would move nothing either: the objects stand still and the filter is the
        assumed one, whose correction would go on changing.
        """
        moved = info.max_frequency_change > STILL_DEVIATIONS
        if not state.search_pending or moved or state.filter_correction.num_splines:
            return state, info
        interference = self.interference_workspace(state)
        with part(SEARCH):
            self.search(interference, received, state)
        if not interference.events and self.correction_due(state, searched=True):
            used, _ = self.set_aside(received, state)
            residual = used - state.object_signal
            with part(BURSTS):
                interference.recompute(residual, state.noise_precision)
                update_correction(interference, residual, state.noise_precision)
        if interference.events:
            return state, info
        return replace(state, search_pending=False), replace(info, searched=True)

    def terminate(self, state: SeparationState, info: IterationInfo) -> Termination:
        """Converged when quiet, and (robust schedule) a burst search agreed."""
        schedule = schedule_by_name(self.schedule)
        confirmed = info.searched or not schedule.search_before_convergence
        return settle(state, self.max_iterations, converged=confirmed and is_quiet(info))


def _separation_bound(
    residual: ComplexArray,
    objects: ObjectWorkspace,
    interference: InterferenceWorkspace,
    noise_precision: float,
    num_used: int,
) -> float:
    traces = objects.active.trace() + interference.trace
    error = expected_error(residual - interference.signal, traces)
    active, filtered = objects.active, interference.correction
    bound = interference.weights_bound + weights_bound(
        active.amplitudes,
        np.diagonal(active.covariance).real,
        active.precisions,
        active.log_determinant,
    )
    if filtered.num_splines:
        bound += weights_bound(
            filtered.amplitudes,
            np.diagonal(filtered.covariance).real,
            filtered.precisions,
            float(np.linalg.slogdet(filtered.covariance)[1]),
        )
    return bound + noise_bound(num_used, noise_precision, error)


def _separability_ratio_db(objects: ObjectWorkspace, interference: ComplexArray) -> float:
    """Condition (27): 20 log10 of ||Phi^H Phi alpha|| over ||Phi^H U Psi beta||."""
    count = len(objects.ids)
    active = objects.active
    own = active.gram[:count, :count] @ active.amplitudes[:count]
    other = separable_projections(interference, *objects.factors)
    energies = float(np.vdot(own, own).real), float(np.vdot(other, other).real)
    if 0.0 in energies:
        return float("nan")
    return 10.0 * math.log10(energies[0] / energies[1])


ENTRIES = (
    EstimatorEntry(
        name="factorised",
        label="Factorised",
        help="Algorithm 1: objects and interference with separate posteriors.",
        factory=FactorisedSeparator,
        position=10,
        several_antennas=True,
    ),
)
