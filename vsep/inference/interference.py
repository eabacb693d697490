"""Algorithm 2 with the burst search around it: the interference estimate, ramp by ramp."""

from dataclasses import dataclass, field

import numpy as np

from vsep._arrays import ComplexArray, FloatArray, IntArray, from_db, to_db
from vsep.inference.channel import ChannelGrid, channel_posterior, passive_ratios
from vsep.inference.chirp_refinement import ChannelCost, PlacedChirp, place_chirp, refine_chirp
from vsep.inference.chirp_search import find_single_chirps
from vsep.inference.sbl import ActiveSet, activation_ratio, converged_precision
from vsep.inference.schedule import Schedule
from vsep.inference.state import ComponentEvent, EventKind, RampInterference
from vsep.signal.template import SignalModel

START_STEPS = 4  # Newton steps on a new chirp, which comes from a grid
CLEARLY_BETTER = 1.05  # score by which a searched chirp must beat the modelled one to replace it


@dataclass(slots=True, eq=False)
class RampWork:
    """One ramp inside a step: its parameters, and what they imply once computed."""

    chirp: PlacedChirp
    bins: IntArray
    precisions: FloatArray
    amplitudes: ComplexArray = field(default_factory=lambda: np.zeros(0, dtype=np.complex128))
    covariance: ComplexArray = field(default_factory=lambda: np.zeros((0, 0), dtype=np.complex128))
    trace: float = 0.0

    def freeze(self) -> RampInterference:
        """Hand over to the next state."""
        return RampInterference(
            start_frequency=self.chirp.start_frequency,
            slope=self.chirp.slope,
            active_bins=self.bins,
            amplitudes=self.amplitudes,
            covariance=self.covariance,
            precisions=self.precisions,
        )

    def set_posterior(self, active: ActiveSet) -> None:
        """Take over mean and covariance."""
        self.amplitudes = active.amplitudes
        self.covariance = active.covariance
        self.precisions = active.precisions
        self.trace = active.trace()


class InterferenceWorkspace:
    """The interference estimate of all ramps while one step changes it.

    Parameters
    ----------
    model : SignalModel
        Size, sampling and assumed filter.
    schedule : Schedule
        Order and limits of the updates.
    threshold : float
        T_beta, linear.
    ramps : tuple of RampInterference or None
        Where the step starts from.
    """

    def __init__(
        self,
        model: SignalModel,
        schedule: Schedule,
        threshold: float,
        ramps: tuple[RampInterference | None, ...],
    ) -> None:
        self.model = model
        self.schedule = schedule
        self.threshold = threshold
        self.prune_threshold = threshold / float(from_db(schedule.prune_margin_db))
        first = schedule.first_threshold_db
        self.first_threshold = threshold if first is None else float(from_db(first))
        self.grid = ChannelGrid(model.num_samples, model.num_grid_bins)
        self.ramps = self._thaw(ramps)
        self.signal = np.zeros(model.shape, dtype=np.complex128)
        self.events: list[ComponentEvent] = []

    def _thaw(self, ramps: tuple[RampInterference | None, ...]) -> list[RampWork | None]:
        """Working copies, with the templates of all ramps made in one call."""
        held = [(p, ramp) for p, ramp in enumerate(ramps) if ramp is not None]
        work: list[RampWork | None] = [None] * len(ramps)
        if held:
            templates = self.model.template(
                np.array([ramp.start_frequency for _, ramp in held]),
                np.array([ramp.slope for _, ramp in held]),
            )
            for (p, ramp), template in zip(held, templates, strict=True):
                chirp = PlacedChirp(ramp.start_frequency, ramp.slope, template)
                work[p] = RampWork(
                    chirp, ramp.active_bins, ramp.precisions, ramp.amplitudes, ramp.covariance
                )
        return work

    @property
    def trace(self) -> float:
        """tr(U Psi C Psi^H U^H) summed over the ramps, for (65)."""
        return sum(ramp.trace for ramp in self.ramps if ramp is not None)

    def search(self, residual: ComplexArray, noise_precision: float) -> None:
        """Look for a single chirp in every ramp; start, drop and restart what disagrees."""
        found = find_single_chirps(residual, self.model)
        for p in range(self.model.num_ramps):
            ratio = noise_precision * float(found.score[p])
            confirmed = ratio > self.first_threshold and found.score[p] > found.tone_score[p]
            kind = self._verdict(self.ramps[p], float(found.score[p]), confirmed, residual[p])
            if kind is None:
                continue
            self.ramps[p] = None
            if kind is not EventKind.CHIRP_DROPPED:
                self.ramps[p] = self._started(
                    found.start_frequency[p], found.slope[p], residual[p], noise_precision
                )
            self.record(kind, p, ratio, self.first_threshold)

    def _verdict(
        self, current: RampWork | None, score: float, confirmed: bool, residual: ComplexArray
    ) -> EventKind | None:
        """Tell what a search means for a ramp; None if all stays as it is."""
        if self.schedule.first_threshold_db is None:
            return EventKind.CHIRP_STARTED
        if current is None:
            return EventKind.CHIRP_STARTED if confirmed else None
        if not confirmed:
            return EventKind.CHIRP_DROPPED
        better = score > CLEARLY_BETTER * self._single_score(current, residual)
        return EventKind.CHIRP_RESTARTED if better else None

    def _single_score(self, ramp: RampWork, residual: ComplexArray) -> float:
        """Best single-component score ``|a^H r|^2 / ||a||^2`` of a modelled chirp over the grid."""
        template = ramp.chirp.template
        energy = float(np.vdot(template, template).real) / self.model.num_samples
        projections = self.grid.projections(template, residual)
        return float(np.max(np.abs(projections)) ** 2 / energy)

    def _started(
        self, start_frequency: float, slope: float, residual: ComplexArray, noise_precision: float
    ) -> RampWork:
        """Begin with one component at zero delay, polished from the search grid."""
        chirp = place_chirp(start_frequency, slope, self.model)
        if self.schedule.first_threshold_db is None:
            return RampWork(chirp, np.zeros(0, dtype=np.int64), np.zeros(0))
        bins, flat = np.zeros(1, dtype=np.int64), np.zeros(1)
        cost = ChannelCost(self.grid, residual, bins, flat, noise_precision)
        chirp = refine_chirp(chirp, self.model, cost, max_steps=START_STEPS)
        started = RampWork(chirp, bins, flat)
        active = self._posterior(started, residual, noise_precision)
        rho, omega_sq = active.flat_prior_moments(0)
        active.set_precision(0, converged_precision(rho, omega_sq))
        started.set_posterior(active)
        return started

    def update(self, residual: ComplexArray, noise_precision: float) -> None:
        """Run Algorithm 2 on every ramp that holds a burst."""
        for p, ramp in enumerate(self.ramps):
            if ramp is None:
                continue
            self._refine(ramp, residual[p], noise_precision)
            active = self._posterior(ramp, residual[p], noise_precision)
            active = self._add_components(p, ramp, active, residual[p])
            active = self._update_components(p, ramp, active)
            ramp.set_posterior(active)
            if len(active) == 0:
                self.drop_if_empty(p)
                continue
            self._refine(ramp, residual[p], noise_precision)
        if self.schedule.recompute_amplitudes:
            self.recompute(residual, noise_precision)
        else:
            self._synthesize()

    def drop_if_empty(self, p: int) -> None:
        """Drop a burst that lost all its components; the literal schedule keeps the template."""
        if self.schedule.first_threshold_db is not None:
            self.ramps[p] = None
            self.record(EventKind.CHIRP_DROPPED, p, 0.0, self.prune_threshold)

    def recompute(self, residual: ComplexArray, noise_precision: float) -> None:
        """Covariance and mean (61)-(62) at the present parameters, and the signal."""
        for p, ramp in enumerate(self.ramps):
            if ramp is not None:
                ramp.set_posterior(self._posterior(ramp, residual[p], noise_precision))
        self._synthesize()

    def _posterior(
        self, ramp: RampWork, residual: ComplexArray, noise_precision: float
    ) -> ActiveSet:
        return channel_posterior(
            self.grid, ramp.chirp.template, residual, ramp.bins, ramp.precisions, noise_precision
        )

    def _synthesize(self) -> None:
        self.signal = np.zeros(self.model.shape, dtype=np.complex128)
        for p, ramp in enumerate(self.ramps):
            if ramp is not None:
                line = self.grid.atoms(ramp.bins) @ ramp.amplitudes
                self.signal[p] = ramp.chirp.template * line

    def _refine(self, ramp: RampWork, residual: ComplexArray, noise_precision: float) -> None:
        if len(ramp.bins) == 0:
            return
        ramp.chirp = refine_chirp(
            ramp.chirp,
            self.model,
            ChannelCost(self.grid, residual, ramp.bins, ramp.precisions, noise_precision),
            max_steps=self.schedule.refinement_steps,
        )

    def _add_components(
        self,
        p: int,
        ramp: RampWork,
        active: ActiveSet,
        residual: ComplexArray,
    ) -> ActiveSet:
        lags = self.grid.gram_lags(ramp.chirp.template)
        projections = self.grid.projections(ramp.chirp.template, residual)
        energy = float(lags[0].real)
        every_bin = np.arange(self.grid.num_bins)
        for _ in range(self.schedule.channel_additions):
            correlations = lags[(ramp.bins[:, None] - every_bin[None, :]) % self.grid.num_bins]
            ratio, inverse_rho = passive_ratios(
                correlations,
                projections,
                energy,
                active.covariance,
                active.amplitudes,
                active.noise_precision,
            )
            ratio[ramp.bins] = 0.0
            best = int(np.argmax(ratio))
            if ratio[best] <= self.threshold:
                return active
            rho = 1.0 / float(inverse_rho[best])
            precision = converged_precision(rho, float(ratio[best]) * rho)
            active = active.inserted(
                len(active), correlations[:, best], complex(projections[best]), energy, precision
            )
            ramp.bins = np.append(ramp.bins, best)
            self.record(
                EventKind.CHANNEL_ADDED, p, float(ratio[best]), self.threshold, channel_bin=best
            )
        return active

    def _update_components(self, p: int, ramp: RampWork, active: ActiveSet) -> ActiveSet:
        active.refresh()
        for channel_bin in ramp.bins.copy():
            index = int(np.flatnonzero(ramp.bins == channel_bin)[0])
            rho, omega_sq = active.flat_prior_moments(index)
            ratio = activation_ratio(rho, omega_sq)
            # At a ratio of one the prior variance would be zero or negative, (77).
            if ratio > max(self.prune_threshold, 1.0):
                active.set_precision(index, converged_precision(rho, omega_sq))
            else:
                active = active.without(index)
                ramp.bins = np.delete(ramp.bins, index)
                self.record(
                    EventKind.CHANNEL_PRUNED,
                    p,
                    ratio,
                    self.prune_threshold,
                    channel_bin=int(channel_bin),
                )
        active.refresh()
        return active

    def record(
        self, kind: EventKind, ramp: int, ratio: float, threshold: float, *, channel_bin: int = -1
    ) -> None:
        """Add an event of the step."""
        self.events.append(
            ComponentEvent(
                kind=kind,
                snr_db=float(to_db(ratio)),
                threshold_db=float(to_db(threshold)),
                ramp=ramp,
                bin=channel_bin,
            )
        )

    def frozen_ramps(self) -> tuple[RampInterference | None, ...]:
        """Freeze the result of the step."""
        return tuple(None if ramp is None else ramp.freeze() for ramp in self.ramps)
