"""Joint dictionary ``[Phi, U Psi]`` and the update of one ramp's part of it.

Every column is separable: an object atom is a line over the samples times a line over the ramps, a
channel atom of ramp p is ``template * psi_k`` over the samples times the unit vector of p over the
ramps. So the object algorithm runs over both without knowing which is which.
"""

from dataclasses import replace

import numpy as np
from scipy import fft

from vsep._typing import ComplexArray, FloatArray, IntArray
from vsep.inference.bursts.channel import passive_ratios
from vsep.inference.bursts.chirp_refinement import ChirpCosts, refine_chirps
from vsep.inference.bursts.table import RampBursts
from vsep.inference.bursts.workspace import InterferenceWorkspace
from vsep.inference.core.progress import EventKind
from vsep.inference.core.state import ObjectComponents
from vsep.inference.objects.object_only import expected_error
from vsep.inference.objects.refinement import place_components
from vsep.inference.objects.sbl import activation_ratio, converged_precision
from vsep.inference.objects.workspace import Background
from vsep.kernels.channel import template_slopes
from vsep.kernels.complex_parts import split, split_row
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

    def _ramps(self) -> list[tuple[int, RampBursts]]:
        return list(self.interference.ramps.items())

    def _ramp(self, p: int) -> RampBursts:
        """Return what ramp p holds."""
        table = self.interference.table
        return table.ramp(int(np.searchsorted(table.interfered, p)))

    def rebuild(self) -> None:
        """Posterior of all columns from scratch."""
        # Objects first, then the channels ramp after ramp
        self.owners = np.concatenate(
            [np.full(len(self.points), OBJECT)]
            + [np.full(len(ramp.bins), p) for p, ramp in self._ramps()]
        ).astype(np.int64)
        background = self.background()
        # (58)-(59) with A = [Phi, U Psi]
        placed = place_components(
            self.points,
            np.concatenate([self.object_precisions, background.precisions]),
            self.received,
            self.noise_precision,
            background.factors,
        )
        self.factors, self.active = placed.factors, placed.active

    def background(self) -> Background:
        """Channel columns of all ramps with their prior precisions."""
        num_ramps, num_samples = self.received.shape
        beat = [np.zeros((0, num_samples), dtype=np.complex128)]
        doppler = [np.zeros((0, num_ramps), dtype=np.complex128)]
        precisions = [np.zeros(0)]
        for p, ramp in self._ramps():
            atoms = self.interference.grid.atoms(ramp.bins)
            # Column k of ramp p: (u psi_k) over the samples, e_p over the ramps
            beat.append(ramp.templates[ramp.owners] * atoms)
            doppler.append(np.tile(np.eye(num_ramps)[p], (len(ramp.bins), 1)))
            precisions.append(ramp.precisions)
        return Background(
            (np.concatenate(beat), np.concatenate(doppler)), np.concatenate(precisions)
        )

    def update(self) -> None:
        """Run Algorithm 2 on every ramp that holds a burst, on the joint posterior."""
        for p, ramp in self._ramps():
            self._refine(p)  # theta from (71)
            for index in range(len(ramp.chirps)):
                self._add_components(p, index)
            self._update_components(p)  # Algorithm 4 on every active column
            self.rebuild()
            self._refine(p)  # theta from (71) again
        self.interference.drop_empty()

    def expected_error(self) -> float:
        """Denominator of (65) with the joint posterior."""
        # r - Phi alpha - U Psi beta
        noise_residual = self.received - synthesize(self.active.amplitudes, *self.factors)
        return expected_error(noise_residual, self.active.trace())

    def take_over(self) -> None:
        """Hand every ramp its block of the posterior."""
        table, count = self.interference.table, len(self.points)
        table.amplitudes = self.active.amplitudes[count:]
        # Posterior blocks of the ramps, in the order in which kernels take them
        own = [np.flatnonzero(self.owners == p) for p in table.interfered]
        blocks = [self.active.covariance[np.ix_(each, each)].ravel() for each in own]
        table.covariances = np.concatenate([np.zeros(0, dtype=np.complex128), *blocks])
        self.interference.synthesize()

    def members(self, p: int) -> IntArray:
        """Return the indices of the columns with a part in ramp p: all objects, and its own."""
        return np.flatnonzero((self.owners == OBJECT) | (self.owners == p))

    def columns_in_ramp(self, p: int, members: IntArray) -> ComplexArray:
        """(M, N) what these columns are within ramp p."""
        beat, doppler = self.factors
        return np.asarray(beat[members] * doppler[members, p][:, None])

    def _refine(self, p: int) -> None:
        table = self.interference.table
        for place in np.flatnonzero(table.rows == p):
            if not np.any(table.owners == place):
                continue
            refined = refine_chirps(
                table.chirps.chosen(np.array([place])),
                self.interference.model,
                self.chirp_cost(int(place)),
                max_steps=self.interference.schedule.refinement_steps,
            )
            table.chirps = table.chirps.replaced(np.array([place]), refined)
            self.rebuild()

    def chirp_cost(self, place: int) -> ChirpCosts:
        """Log evidence of the whole frame as a function of one burst's template."""
        return _JointCost(self, place)

    def _add_components(self, p: int, index: int) -> None:
        work, ramp = self.interference, self._ramp(p)
        burst = int(np.searchsorted(work.table.rows, p)) + index
        template = ramp.templates[index]
        # psi_k^H U^H U psi_l and psi_k^H U^H r of all bins, by one FFT each
        products = work.grid.products(ramp.templates, self.received[p].copy())
        lags, projections = products[:, index], products[index, len(ramp.chirps)]
        num_bins, energy = work.grid.num_bins, float(lags[index, 0].real)
        beat, doppler = self.factors
        count = len(self.points)
        # Phi^H U psi_k of all bins, by one FFT an object
        seen = beat[:count].conj() * template * doppler[:count, p].conj()[:, None]
        with_objects = fft.fft(seen, num_bins, axis=1) / np.sqrt(work.model.num_samples)
        for _ in range(work.schedule.channel_additions):
            members, ramp = self.members(p), self._ramp(p)
            lag = (ramp.bins[:, None] - np.arange(num_bins)[None, :]) % num_bins
            correlations = np.concatenate([with_objects, lags[ramp.owners[:, None], lag]])
            ratio, inverse_rho = passive_ratios(  # (23)-(24)
                correlations,
                projections,
                energy,
                self.active.covariance[np.ix_(members, members)],
                self.active.amplitudes[members],
                self.noise_precision,
            )
            ratio[ramp.bins[ramp.own(index)]] = 0.0  # passive bins only
            best = int(np.argmax(ratio))
            if ratio[best] <= work.threshold:  # Algorithm 4: added if omega^2/rho > T
                return
            rho = 1.0 / float(inverse_rho[best])
            all_correlations = np.zeros(len(self.active), dtype=np.complex128)
            all_correlations[members] = correlations[:, best]
            precision = converged_precision(rho, float(ratio[best]) * rho)  # (77)
            (column,) = work.table.add_columns(
                np.array([burst]), np.array([best]), np.array([precision])
            )
            place = count + int(column)
            self.active = self.active.inserted(  # block inversion (68)
                place, all_correlations, complex(projections[best]), energy, precision
            )
            self.owners = np.insert(self.owners, place, p)
            work.record_component(EventKind.CHANNEL_ADDED, p, float(ratio[best]), best)

    def _update_components(self, p: int) -> None:
        work, table, count = self.interference, self.interference.table, len(self.points)
        index = count + int(np.searchsorted(table.rows[table.owners], p))
        while index < len(self.owners) and self.owners[index] == p:
            rho, omega_sq = self.active.flat_prior_moments(index)  # (23)-(24) of an active column
            ratio = activation_ratio(rho, omega_sq)
            if ratio > max(work.prune_threshold, 1.0):  # Algorithm 4: kept, with gamma from (77)
                self.active.set_precision(index, converged_precision(rho, omega_sq))
                table.precisions[index - count] = self.active.precisions[index]
                index += 1
                continue
            self.active = self.active.without(index)  # pruned
            self.owners = np.delete(self.owners, index)
            channel_bin = int(table.bins[index - count])
            work.record_component(EventKind.CHANNEL_PRUNED, p, ratio, channel_bin)
            table.remove_columns([index - count])


class _JointCost:
    """Log evidence of the whole frame as a function of one burst's template."""

    def __init__(self, columns: JointColumns, place: int) -> None:
        self.columns = columns
        self.place = place
        table = columns.interference.table
        self.row = int(table.rows[place])
        self.own = np.flatnonzero(table.owners == place)
        self.atoms = columns.interference.grid.atoms(table.bins[self.own])

    def values(self, chosen: IntArray, templates: ComplexArray) -> FloatArray:
        """(1,) cost with this template (1, N) in the burst, the only one there is to choose."""
        self._place(templates[0])
        return np.full(len(chosen), self.columns.active.cost())

    def slopes(
        self, chosen: IntArray, templates: ComplexArray, derivatives: ComplexArray
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Cost, exact gradient and Gauss-Newton curvature."""
        self._place(templates[0])
        columns, p = self.columns, self.row
        members = columns.members(p)
        active = columns.active
        gradient, curvature = template_slopes(
            derivatives[0],
            split(self.atoms),
            split(columns.columns_in_ramp(p, members)),
            (active.covariance[np.ix_(members, members)], active.amplitudes[members]),
            np.searchsorted(members, self.own + len(columns.points)),
            split_row(columns.received[p].copy()),
            active.noise_precision,
        )
        costs = np.full(len(chosen), active.cost())
        return costs, gradient[None], curvature[None]

    def _place(self, template: ComplexArray) -> None:
        table = self.columns.interference.table
        templates = table.chirps.templates.copy()
        templates[self.place] = template
        table.chirps = replace(table.chirps, templates=templates)
        self.columns.rebuild()
