"""Algorithm 2: the interference estimate of a frame, burst by burst, while one step changes it."""

from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

from vsep._arrays import ComplexArray, FloatArray, IntArray, from_db, to_db
from vsep.inference.channel import ChannelGrid, channel_posterior, passive_ratios
from vsep.inference.chirp_refinement import ChannelCost, PlacedChirp, refine_chirp
from vsep.inference.sbl import ActiveSet, activation_ratio, converged_precision
from vsep.inference.schedule import Schedule
from vsep.inference.state import BurstComponents, ComponentEvent, EventKind
from vsep.signal.template import SignalModel


@dataclass(slots=True, eq=False)
class BurstWork:
    """One burst inside a step: its parameters, and what they imply once computed."""

    ramp: int
    chirp: PlacedChirp
    bins: IntArray
    precisions: FloatArray
    signal: ComplexArray
    amplitudes: ComplexArray = field(default_factory=lambda: np.zeros(0, dtype=np.complex128))
    covariance: ComplexArray = field(default_factory=lambda: np.zeros((0, 0), dtype=np.complex128))
    trace: float = 0.0

    def freeze(self) -> BurstComponents:
        """Hand over to the next state."""
        return BurstComponents(
            ramp=self.ramp,
            start_frequency=self.chirp.start_frequency,
            slope=self.chirp.slope,
            active_bins=self.bins,
            amplitudes=self.amplitudes,
            covariance=self.covariance,
            precisions=self.precisions,
            energy=float(np.vdot(self.signal, self.signal).real),
        )

    def set_posterior(self, active: ActiveSet, grid: ChannelGrid) -> None:
        """Take over mean and covariance, and what they make of the burst."""
        self.amplitudes = active.amplitudes
        self.covariance = active.covariance
        self.precisions = active.precisions
        self.trace = active.trace()
        self.signal = self.chirp.template * (grid.atoms(self.bins) @ self.amplitudes)


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
    bursts : tuple of BurstComponents
        Where the step starts from.
    """

    def __init__(
        self,
        model: SignalModel,
        schedule: Schedule,
        threshold: float,
        bursts: tuple[BurstComponents, ...],
    ) -> None:
        self.model = model
        self.schedule = schedule
        self.threshold = threshold
        self.prune_threshold = threshold / float(from_db(schedule.prune_margin_db))
        self.grid = ChannelGrid(model.num_samples, model.num_grid_bins)
        self.bursts = self._thaw(bursts)
        self.events: list[ComponentEvent] = []

    def _thaw(self, bursts: tuple[BurstComponents, ...]) -> list[BurstWork]:
        """Working copies, with all templates made in one call."""
        templates = self.model.template(
            np.array([burst.start_frequency for burst in bursts]),
            np.array([burst.slope for burst in bursts]),
        )
        return [
            BurstWork(
                burst.ramp,
                PlacedChirp(burst.start_frequency, burst.slope, template),
                burst.active_bins,
                burst.precisions,
                template * (self.grid.atoms(burst.active_bins) @ burst.amplitudes),
                burst.amplitudes,
                burst.covariance,
            )
            for burst, template in zip(bursts, templates, strict=True)
        ]

    @property
    def trace(self) -> float:
        """tr(U Psi C Psi^H U^H) summed over the bursts, for (65)."""
        return sum(burst.trace for burst in self.bursts)

    @property
    def signal(self) -> ComplexArray:
        """(P, N) sum of all bursts."""
        total = np.zeros(self.model.shape, dtype=np.complex128)
        for burst in self.bursts:
            total[burst.ramp] += burst.signal
        return total

    def bursts_in(self, ramp: int) -> list[BurstWork]:
        """Return the bursts of one ramp."""
        return [burst for burst in self.bursts if burst.ramp == ramp]

    def each_with_residual(
        self, residual: ComplexArray
    ) -> Iterator[tuple[BurstWork, ComplexArray]]:
        """Yield every burst with its ramp's residual (N,) less the ramp's other bursts."""
        for burst in list(self.bursts):
            others = [other for other in self.bursts_in(burst.ramp) if other is not burst]
            yield burst, residual[burst.ramp] - sum(other.signal for other in others)

    def insert(self, burst: BurstWork) -> None:
        """Add a burst, behind the others of its ramp."""
        self.bursts.append(burst)
        self.bursts.sort(key=lambda each: each.ramp)

    def update(self, residual: ComplexArray, noise_precision: float) -> None:
        """Run Algorithm 2 on every burst."""
        for burst, own in self.each_with_residual(residual):
            self._refine(burst, own, noise_precision)
            active = self._posterior(burst, own, noise_precision)
            active = self._add_components(burst, active, own)
            active = self._update_components(burst, active)
            burst.set_posterior(active, self.grid)
            if len(active) == 0:
                self.drop_if_empty(burst)
                continue
            self._refine(burst, own, noise_precision)
        if self.schedule.recompute_amplitudes:
            self.recompute(residual, noise_precision)

    def drop_if_empty(self, burst: BurstWork) -> None:
        """Drop a burst that lost all its components; the literal schedule keeps the template."""
        if self.schedule.first_threshold_db is not None:
            self.bursts.remove(burst)
            self.record(EventKind.CHIRP_DROPPED, burst.ramp, 0.0, self.prune_threshold)

    def recompute(self, residual: ComplexArray, noise_precision: float) -> None:
        """Covariance and mean (61)-(62) at the present parameters, and the signal."""
        for burst, own in self.each_with_residual(residual):
            burst.set_posterior(self._posterior(burst, own, noise_precision), self.grid)

    def _posterior(
        self, burst: BurstWork, residual: ComplexArray, noise_precision: float
    ) -> ActiveSet:
        return channel_posterior(
            self.grid, burst.chirp.template, residual, burst.bins, burst.precisions, noise_precision
        )

    def _refine(self, burst: BurstWork, residual: ComplexArray, noise_precision: float) -> None:
        if len(burst.bins) == 0:
            return
        burst.chirp = refine_chirp(
            burst.chirp,
            self.model,
            ChannelCost(self.grid, residual, burst.bins, burst.precisions, noise_precision),
            max_steps=self.schedule.refinement_steps,
        )

    def _add_components(
        self, burst: BurstWork, active: ActiveSet, residual: ComplexArray
    ) -> ActiveSet:
        lags = self.grid.gram_lags(burst.chirp.template)
        projections = self.grid.projections(burst.chirp.template, residual)
        energy = float(lags[0].real)
        every_bin = np.arange(self.grid.num_bins)
        for _ in range(self.schedule.channel_additions):
            correlations = lags[(burst.bins[:, None] - every_bin[None, :]) % self.grid.num_bins]
            ratio, inverse_rho = passive_ratios(
                correlations,
                projections,
                energy,
                active.covariance,
                active.amplitudes,
                active.noise_precision,
            )
            ratio[burst.bins] = 0.0
            best = int(np.argmax(ratio))
            if ratio[best] <= self.threshold:
                return active
            rho = 1.0 / float(inverse_rho[best])
            precision = converged_precision(rho, float(ratio[best]) * rho)
            active = active.inserted(
                len(active), correlations[:, best], complex(projections[best]), energy, precision
            )
            burst.bins = np.append(burst.bins, best)
            self.record(
                EventKind.CHANNEL_ADDED,
                burst.ramp,
                float(ratio[best]),
                self.threshold,
                channel_bin=best,
            )
        return active

    def _update_components(self, burst: BurstWork, active: ActiveSet) -> ActiveSet:
        active.refresh()
        for channel_bin in burst.bins.copy():
            index = int(np.flatnonzero(burst.bins == channel_bin)[0])
            rho, omega_sq = active.flat_prior_moments(index)
            ratio = activation_ratio(rho, omega_sq)
            # At a ratio of one the prior variance would be zero or negative, (77).
            if ratio > max(self.prune_threshold, 1.0):
                active.set_precision(index, converged_precision(rho, omega_sq))
            else:
                active = active.without(index)
                burst.bins = np.delete(burst.bins, index)
                self.record(
                    EventKind.CHANNEL_PRUNED,
                    burst.ramp,
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

    def frozen_bursts(self) -> tuple[BurstComponents, ...]:
        """Freeze the result of the step."""
        return tuple(burst.freeze() for burst in self.bursts)
