"""Algorithm 1: the estimator with the factorised posterior q(alpha) q(beta).

Estimators are frozen bags of settings with ``init``, ``step`` and ``terminate``; everything that
changes is in the state, so a run can be paused, resumed and stepped back exactly.
"""

from dataclasses import dataclass, field, replace

import numpy as np

from vsep._typing import BoolArray, ComplexArray, FloatArray
from vsep._validation import require_range
from vsep.inference.bursts.expected_bursts import ExpectedBursts
from vsep.inference.bursts.filter_correction import update_correction
from vsep.inference.bursts.image_bursts import without_image_bursts
from vsep.inference.bursts.sample_weights import SampleWeights, holds_clicks, sample_weights
from vsep.inference.bursts.search import BurstSearch
from vsep.inference.bursts.sequence import is_crowded
from vsep.inference.bursts.workspace import InterferenceWorkspace
from vsep.inference.calmness import CALM_ITERATIONS, calm_iterations
from vsep.inference.core.environment import with_environment
from vsep.inference.core.estimator import EstimatorEntry, is_quiet, settle
from vsep.inference.core.noise_update import noise_spectrum_due
from vsep.inference.core.progress import EventKind, IterationInfo, Termination
from vsep.inference.core.schedule import Schedule, schedule_for
from vsep.inference.core.state import SeparationState
from vsep.inference.core.stopwatch import BURSTS, OBJECTS, SEARCH, part
from vsep.inference.objects.object_only import MAX_STEP, ObjectSettings, update_objects
from vsep.inference.objects.workspace import ObjectWorkspace, objects_trace, without_objects
from vsep.inference.separation_diagnostics import separability_ratio_db, separation_bound
from vsep.inference.weighed_frame import WeighedFrame, rows_with_gaps
from vsep.units import from_db

KEEP_MAJORISED = 0.9  # of its threshold: what an object keeps, whose share is known roughly only
FITTED_AFTER = 2  # quiet iterations: the bursts' channels are complete
BY_TRANSIENT = 4  # objects added in an iteration: else clutter is taken for chirps in all ramps
STILL_DEVIATIONS = 0.003  # an object that moved by less promises too little to be moved again


@dataclass(frozen=True, kw_only=True, slots=True)
class FactorisedSeparator(ObjectSettings):
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
    schedule : {"robust", "paper"} or Schedule
        Order of the updates, see `vsep.inference.core.schedule`.
    max_iterations : int
        Where a run stops at the latest.
    expected_bursts : ExpectedBursts or None
        Where weak bursts are looked for as well, see `vsep.two_pass`.
    missing : (P, N) or (A, P, N) bool or None
        Samples that were never received: their weight is zero from the first iteration on.

    Examples
    --------
    >>> from vsep.signal.filters import RaisedCosineFilter
    >>> from vsep.signal.template import SignalModel
    >>> model = SignalModel(num_ramps=16, num_samples=128, sample_rate_hz=5.1e6,
    ...                     anti_aliasing_filter=RaisedCosineFilter(cutoff_hz=1e6, rolloff=0.25))
    >>> round(FactorisedSeparator(model=model, false_alarm_rate=0.05).threshold_db, 1)
    11.2
    """

    interference_threshold_db: float | None = None
    schedule: str | Schedule = "robust"
    expected_bursts: ExpectedBursts | None = None
    _order: Schedule = field(init=False, repr=False, compare=False)  # for frames of this model

    def __post_init__(self) -> None:
        """Check the settings."""
        ObjectSettings.__post_init__(self)
        object.__setattr__(self, "_order", schedule_for(self.schedule, self.model))
        if self.interference_threshold_db is not None:
            name = "interference_threshold_db"
            require_range(name, self.interference_threshold_db, 0.0, 100.0, "dB")

    def init(self, received: ComplexArray) -> SeparationState:
        """As `ObjectSettings.init`; to the paper's schedule a receiver has no errors."""
        state = ObjectSettings.init(self, received)
        return state if self._order.noise_spectrum else replace(state, receiver=None)

    def step(
        self, received: ComplexArray, state: SeparationState
    ) -> tuple[SeparationState, IterationInfo]:
        """One main iteration of Algorithm 1: interference, lambda, objects, lambda, weights."""
        received = state.corrected(received)
        interference, searched, weights = self.prepare(received, state)
        if interference.has_given_up:
            state = without_objects(state)  # they were fitted to that noise
        frame = WeighedFrame(received, state, weights)
        residual = frame.used - state.object_signal  # r_beta = r - Phi alpha
        with part(BURSTS):
            precision = self.burst_precision(state, state.noise_precision)
            interference.update(residual, precision)  # Algorithm 2 on every ramp
            if self.correction_due(state, searched=searched):
                early = interference.schedule.correction_is_early(state.iteration)
                update_correction(interference, residual, precision, early=early)

        # tr(Phi C Phi^H) + tr(U Psi C Psi^H U^H)
        traces = objects_trace(state.objects, self.model) + interference.trace
        bursts = interference.signal  # U Psi beta
        noise_precision = frame.noise_precision(state.object_signal, bursts, traces)  # (65)
        share = 1.0
        if interference.schedule.weights_begun(state.iteration):
            share = frame.share_for_objects(interference, precision)
        elif self.missing is not None and weights is not None:
            share = weights.share
        with part(OBJECTS):
            objects = self._updated_objects(  # Algorithm 3
                frame.for_objects(state.object_signal, bursts),  # r_alpha
                state,
                noise_precision,
                max(interference.object_additions(state.iteration), BY_TRANSIENT * state.settles),
                share,
            )
        residual = frame.for_bursts(objects.signal, bursts)  # r_beta
        traces = objects.active.trace() + interference.trace
        noise_precision = frame.noise_precision(objects.signal, bursts, traces)  # (65)
        with part(BURSTS):
            # C_beta from (62), beta from (61)
            interference.recompute(residual, self.burst_precision(state, noise_precision))
        # (19)
        bound = separation_bound(residual, objects, interference, noise_precision, frame.num_used)
        used = residual + objects.signal
        new_state, info = self.conclude(
            state, objects, interference, noise_precision, bound, searched, used, share
        )
        values = None if weights is None else weights.values
        if share != state.used_share or values is not state.sample_weights:
            new_state = replace(new_state, used_share=share, sample_weights=values)
        return self.confirmed(received, new_state, info)

    def _updated_objects(
        self,
        residual: ComplexArray,
        state: SeparationState,
        noise_precision: float,
        max_additions: int,
        share: float,
    ) -> ObjectWorkspace:
        """Algorithm 3; on the majorised frame of `vsep.inference.objects.masked` where need be.

        The residual r_alpha is Phi alpha + W (r - U Psi beta - Phi alpha).
        """
        relative_noise = state.noise_relative_to(noise_precision)
        if share < 1.0:
            step = min(1.0 / share, MAX_STEP)
            steps = step if self.missing is None else step * self._relative_steps(self.missing)
            residual = state.object_signal + steps * (residual - state.object_signal)
            noise_precision = noise_precision / step
        return update_objects(
            residual,
            state,
            noise_precision,
            self.model,
            self.object_threshold(relative_noise, 1.0 if share == 1.0 else KEEP_MAJORISED),
            max_additions,
            self._order,
        )

    def _relative_steps(self, missing: BoolArray) -> FloatArray:
        """Step lengths of the rows for each other, one on average."""
        steps = self.row_steps(~missing)
        return np.asarray(steps / steps.mean(), dtype=np.float64)

    def prepare(
        self, received: ComplexArray, state: SeparationState
    ) -> tuple[InterferenceWorkspace, bool, SampleWeights | None]:
        """Begin a step: search for bursts where one is due, then weigh the samples.

        Returns
        -------
        interference : InterferenceWorkspace
            Working copy of q(beta), theta and the filter's correction.
        searched : bool
        weights : SampleWeights or None
            See `sample_weights`.
        """
        with part(BURSTS):
            interference = self.interference_workspace(state)
        searched = self.search_due(state)
        if searched:
            # Coarse grid of (71): bursts start, restart and end.
            with part(SEARCH):
                self.search(interference, received, state)
        weights = self.sample_weights(received, state)
        weights = interference.revised_weights(weights, self.missing, received, state.object_signal)
        return interference, searched, weights

    def burst_precision(self, state: SeparationState, noise_precision: float) -> float:
        """Return the noise precision that bursts see, lambda itself in white noise."""
        relative = state.relative_noise
        # Where many bursts are fitted, what is left of them would be taken for coloured noise.
        if relative is None or is_crowded(state.bursts, self.model.num_ramps):
            return noise_precision
        return noise_precision / relative.burst_level(self.model)

    def interference_workspace(self, state: SeparationState) -> InterferenceWorkspace:
        """Working copy of the interference estimate, with this separator's thresholds."""
        threshold_db = self.interference_threshold_db
        if threshold_db is None:
            threshold_db = self._order.interference_threshold_db
        return InterferenceWorkspace(
            self.model,
            self._order,
            float(from_db(threshold_db)),
            state.bursts,
            state.filter_correction,
            state.search_cache,
            state.noise_like,
        )

    def search(
        self, interference: InterferenceWorkspace, received: ComplexArray, state: SeparationState
    ) -> None:
        """Look for bursts; late in a run only in samples that are not censored."""
        schedule = interference.schedule
        # Early on a burst that is not modelled yet looks like outliers itself.
        if schedule.search_is_late(state.iteration) or self.missing is not None:
            received = self.fitted_frame(received, state)
        BurstSearch(
            interference,
            received - state.object_signal,
            self.burst_precision(state, state.noise_precision),
            weakest_share=schedule.weakest_burst_share(state.iteration),
            expected=self.expected_bursts,
            beside_bursts=state.iteration in schedule.beside_bursts,
        ).run()

    def sample_weights(
        self, received: ComplexArray, state: SeparationState
    ) -> SampleWeights | None:
        """Weights of samples that both sources explain badly; None where all count fully.

        Missing ones do not count from the start, and tell nothing of the others.
        """
        if self.missing is None:
            return self._weights_of_fit(received, state)
        explained = state.object_signal + state.interference_signal
        weights = self._weights_of_fit(np.where(self.missing, explained, received), state)
        values = np.ones(received.shape) if weights is None else weights.values
        return SampleWeights(np.where(self.missing, 0.0, values))

    def _weights_of_fit(
        self, received: ComplexArray, state: SeparationState
    ) -> SampleWeights | None:
        if not self._order.weights_due(state.iteration):
            return None if state.sample_weights is None else SampleWeights(state.sample_weights)
        return sample_weights(
            received,
            state.object_signal,
            state.interference_signal,
            fitted=state.quiet_iterations >= FITTED_AFTER,
        )

    def fitted_frame(self, received: ComplexArray, state: SeparationState) -> ComplexArray:
        """Return the frame with what is explained in the place of what does not count."""
        weights = self.sample_weights(received, state)
        if weights is None:
            return received
        return weights.fitted(received, state.object_signal + state.interference_signal)

    def correction_due(self, state: SeparationState, *, searched: bool) -> bool:
        """Whether the next step estimates the filter's correction: a first one with a search."""
        # Without a correction the test is made where a search renews the bursts anyway.
        wanted = searched or state.filter_correction.num_splines > 0
        return wanted and self._order.correction_due(state.iteration)

    def search_due(self, state: SeparationState) -> bool:
        """Whether the next step searches every ramp for bursts."""
        return state.search_pending or self._order.search_due(state.iteration)

    def conclude(
        self,
        state: SeparationState,
        objects: ObjectWorkspace,
        interference: InterferenceWorkspace,
        noise_precision: float,
        bound: float,
        searched: bool,
        used: ComplexArray,
        share: float = 1.0,
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
            separability_ratio_db=separability_ratio_db(objects, interference),
        )
        # Deviation: a run may only end after a search that found nothing new.
        search_again = self._order.search_before_convergence and not searched
        has_objects_added = any(event.kind is EventKind.OBJECT_ADDED for event in objects.events)
        is_still = not has_objects_added and not interference.channels_grow
        calm = calm_iterations(interference.schedule, state, info, components, self.model)
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
            search_pending=search_again and (is_quiet(info) or calm >= CALM_ITERATIONS),
            search_cache=interference.search_cache,
            noise_like=interference.noise_like,
            quiet_iterations=state.quiet_iterations + 1 if is_still else 0,
            calm_iterations=calm,
        )
        if not interference.schedule.noise_due(state.iteration) or not noise_spectrum_due(state):
            return new_state, info
        # A burst that is hardly more than noise is looked at as noise.
        strong = interference.strong_bursts(noise_precision)
        noise_residual, table = used - object_signal - signal, interference.table
        weak = np.flatnonzero(~strong)
        if weak.size:
            np.add.at(noise_residual, table.rows[weak], table.signals[weak])
        new_state, info = with_environment(
            state,
            new_state,
            info,
            noise_residual,
            self.model,
            # Where chirps are fitted to the noise of most ramps, lambda goes on growing.
            noise_precision=state.noise_precision if 2 * weak.size > len(used) else None,
            interfered=rows_with_gaps(table.rows[strong], self.missing, new_state.noise_like),
            share=share,
        )
        return without_image_bursts(state, new_state, table), info

    def confirmed(
        self, received: ComplexArray, state: SeparationState, info: IterationInfo
    ) -> tuple[SeparationState, IterationInfo]:
        """Spare the next step if all it would begin with, a search, finds nothing new.

        That is, where it would move nothing either: the objects stand still, or have been calm for
        long enough, and the filter's correction is none, or does not go on changing.
        """
        if is_quiet(info) and self._awaits_weights(received, state):
            return replace(state, search_pending=True), replace(info, searched=False)
        # The next step would repeat this one but for its search.
        calm = state.calm_iterations >= CALM_ITERATIONS
        moved = info.max_frequency_change > STILL_DEVIATIONS and not calm
        correcting = state.filter_correction.num_splines > 0 and (
            not calm or self.correction_due(state, searched=True)
        )
        if not state.search_pending or moved or correcting:
            return state, info
        interference = self.interference_workspace(state)
        with part(SEARCH):
            self.search(interference, received, state)
        if not interference.events and self.correction_due(state, searched=True):
            residual = self.fitted_frame(received, state) - state.object_signal
            with part(BURSTS):
                precision = self.burst_precision(state, state.noise_precision)
                interference.recompute(residual, precision)
                update_correction(interference, residual, precision)
        if interference.events:
            return state, info
        return replace(state, search_pending=False), replace(info, searched=True)

    def _awaits_weights(self, received: ComplexArray, state: SeparationState) -> bool:
        """Whether the samples are weighed later only, and some are far above the noise."""
        later = self._order.weigh_from is not None
        later = later and not self._order.weights_begun(state.iteration)
        return later and holds_clicks(received, state, self.missing)

    def terminate(self, state: SeparationState, info: IterationInfo) -> Termination:
        """Converged when quiet, and (robust schedule) a burst search agreed."""
        confirmed = info.searched or not self._order.search_before_convergence
        settled = is_quiet(info) or state.calm_iterations >= CALM_ITERATIONS
        return settle(state, self.max_iterations, converged=confirmed and settled)


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
