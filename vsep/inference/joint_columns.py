"""All columns of the joint dictionary ``[Phi, U Psi]``, and how a burst's part of it changes.

Every column is separable: an object atom is a line over the samples times a line over the ramps, a
channel atom of a burst is ``template * psi_k`` over the samples times the unit vector of its
ramp over the ramps. So the object algorithm runs over both without knowing which is which.
"""

from dataclasses import replace

import numpy as np
from scipy import fft

from vsep._arrays import ComplexArray, FloatArray, IntArray
from vsep.inference.channel import passive_ratios
from vsep.inference.chirp_refinement import ChirpCost, refine_chirp, template_slopes
from vsep.inference.interference import BurstWork, InterferenceWorkspace
from vsep.inference.object_only import expected_error
from vsep.inference.objects import Background
from vsep.inference.refinement import place_components
from vsep.inference.sbl import ActiveSet, activation_ratio, converged_precision
from vsep.inference.state import EventKind, ObjectComponents
from vsep.signal.atoms import synthesize

OBJECT = -1  # owner of the columns that are object atoms


class JointColumns:
    """Joint posterior of all weights while the interference part of a step changes it.

    Parameters
    ----------
    received : (P, N) complex
        The frame; nothing is subtracted from it.
    objects : ObjectComponents
        Where the objects stand; they keep their place here.
    interference : InterferenceWorkspace
        Bursts and channels of the ramps; changed in place.
    noise_precision : float
        lambda.
    """

    def __init__(
        self,
        received: ComplexArray,
        objects: ObjectComponents,
        interference: InterferenceWorkspace,
        noise_precision: float,
    ) -> None:
        self.received = received
        self.points = np.stack([objects.beats, objects.dopplers], axis=1)
        self.object_precisions = objects.precisions
        self.interference = interference
        self.noise_precision = noise_precision
        self.rebuild()

    def rebuild(self) -> None:
        """Posterior of all columns from scratch."""
        self.owners = np.concatenate(
            [np.full(len(self.points), OBJECT)]
            + [np.full(len(burst.bins), b) for b, burst in enumerate(self.interference.bursts)]
        ).astype(np.int64)
        background = self.background()
        placed = place_components(
            self.points,
            np.concatenate([self.object_precisions, background.precisions]),
            self.received,
            self.noise_precision,
            background.factors,
        )
        self.factors, self.active = placed.factors, placed.active

    def background(self) -> Background:
        """Channel columns of all bursts with their prior precisions."""
        num_ramps, num_samples = self.received.shape
        beat = [np.zeros((0, num_samples), dtype=np.complex128)]
        doppler = [np.zeros((0, num_ramps), dtype=np.complex128)]
        precisions = [np.zeros(0)]
        for burst in self.interference.bursts:
            atoms = self.interference.grid.atoms(burst.bins)
            beat.append((burst.chirp.template[:, None] * atoms).T)
            doppler.append(np.tile(np.eye(num_ramps)[burst.ramp], (len(burst.bins), 1)))
            precisions.append(burst.precisions)
        return Background(
            (np.concatenate(beat), np.concatenate(doppler)), np.concatenate(precisions)
        )

    def update(self) -> None:
        """Run Algorithm 2 on every burst, on the joint posterior."""
        for burst in list(self.interference.bursts):
            self._refine(burst)
            self._add_components(burst)
            self._update_components(burst)
            if len(burst.bins) == 0:
                self.interference.drop_if_empty(burst)
            self.rebuild()
            self._refine(burst)

    def _owned(self, burst: BurstWork) -> IntArray:
        """Return the indices of a burst's columns."""
        return np.flatnonzero(self.owners == self.interference.bursts.index(burst))

    def expected_error(self) -> float:
        """Denominator of (65) with the joint posterior."""
        rest = self.received - synthesize(self.active.amplitudes, *self.factors)
        return expected_error(rest, self.active.trace())

    def take_over(self) -> None:
        """Hand every burst its block of the posterior, and synthesize it."""
        for burst in self.interference.bursts:
            own = self._owned(burst)
            burst.amplitudes = self.active.amplitudes[own]
            burst.covariance = self.active.covariance[np.ix_(own, own)]
            burst.signal = self.factors[0][own].T @ burst.amplitudes

    def members(self, p: int) -> IntArray:
        """Return the indices of the columns with a part in ramp p: all objects, and its bursts."""
        ramps = np.array([burst.ramp for burst in self.interference.bursts] + [p])
        # OBJECT is -1: it looks up the ramp appended for it.
        return np.flatnonzero(ramps[self.owners] == p)

    def columns_in_ramp(self, p: int, members: IntArray) -> ComplexArray:
        """(N, M) what these columns are within ramp p."""
        beat, doppler = self.factors
        return np.asarray((beat[members] * doppler[members, p][:, None]).T)

    def _refine(self, burst: BurstWork) -> None:
        if len(burst.bins) == 0:
            return
        burst.chirp = refine_chirp(
            burst.chirp,
            self.interference.model,
            self.chirp_cost(burst),
            max_steps=self.interference.schedule.refinement_steps,
        )
        self.rebuild()

    def chirp_cost(self, burst: BurstWork) -> ChirpCost:
        """Log evidence of the whole frame as a function of one burst's template."""
        return _JointCost(self, burst)

    def _add_components(self, burst: BurstWork) -> None:
        work, template, p = self.interference, burst.chirp.template, burst.ramp
        lags = work.grid.gram_lags(template)
        projections = work.grid.projections(template, self.received[p])
        num_bins, energy = work.grid.num_bins, float(lags[0].real)
        owner = work.bursts.index(burst)
        members = self.members(p)
        others = members[self.owners[members] != owner]
        seen = self.columns_in_ramp(p, others).conj().T * template
        with_others = fft.fft(seen, num_bins, axis=1) / np.sqrt(work.model.num_samples)
        for _ in range(work.schedule.channel_additions):
            members = self.members(p)
            own = self.owners[members] == owner
            lag = (burst.bins[:, None] - np.arange(num_bins)[None, :]) % num_bins
            correlations = np.empty((len(members), num_bins), dtype=np.complex128)
            correlations[own], correlations[~own] = lags[lag], with_others
            ratio, inverse_rho = passive_ratios(
                correlations,
                projections,
                energy,
                self.active.covariance[np.ix_(members, members)],
                self.active.amplitudes[members],
                self.noise_precision,
            )
            ratio[burst.bins] = 0.0
            best = int(np.argmax(ratio))
            if ratio[best] <= work.threshold:
                return
            rho = 1.0 / float(inverse_rho[best])
            all_correlations = np.zeros(len(self.active), dtype=np.complex128)
            all_correlations[members] = correlations[:, best]
            owned = self._owned(burst)
            index = int(owned[-1]) + 1 if len(owned) else len(self.owners)
            precision = converged_precision(rho, float(ratio[best]) * rho)
            self.active = self.active.inserted(
                index, all_correlations, complex(projections[best]), energy, precision
            )
            self.owners = np.insert(self.owners, index, owner)
            burst.bins = np.append(burst.bins, best)
            burst.precisions = np.append(burst.precisions, precision)
            work.record(
                EventKind.CHANNEL_ADDED, p, float(ratio[best]), work.threshold, channel_bin=best
            )

    def _update_components(self, burst: BurstWork) -> None:
        work = self.interference
        for channel_bin in burst.bins.copy():
            place = int(np.flatnonzero(burst.bins == channel_bin)[0])
            index = int(self._owned(burst)[place])
            rho, omega_sq = self.active.flat_prior_moments(index)
            ratio = activation_ratio(rho, omega_sq)
            if ratio > max(work.prune_threshold, 1.0):
                self.active.set_precision(index, converged_precision(rho, omega_sq))
                burst.precisions = burst.precisions.copy()
                burst.precisions[place] = self.active.precisions[index]
                continue
            self.active = self.active.without(index)
            self.owners = np.delete(self.owners, index)
            burst.bins = np.delete(burst.bins, place)
            burst.precisions = np.delete(burst.precisions, place)
            work.record(
                EventKind.CHANNEL_PRUNED,
                burst.ramp,
                ratio,
                work.prune_threshold,
                channel_bin=int(channel_bin),
            )


class _JointCost:
    """Log evidence of the whole frame as a function of one burst's template."""

    def __init__(self, columns: JointColumns, burst: BurstWork) -> None:
        self.columns = columns
        self.burst = burst
        self.owner = columns.interference.bursts.index(burst)
        self.atoms = columns.interference.grid.atoms(burst.bins)

    def value(self, template: ComplexArray) -> float:
        """Cost with this template in the burst."""
        self._place(template)
        return self.columns.active.cost()

    def slopes(
        self, template: ComplexArray, derivatives: ComplexArray
    ) -> tuple[float, FloatArray, FloatArray]:
        """Cost, exact gradient and Gauss-Newton curvature."""
        self._place(template)
        columns, p = self.columns, self.burst.ramp
        members = columns.members(p)
        part = _restricted(columns.active, members)
        gradient, curvature = template_slopes(
            derivatives,
            self.atoms,
            columns.columns_in_ramp(p, members),
            part,
            np.flatnonzero(columns.owners[members] == self.owner),
            columns.received[p],
        )
        return columns.active.cost(), gradient, curvature

    def _place(self, template: ComplexArray) -> None:
        self.burst.chirp = replace(self.burst.chirp, template=template)
        self.columns.rebuild()


def _restricted(active: ActiveSet, members: IntArray) -> ActiveSet:
    """Marginal posterior of some columns: a block of the covariance, not a new inverse."""
    part: ActiveSet = object.__new__(ActiveSet)
    part.noise_precision = active.noise_precision
    part.amplitudes = active.amplitudes[members]
    part.covariance = active.covariance[np.ix_(members, members)]
    return part
