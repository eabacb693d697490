"""Algorithm 2: interference estimate of all ramps of a frame during one step."""

import math
from collections.abc import Sequence

import numpy as np
from scipy import fft
from scipy.linalg import LinAlgError

from vsep._typing import BoolArray, ComplexArray, FloatArray, IntArray
from vsep.inference.bursts.channel import channel_grid
from vsep.inference.bursts.chirp_refinement import (
    ChannelCosts,
    place_chirps,
    refine_chirps,
)
from vsep.inference.bursts.faint_samples import with_faint_samples
from vsep.inference.bursts.sample_weights import SampleWeights
from vsep.inference.bursts.sequence import MANY_BURSTS, BurstSequence
from vsep.inference.bursts.table import BurstTable, RampBursts
from vsep.inference.core.elbo import weights_bound
from vsep.inference.core.progress import ComponentEvent, EventKind
from vsep.inference.core.row_energies import squared_norms
from vsep.inference.core.schedule import Schedule
from vsep.inference.core.search_cache import SearchCache
from vsep.inference.core.state import NO_CORRECTION, BurstComponents, FilterCorrection
from vsep.kernels.ramps import (
    FlatPosterior,
    FlatRamps,
    Revision,
    all_posteriors,
    all_product_rows,
    all_revisions,
    all_signals,
)
from vsep.signal.corrected_filter import corrected_model
from vsep.signal.template import SignalModel
from vsep.units import from_db, to_db

GROWING_SHARE = 0.03  # of the channel components: more new ones in a step, and channels still grow
CLEARLY_MORE = 4.0  # than the threshold of a ramp's first component: what no fit to noise reaches


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
    bursts : sequence of BurstComponents
        Where the step starts from.
    correction : FilterCorrection
        By what the filter of the templates differs from the assumed one.
    search_cache : SearchCache, optional
        What the last search for bursts has seen; a search in this step replaces it.
    noise_like : (P, N) or (A P, N) bool, optional
        Samples of interference that is no chirps; a search may add to them.

    Attributes
    ----------
    assumed, model : SignalModel
        With the assumed and with the corrected filter.
    has_given_up : bool
        Whether further ramps were found to hold interference that is no chirps.
    table : BurstTable
        The bursts and their columns.
    known_slopes : (K,) float or None
        Slopes next to which a search looks first.
    """

    def __init__(
        self,
        model: SignalModel,
        schedule: Schedule,
        threshold: float,
        bursts: Sequence[BurstComponents],
        correction: FilterCorrection = NO_CORRECTION,
        search_cache: SearchCache | None = None,
        noise_like: BoolArray | None = None,
    ) -> None:
        self.assumed, self.noise_like = model, noise_like
        self.has_given_up = False
        self.search_cache = search_cache
        self.known_slopes: FloatArray | None = None
        self._take_correction(correction)
        self.schedule = schedule
        self.threshold = threshold
        self.prune_threshold = threshold / float(from_db(schedule.prune_margin_db))
        self.grid = channel_grid(model.num_samples, model.num_grid_bins)
        self.events: list[ComponentEvent] = []
        self.table = BurstTable(self.model, bursts)
        self._summed: tuple[ComplexArray | None, ComplexArray] = None, self.table.signals

    @property
    def ramps(self) -> dict[int, RampBursts]:
        """Return what every interfered row of the frame holds."""
        return self.table.ramps()

    @property
    def crowded(self) -> bool:
        """Whether some ramp holds so many bursts that channels have been fitted to others."""
        return len(self.table) >= MANY_BURSTS and bool(self.bursts_per_row.max() >= MANY_BURSTS)

    @property
    def bursts_per_row(self) -> IntArray:
        """(R,) bursts in every row of the frame."""
        return np.bincount(self.table.rows, minlength=self.model.rows_shape[0])

    def object_additions(self, iteration: int) -> int:
        """Objects that may be added; beside noise of known support one, as without its samples."""
        return 1 if self.noise_like is not None else self.schedule.object_additions(iteration)

    def revised_weights(
        self,
        weights: SampleWeights | None,
        missing: BoolArray | None,
        received: ComplexArray,
        objects: ComplexArray,
    ) -> SampleWeights | None:
        """Return the weights of the samples after a search.

        Crowded rows in which it has begun a burst count, as far as they were received, because the
        burst would have no sample to be fitted to. Samples of interference that is no chirps count
        by how faint it is in what no source explains of the frame, (A P, N).
        """
        kinds = EventKind.CHIRP_STARTED, EventKind.CHIRP_RESTARTED
        ramps = [event.ramp for event in self.events if event.kind in kinds]
        if weights is not None and ramps:
            news = np.zeros(self.model.num_ramps, dtype=np.bool_)
            news[ramps] = True
            crowded = self.bursts_per_row >= MANY_BURSTS
            rows = np.flatnonzero(crowded & np.tile(news, self.model.num_antennas))
            weights = weights.counting(rows, missing)
        if self.noise_like is None:
            return weights
        left = received - objects - self.signal
        values = np.ones(left.shape) if weights is None else weights.values
        left = left.reshape(self.model.num_antennas, *self.model.shape)
        return SampleWeights(with_faint_samples(values, left, self.noise_like, missing))

    @property
    def trace(self) -> float:
        """tr(U Psi C Psi^H U^H) summed over the ramps, and the correction's share, for (65)."""
        return float(self.table.traces.sum()) + self.correction.trace

    @property
    def weights_bound(self) -> float:
        """Terms of all channel weights in the evidence lower bound."""
        table = self.table
        return weights_bound(
            table.amplitudes,
            table.variances,
            table.precisions,
            float(table.log_determinants.sum()),
        )

    @property
    def signal(self) -> ComplexArray:
        """(P, N) or, of several antennas, (A P, N) sum of all bursts."""
        table, (signals, total) = self.table, self._summed
        if signals is table.signals:
            return total
        total = np.zeros(self.model.rows_shape, dtype=np.complex128)
        if len(table.interfered) == len(table):  # one burst in a row, as mostly
            total[table.rows] = table.signals
        else:
            for places in table.in_rounds():
                total[table.rows[places]] += table.signals[places]
        self._summed = table.signals, total
        return total

    @property
    def num_shared(self) -> int:
        """Number of bursts of one antenna; the others have as many, in the same places."""
        return len(self.table) // self.model.num_antennas

    def flat(self) -> FlatRamps:
        """Return what the kernels take of all ramps."""
        return self.table.flat(self.grid.twiddle)

    def synthesize(self) -> None:
        """Add up what the columns of every chirp make of it."""
        self.table.signals = all_signals(self.flat(), self.table.amplitudes)

    def _synthesize_moved(self) -> None:
        """Bursts and tr(A C A^H) at the new theta, with the beta and C of the one before."""
        self.synthesize()
        traces = []
        for held in self.ramps.values():
            columns = held.templates[held.owners] * self.grid.atoms(held.bins)  # rows of A^T
            traces.append(np.vdot(columns.conj() @ columns.T, held.covariance).real)
        self.table.traces = np.array(traces, dtype=np.float64)

    def update(self, residual: ComplexArray, noise_precision: float) -> None:
        """Run Algorithm 2 on every ramp that holds a burst; the ramps know nothing of each other.

        What can be done for all of them at once is.
        """
        self.refine_bursts(residual, noise_precision)  # theta from (71)
        self._revise(residual, noise_precision)  # Algorithm 4: add, update, prune
        if not self.schedule.recompute_amplitudes:  # beta from (61), the paper's place for it
            self.recompute(residual, noise_precision)
        self.drop_empty()
        if self.channels_grow or not self.schedule.refines_growing:
            self.refine_bursts(residual, noise_precision)  # theta from (71)
        # Deviation: beta at the new theta before r_alpha is formed; without it the residuals of the
        # first iterations are 15 to 30 times larger.
        if self.schedule.recompute_amplitudes:
            self.recompute(residual, noise_precision)
        else:
            self._synthesize_moved()

    @property
    def channels_grow(self) -> bool:
        """Whether this step has added more than a few channel components."""
        added = sum(event.kind is EventKind.CHANNEL_ADDED for event in self.events)
        return added > max(2.0, GROWING_SHARE * len(self.table.owners))

    def drop_empty(self) -> None:
        """Drop bursts that lost all their components; the paper's schedule keeps the template."""
        if self.schedule.first_threshold_db is None or self.table.num_columns.all():
            return
        columns = self.table.num_columns.reshape(-1, self.num_shared).sum(axis=0)
        empty = np.flatnonzero(columns == 0)  # at no antenna a column
        for row in self.table.rows[empty].tolist():
            self.record(EventKind.CHIRP_DROPPED, row, 0.0, self.prune_threshold)
        if len(empty):
            self.remove_bursts(empty)

    def at_antennas(self, places: IntArray) -> IntArray:
        """Return the places (A, T) that bursts of the first antenna have at every antenna."""
        if self.model.num_antennas == 1:
            return places[None]
        return np.asarray(np.arange(self.model.num_antennas)[:, None] * self.num_shared + places)

    def remove_bursts(self, places: IntArray) -> None:
        """Take bursts of the first antenna out, at every antenna."""
        self.table.remove_bursts(self.at_antennas(places).ravel())

    def recompute(self, residual: ComplexArray, noise_precision: float) -> None:
        """Covariance and mean (61)-(62) at the present parameters."""
        fit = self.posteriors(residual, noise_precision)
        if not math.isfinite(fit.log_determinants.sum()):
            raise LinAlgError("the precision matrix of a ramp is not positive definite")
        self.table.take_posterior(fit)

    def strong_bursts(self, noise_precision: float) -> BoolArray:
        """(B,) whether a burst holds clearly more energy than the best chirp fitted to noise."""
        least = self.schedule.first_threshold_db
        if least is None or len(self.table) == 0:
            return np.ones(len(self.table), np.bool_)
        energies = noise_precision * squared_norms(self.table.signals)
        return np.asarray(energies > CLEARLY_MORE * float(from_db(least)))

    def correct(self, correction: FilterCorrection) -> None:
        """Set the correction of the filter and update all templates; posteriors follow later."""
        self._take_correction(correction)
        chirps = self.table.chirps
        self.table.chirps = place_chirps(chirps.start_frequency, chirps.slope, self.model)

    def _take_correction(self, correction: FilterCorrection) -> None:
        self.correction, self.model = correction, self.assumed
        if correction.num_splines:
            self.model = corrected_model(self.assumed, correction.coefficients)

    def posteriors(self, residual: ComplexArray, noise_precision: float) -> FlatPosterior:
        """Posteriors of all columns of the interfered ramps at their present parameters."""
        # C_beta from (62), beta from (61)
        return all_posteriors(self.flat(), residual[self.table.interfered], noise_precision)

    def refine_bursts(self, residual: ComplexArray, noise_precision: float) -> None:
        """Maximise (71) for all bursts: the first of every ramp, then the second."""
        steps = self.schedule.refinement_steps
        for places in self.table.in_rounds():
            self.refine_burst(places, residual, noise_precision, max_steps=steps)

    def refine_burst(
        self, places: IntArray, residual: ComplexArray, noise_precision: float, *, max_steps: int
    ) -> None:
        """Maximise (71) in the parameters of one burst of each of some ramps.

        Parameters
        ----------
        places : (T,) int
            Which bursts; those without a column stay where they are.
        residual : (P, N) complex
            Received signal minus the objects.
        noise_precision : float
            lambda.
        max_steps : int
            Newton steps at most.
        """
        table = self.table
        if not table.num_columns.all():
            places = places[table.num_columns[places] > 0]
        if len(places) == 0:
            return
        # A burst has one place at all antennas: the sum over them is maximised.
        own, numbers = places, np.arange(len(places))
        if self.model.num_antennas > 1:
            own, numbers = np.unique(places % self.num_shared, return_inverse=True)
        moving, shared = table.moving(places, numbers)
        # (71) of each ramp as a function of one of its bursts' templates
        costs = ChannelCosts(
            ramps=self.flat(),
            moving=moving,
            shared=shared,
            residual=residual[table.interfered],
            noise_precision=noise_precision,
        )
        refined = refine_chirps(
            table.chirps.some(own),
            self.model,
            costs,
            max_steps=max_steps,
            least_gain=self.schedule.least_gain,
        )
        for same in self.at_antennas(own):
            table.chirps = table.chirps.replaced(same, refined)

    def _revise(self, residual: ComplexArray, noise_precision: float) -> None:
        """Add, re-estimate and prune the columns of all ramps, Algorithm 4."""
        table = self.table
        if len(table) == 0:
            return
        flat = self.flat()
        # u_i^* u_j and u_i^* r of all bursts i, j of a ramp; their spectra are all inner products.
        rows = all_product_rows(flat, residual[table.interfered], self.grid.scale)
        # At a ratio of one the prior variance would be zero or negative, (77).
        revision = all_revisions(
            fft.ifft(rows, self.grid.num_bins, axis=1, overwrite_x=True),
            flat,
            noise_precision,
            (self.threshold, max(self.prune_threshold, 1.0)),
            self.schedule.channel_additions,
        )
        self._record_revision(revision)
        kept = revision.kept
        table.set_columns(revision.owners[kept], revision.bins[kept], revision.precisions[kept])

    def _record_revision(self, revision: Revision) -> None:
        """Record an event for every added and every pruned column."""
        changes = (~revision.kept | (revision.added_ratios > 0.0)).nonzero()[0]
        if len(changes) == 0:
            return
        rows = self.table.rows[revision.owners[changes]].tolist()
        bins = revision.bins[changes].tolist()
        added = revision.added_ratios[changes].tolist()  # zero for those that were there
        gone = (~revision.kept)[changes].tolist()
        ratios = revision.ratios[changes].tolist()
        for row, channel_bin, added_ratio, is_gone, ratio in zip(
            rows, bins, added, gone, ratios, strict=True
        ):
            if added_ratio > 0.0:
                self.record_component(EventKind.CHANNEL_ADDED, row, added_ratio, channel_bin)
            if is_gone:
                self.record_component(EventKind.CHANNEL_PRUNED, row, ratio, channel_bin)

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
                snr_db=to_db(ratio),
                threshold_db=to_db(self.threshold if added else self.prune_threshold),
                ramp=ramp % self.model.num_ramps,
                bin=channel_bin,
            )
        )

    def frozen_bursts(self) -> BurstSequence:
        """Freeze the result of the step."""
        return self.table.frozen(self.model)
