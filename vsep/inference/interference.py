"""Algorithm 2: the interference estimate of a frame, ramp by ramp, while one step changes it."""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from scipy import fft
from scipy.linalg import LinAlgError

from vsep._arrays import ComplexArray, from_db, to_db
from vsep.inference.channel import ChannelGrid, channel_posterior
from vsep.inference.chirp_refinement import (
    ChannelCosts,
    SharedCosts,
    place_chirps,
    refine_chirps,
)
from vsep.inference.elbo import weights_bound
from vsep.inference.ramp_work import RampWork, flat_ramps
from vsep.inference.sbl import ActiveSet
from vsep.inference.schedule import Schedule
from vsep.inference.state import (
    NO_CORRECTION,
    BurstComponents,
    ComponentEvent,
    EventKind,
    FilterCorrection,
)
from vsep.kernels.channel import Channel
from vsep.kernels.ramps import (
    FlatRamps,
    all_posteriors,
    all_product_rows,
    all_revisions,
    all_signals,
)
from vsep.signal.corrected_filter import corrected_model
from vsep.signal.template import SignalModel


class InterferenceWorkspace:
    """The interference estimate of all ramps while one step changes it.

    Of several antennas every row of the frame is a ramp with a channel of its own; the bursts of a
    ramp have the same places in all of its rows.

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
    correction : FilterCorrection
        By what the filter of the templates differs from the assumed one.

    Attributes
    ----------
    assumed, model : SignalModel
        With the assumed and with the corrected filter.
    """

    def __init__(
        self,
        model: SignalModel,
        schedule: Schedule,
        threshold: float,
        bursts: tuple[BurstComponents, ...],
        correction: FilterCorrection = NO_CORRECTION,
    ) -> None:
        self.assumed = model
        self.correction = correction
        self.model = corrected_model(model, correction.coefficients)
        self.schedule = schedule
        self.threshold = threshold
        self.prune_threshold = threshold / float(from_db(schedule.prune_margin_db))
        self.grid = ChannelGrid(model.num_samples, model.num_grid_bins)
        self.ramps: dict[int, RampWork] = {}
        self.events: list[ComponentEvent] = []
        self._thaw(bursts)

    def _thaw(self, bursts: tuple[BurstComponents, ...]) -> None:
        """Working copies, with all templates made in one call."""
        chirps = place_chirps(
            np.array([burst.start_frequency for burst in bursts]),
            np.array([burst.slope for burst in bursts]),
            self.model,
        )
        for burst, chirp in zip(bursts, chirps, strict=True):
            row = burst.antenna * self.model.num_ramps + burst.ramp
            work = self.ramps.setdefault(row, RampWork(row))
            owner = np.full(burst.num_components, len(work.chirps))
            work.chirps.append(chirp)
            work.owners = np.concatenate([work.owners, owner])
            work.bins = np.concatenate([work.bins, burst.active_bins])
            work.precisions = np.concatenate([work.precisions, burst.precisions])
            work.amplitudes = np.concatenate([work.amplitudes, burst.amplitudes])
        self.synthesize(list(self.ramps.values()))

    @property
    def trace(self) -> float:
        """tr(U Psi C Psi^H U^H) summed over the ramps, and the correction's share, for (65)."""
        return sum(ramp.trace for ramp in self.ramps.values()) + self.correction.trace

    @property
    def weights_bound(self) -> float:
        """Terms of all channel weights in the evidence lower bound."""
        ramps = list(self.ramps.values())
        if not ramps:
            return 0.0
        return weights_bound(
            np.concatenate([ramp.amplitudes for ramp in ramps]),
            np.concatenate([np.diagonal(ramp.covariance) for ramp in ramps]).real,
            np.concatenate([ramp.precisions for ramp in ramps]),
            sum(ramp.log_determinant for ramp in ramps),
        )

    @property
    def signal(self) -> ComplexArray:
        """(P, N) or, of several antennas, (A P, N) sum of all bursts."""
        total = np.zeros(self.model.rows_shape, dtype=np.complex128)
        for p, ramp in self.ramps.items():
            total[p] = ramp.signal
        return total

    def synthesize(self, ramps: Sequence[RampWork]) -> None:
        """Add up what the columns of every chirp of some ramps make of it."""
        if ramps:
            flat = flat_ramps(ramps, self.grid.twiddle)
            self._take_signals(ramps, flat, np.concatenate([ramp.amplitudes for ramp in ramps]))

    def _take_signals(
        self, ramps: Sequence[RampWork], flat: FlatRamps, amplitudes: ComplexArray
    ) -> None:
        signals = all_signals(flat, amplitudes)
        for ramp, (first, last) in zip(ramps, pairwise(flat.first_burst.tolist()), strict=True):
            ramp.signals = signals[first:last]

    def channel(self, ramp: RampWork) -> Channel:
        """Return the columns of a ramp as the kernels take them."""
        return Channel(ramp.owners, ramp.bins, ramp.precisions, self.grid.twiddle)

    def update(self, residual: ComplexArray, noise_precision: float) -> None:
        """Run Algorithm 2 on every ramp that holds a burst; the ramps know nothing of each other.

        What can be done for all of them at once is.
        """
        steps = self.schedule.refinement_steps
        self.refine_bursts(residual, noise_precision, max_steps=steps)
        self._revise(residual, noise_precision)
        if not self.schedule.recompute_amplitudes:
            self.recompute(residual, noise_precision)
        for ramp in self.first_antenna():
            self.drop_empty(ramp)
        self.refine_bursts(residual, noise_precision, max_steps=steps)
        if self.schedule.recompute_amplitudes:
            self.recompute(residual, noise_precision)

    def first_antenna(self) -> list[RampWork]:
        """Return the interfered ramps of the first antenna; the others have bursts where it has."""
        return [ramp for row, ramp in self.ramps.items() if row < self.model.num_ramps]

    def same_ramp(self, ramp: RampWork) -> list[RampWork]:
        """Return one ramp as every antenna received it."""
        if self.model.num_antennas == 1:
            return [ramp]
        p, num_ramps = ramp.ramp % self.model.num_ramps, self.model.num_ramps
        return [self.ramps[a * num_ramps + p] for a in range(self.model.num_antennas)]

    def drop_empty(self, ramp: RampWork) -> None:
        """Drop bursts that lost all their components; the literal schedule keeps the template."""
        if self.schedule.first_threshold_db is None:
            return
        owners = {owner for each in self.same_ramp(ramp) for owner in each.owners.tolist()}
        for index in reversed(range(len(ramp.chirps))):
            if index not in owners:
                self.remove_burst(ramp, index)
                self.record(EventKind.CHIRP_DROPPED, ramp.ramp, 0.0, self.prune_threshold)

    def remove_burst(self, ramp: RampWork, index: int) -> None:
        """Take one burst of a ramp out, at every antenna."""
        for each in self.same_ramp(ramp):
            each.remove_burst(index)
            if not each.chirps:
                del self.ramps[each.ramp]

    def recompute(self, residual: ComplexArray, noise_precision: float) -> None:
        """Covariance and mean (61)-(62) at the present parameters."""
        ramps = list(self.ramps.values())
        if not ramps:
            return
        flat = flat_ramps(ramps, self.grid.twiddle)
        fits = all_posteriors(flat, _rows(residual, ramps), noise_precision)
        if not np.all(np.isfinite(fits.log_determinants)):
            raise LinAlgError("the precision matrix of a ramp is not positive definite")
        place = 0
        for r, (first, last) in enumerate(pairwise(flat.first_column.tolist())):
            ramp, size = ramps[r], last - first
            ramp.amplitudes = fits.amplitudes[first:last]
            ramp.covariance = fits.covariances[place : place + size**2].reshape(size, size)
            ramp.trace = float(fits.traces[r])
            ramp.log_determinant = float(fits.log_determinants[r])
            place += size**2
        self._take_signals(ramps, flat, fits.amplitudes)

    def take_over(self, ramp: RampWork, active: ActiveSet) -> None:
        """Hand a posterior to its ramp; its signals are still the former ones."""
        ramp.amplitudes = active.amplitudes
        ramp.covariance = active.covariance
        ramp.precisions = active.precisions
        ramp.trace = active.trace()
        ramp.log_determinant = active.log_determinant

    def correct(self, correction: FilterCorrection) -> None:
        """Take over a correction of the filter; all templates follow, posteriors do not yet."""
        self.correction = correction
        self.model = corrected_model(self.assumed, correction.coefficients)
        chirps = [chirp for ramp in self.ramps.values() for chirp in ramp.chirps]
        placed = iter(
            place_chirps(
                np.array([chirp.start_frequency for chirp in chirps]),
                np.array([chirp.slope for chirp in chirps]),
                self.model,
            )
        )
        for ramp in self.ramps.values():
            ramp.chirps = [next(placed) for _ in ramp.chirps]

    def posterior(
        self, ramp: RampWork, residual: ComplexArray, noise_precision: float
    ) -> ActiveSet:
        """Posterior of all columns of a ramp at its present parameters."""
        return channel_posterior(ramp.templates, residual, self.channel(ramp), noise_precision)

    def refine_bursts(
        self, residual: ComplexArray, noise_precision: float, *, max_steps: int
    ) -> None:
        """Climb (71) in the parameters of all bursts: the first of every ramp, then the second."""
        for index in range(max((len(ramp.chirps) for ramp in self.ramps.values()), default=0)):
            ramps = [ramp for ramp in self.ramps.values() if index < len(ramp.chirps)]
            self.refine_burst(ramps, index, residual, noise_precision, max_steps=max_steps)

    def refine_burst(
        self,
        ramps: Sequence[RampWork],
        index: int,
        residual: ComplexArray,
        noise_precision: float,
        *,
        max_steps: int,
    ) -> None:
        """Climb (71) in the parameters of one burst of each of some ramps.

        Parameters
        ----------
        ramps : sequence of RampWork
            Changed in place.
        index : int
            Which of their bursts.
        residual : (P, N) complex
            Received signal minus the objects.
        noise_precision : float
            lambda.
        max_steps : int
            Newton steps at most.
        """
        moved = [ramp for ramp in ramps if index in ramp.owners.tolist()]
        if not moved:
            return
        costs = ChannelCosts(
            ramps=flat_ramps(moved, self.grid.twiddle),
            moving=np.full(len(moved), index),
            residual=_rows(residual, moved),
            noise_precision=noise_precision,
        )
        if self.model.num_antennas > 1:
            self._refine_together(moved, index, costs, max_steps)
            return
        chirps = [ramp.chirps[index] for ramp in moved]
        refined = refine_chirps(chirps, self.model, costs, max_steps=max_steps)
        for ramp, chirp in zip(moved, refined, strict=True):
            ramp.chirps[index] = chirp

    def _refine_together(
        self, moved: Sequence[RampWork], index: int, costs: ChannelCosts, max_steps: int
    ) -> None:
        """Climb the sum over the antennas; a burst has one place at all of them."""
        own = [ramp.ramp % self.model.num_ramps for ramp in moved]
        _, first, owners = np.unique(own, return_index=True, return_inverse=True)
        shared = SharedCosts(costs=costs, owners=owners)
        chirps = [moved[place].chirps[index] for place in first]
        refined = refine_chirps(chirps, self.model, shared, max_steps=max_steps)
        for place, chirp in zip(first, refined, strict=True):
            for ramp in self.same_ramp(moved[place]):
                ramp.chirps[index] = chirp

    def _revise(self, residual: ComplexArray, noise_precision: float) -> None:
        """Add, re-weigh and prune the columns of all ramps, Algorithm 4."""
        ramps = list(self.ramps.values())
        if not ramps:
            return
        flat = flat_ramps(ramps, self.grid.twiddle)
        rows = all_product_rows(flat, _rows(residual, ramps), self.grid.scale)
        # At a ratio of one the prior variance would be zero or negative, (77).
        revision = all_revisions(
            fft.ifft(rows, self.grid.num_bins, axis=1, overwrite_x=True),
            flat,
            noise_precision,
            (self.threshold, max(self.prune_threshold, 1.0)),
            self.schedule.channel_additions,
        )
        kept = revision.kept
        for ramp, (first, last) in zip(ramps, pairwise(revision.first_column), strict=True):
            stay = kept[first:last]
            ramp.owners = revision.owners[first:last][stay]
            ramp.bins = revision.bins[first:last][stay]
            ramp.precisions = revision.precisions[first:last][stay]
        changes = np.flatnonzero(revision.added | ~kept)
        owners = np.searchsorted(revision.first_column, changes, side="right") - 1
        for place, owner in zip(changes.tolist(), owners.tolist(), strict=True):
            p, channel_bin = ramps[owner].ramp, int(revision.bins[place])
            if revision.added[place]:
                ratio = float(revision.added_ratios[place])
                self.record_component(EventKind.CHANNEL_ADDED, p, ratio, channel_bin)
            if not kept[place]:
                ratio = float(revision.ratios[place])
                self.record_component(EventKind.CHANNEL_PRUNED, p, ratio, channel_bin)

    def record(self, kind: EventKind, ramp: int, ratio: float, threshold: float) -> None:
        """Add an event of a burst."""
        self.events.append(
            ComponentEvent(
                kind=kind,
                snr_db=float(to_db(ratio)),
                threshold_db=float(to_db(threshold)),
                ramp=ramp % self.model.num_ramps if ramp >= 0 else ramp,
            )
        )

    def record_component(self, kind: EventKind, ramp: int, ratio: float, channel_bin: int) -> None:
        """Add an event of a channel component."""
        added = kind is EventKind.CHANNEL_ADDED
        self.events.append(
            ComponentEvent(
                kind=kind,
                snr_db=float(to_db(ratio)),
                threshold_db=float(to_db(self.threshold if added else self.prune_threshold)),
                ramp=ramp % self.model.num_ramps,
                bin=channel_bin,
            )
        )

    def frozen_bursts(self) -> tuple[BurstComponents, ...]:
        """Freeze the result of the step."""
        bursts = []
        for p in sorted(self.ramps):
            ramp = self.ramps[p]
            for index, chirp in enumerate(ramp.chirps):
                own = ramp.own(index) if len(ramp.chirps) > 1 else slice(None)
                signal = ramp.signals[index]
                bursts.append(
                    BurstComponents(
                        ramp=p % self.model.num_ramps,
                        antenna=p // self.model.num_ramps,
                        start_frequency=chirp.start_frequency,
                        slope=chirp.slope,
                        active_bins=ramp.bins[own],
                        amplitudes=ramp.amplitudes[own],
                        covariance=ramp.covariance[own][:, own],
                        precisions=ramp.precisions[own],
                        energy=float(np.vdot(signal, signal).real),
                    )
                )
        return tuple(bursts)


def _rows(frame: ComplexArray, ramps: Sequence[RampWork]) -> ComplexArray:
    """(R, N) rows of a frame (P, N) that belong to some ramps."""
    return frame[[ramp.ramp for ramp in ramps]]
