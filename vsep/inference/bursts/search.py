"""Start, restart and removal of bursts by comparison with an exhaustive search."""

from collections.abc import Sequence

import numpy as np
from scipy import fft

from vsep._typing import BoolArray, ComplexArray, FloatArray, IntArray
from vsep.inference.bursts.chirp_refinement import place_chirps
from vsep.inference.bursts.chirp_search import (
    ChirpCandidates,
    find_single_chirps,
    tone_scores,
)
from vsep.inference.bursts.expected_bursts import (
    ExpectedBursts,
    expected_scores,
    expected_threshold,
)
from vsep.inference.bursts.giving_up import NoiseLike, given_up
from vsep.inference.bursts.long_chirps import lone_tones, with_long_chirps
from vsep.inference.bursts.sequence import MANY_BURSTS
from vsep.inference.bursts.workspace import InterferenceWorkspace
from vsep.inference.core.progress import EventKind
from vsep.inference.core.row_energies import row_energies, squared_norms, sum_of_antennas
from vsep.inference.core.search_cache import empty_search_cache
from vsep.inference.core.state import NO_CORRECTION
from vsep.inference.core.thresholds import threshold_of_sum
from vsep.inference.objects.sbl import ActiveSet, activation_ratio, converged_precision
from vsep.kernels.posterior import Posterior
from vsep.kernels.ramps import FlatPosterior
from vsep.units import from_db

START_STEPS = 4  # Newton steps on a new chirp, which comes from a grid
CLEARLY_BETTER = 1.05  # score by which a searched chirp must beat the modelled one to replace it
EXPLAINED = 0.5  # of the energy over the noise: what a chirp of a known slope must explain
SURE = 0.5  # share of a modelled chirp's score that a search reaches for sure, grid or not


class BurstSearch:
    """A search for one chirp in every ramp, and what it means for the bursts modelled there.

    What several antennas received of a ramp is searched together: energies and scores are sums over
    the antennas, and thresholds are those of sums.

    Parameters
    ----------
    work : InterferenceWorkspace
        The bursts; changed in place.
    residual : (P, N) or, of several antennas, (A P, N) complex
        Received signal minus the objects.
    noise_precision : float
        lambda.
    weakest_share : float
        Of the energy of a ramp's strongest burst: what a further burst of the ramp must have.
    expected : ExpectedBursts or None
        Places at which a lower threshold holds.
    beside_bursts : bool
        Whether only ramps are looked at that hold a burst.
    """

    def __init__(
        self,
        work: InterferenceWorkspace,
        residual: ComplexArray,
        noise_precision: float,
        *,
        weakest_share: float,
        expected: ExpectedBursts | None = None,
        beside_bursts: bool = False,
    ) -> None:
        self.work = work
        self.beside_bursts = beside_bursts
        self.residual = residual
        self.noise_precision = noise_precision
        self.weakest_share = weakest_share
        first = work.schedule.first_threshold_db
        self.keeps_every_template = first is None
        threshold = work.threshold if first is None else float(from_db(first))
        self.threshold = threshold_of_sum(threshold, work.model.num_antennas)
        self.expected = expected
        if expected is not None:
            lower = min(expected_threshold(work.assumed, threshold, expected.reach), threshold)
            self.expected_threshold = threshold_of_sum(lower, work.model.num_antennas)

    def run(self) -> None:
        """Check every burst on what the others leave, then look for one more in the quiet ramps."""
        before = self.work.crowded or self.work.noise_like is not None
        self.work.synthesize()
        noise_residual = self.residual - self.work.signal  # r_beta - U Psi beta
        changed = self._check_bursts(noise_residual)
        self._start_bursts(self.residual - self.work.signal if changed else noise_residual, changed)
        others = NoiseLike(self.work, self.residual, self.threshold)
        if not self.keeps_every_template:
            others.grow()
            others.give_up_at_once()
        if self.work.crowded and not before:
            self._start_over()
        others.give_up_many_bursts()
        if self.expected is not None:
            self._start_expected(self.expected)

    def _start_over(self) -> None:
        """Begin all bursts of crowded ramps before the channel of any of them grows.

        A channel of many components fits a burst that is not modelled yet; each keeps one.
        """
        work = self.work
        work.correct(NO_CORRECTION)
        work.table.keep_strongest_columns(work.bursts_per_row >= MANY_BURSTS - 1)
        for _ in range(work.schedule.bursts_per_ramp):
            work.recompute(self.residual, self.noise_precision)
            count = len(work.table)
            self._start_bursts(self.residual - work.signal, set())
            if len(work.table) == count:
                return
            work.refine_bursts(self.residual, self.noise_precision)

    def _by_antenna(self, rows: ComplexArray) -> ComplexArray:
        """(T, N) rows of one antenna, or (A, T, N) of several."""
        num_antennas = self.work.model.num_antennas
        return rows if num_antennas == 1 else rows.reshape(num_antennas, -1, rows.shape[1])

    def _check_bursts(self, noise_residual: ComplexArray) -> set[int]:
        """Keep, restart or drop every burst; return the ramps in which something changed.

        ``noise_residual`` is what the bursts leave of the residual.
        """
        work, table = self.work, self.work.table
        if len(table) == 0:
            return set()
        # Each burst on what all others leave of its ramp
        row_residuals = noise_residual[table.rows]
        rows = self._by_antenna(row_residuals + table.signals)
        energies = row_energies(rows)
        scores = self._scores(rows, energies - row_energies(self._by_antenna(row_residuals)))
        doubtful = np.flatnonzero(
            self._doubtful(scores, rows, energies) & np.logical_not(self._as_expected(scores))
        )[::-1]
        if len(doubtful) == 0:
            return set()
        found = self._find(rows[..., doubtful, :], table.rows[doubtful])
        changed = set()
        # From the back, so that a place stays valid while bursts are removed behind it.
        for number, place in enumerate(doubtful.tolist()):
            kind = self._verdict(found, number, float(scores[:, place].max()))
            if kind is None:
                continue
            ramp = int(table.rows[place])
            changed.add(ramp)
            work.remove_bursts(np.array([place]))
            if kind is EventKind.CHIRP_RESTARTED:
                self._start([(ramp, number)], found)
            self._record(kind, ramp, found, number)
        return changed

    def _scores(self, rows: ComplexArray, explained: FloatArray) -> FloatArray:
        """(2, B) best single-component score of modelled bursts, and what all of each explains.

        The score is ``|a^H r|^2 / ||a||^2`` over the channel grid; `rows` are the bursts as the
        others leave them.
        """
        templates = self.work.table.chirps.templates
        num_bins = self.work.grid.num_bins
        seen = self._by_antenna(templates.conj()) * rows
        products = fft.ifft(seen, num_bins, axis=-1, norm="forward")  # psi_k^H u^* r of all bins
        power = sum_of_antennas(products.real**2 + products.imag**2)
        single = power.max(axis=1) / squared_norms(templates[: len(power)])
        return np.array([single, explained])

    def _doubtful(self, scores: FloatArray, rows: ComplexArray, energies: FloatArray) -> BoolArray:
        """(B,) whether a search can say anything of a burst but that it stays as it is.

        No chirp scores more than the energy of its row, and the best one of the search comes close
        to the modelled one at least.
        """
        single, explained = scores
        # A search can only drop a burst that is weak, or replace one that explains too little.
        needed = np.maximum(tone_scores(rows), self.threshold / self.noise_precision)
        certain = (CLEARLY_BETTER * explained > energies) & (SURE * single > needed)
        return np.asarray(~certain | self.keeps_every_template)

    def _as_expected(self, scores: FloatArray) -> BoolArray | bool:
        """(B,) whether a burst lies where one is expected and is still strong enough for that."""
        expected, work = self.expected, self.work
        if expected is None:
            return False
        margin = work.threshold / work.prune_threshold
        chirps, count = work.table.chirps, work.num_shared
        centres = (-chirps.start_frequency / chirps.slope)[:count].tolist()
        places = zip(work.table.rows[:count].tolist(), centres, chirps.slope.tolist(), strict=False)
        near = [expected.near(*place, work.model) for place in places]
        strong = self.noise_precision * scores[0] * margin > self.expected_threshold
        return np.asarray(np.array(near) & strong)

    def _verdict(self, found: ChirpCandidates, number: int, score: float) -> EventKind | None:
        """Return what a search means for a burst; None if it stays as it is.

        A chirp fitted with many components need not be the best with one: only one that explains
        more than the whole burst shows that the burst is wrong.
        """
        if self.keeps_every_template:
            return EventKind.CHIRP_RESTARTED
        if not self._confirmed(found, number):  # no chirp above threshold, or a tone is stronger
            return EventKind.CHIRP_DROPPED
        better = found.score[number] > CLEARLY_BETTER * score
        return EventKind.CHIRP_RESTARTED if better else None

    def _start_bursts(self, noise_residual: ComplexArray, changed: set[int]) -> None:
        """Begin a burst in every unchanged ramp whose residual holds a chirp."""
        work, noise_residual = self.work, self._by_antenna(noise_residual)
        last = (
            empty_search_cache(noise_residual) if work.search_cache is None else work.search_cache
        )
        # Further bursts of a ramp must not be what the fit of its first has not reached yet.
        least = self._least_scores()
        # No chirp scores more than the energy there is, or what is known from the last search.
        candidates = row_energies(noise_residual) >= least
        num_bursts = self._num_bursts()
        candidates &= num_bursts < work.schedule.bursts_per_ramp
        if self.beside_bursts:
            candidates &= num_bursts > 0
        if not self.keeps_every_template:
            needed = np.maximum(least, self.threshold / self.noise_precision)
            # Cauchy-Schwarz: sqrt(score) changes by ||change|| at most
            candidates &= last.limits_of(noise_residual) >= needed
        settled = [*changed, *given_up(work)]
        if settled:
            candidates[settled] = False
        ramps = candidates.nonzero()[0]
        if len(ramps) == 0:
            return
        found = self._find(noise_residual[..., ramps, :], ramps)
        work.search_cache = last.searched(ramps, noise_residual, found.limit)
        strong = (found.score >= least[ramps]).tolist()
        starts = [
            (p, number)
            for number, p in enumerate(ramps.tolist())
            if self.keeps_every_template or (strong[number] and self._confirmed(found, number))
        ]
        self._start(starts, found)
        for p, number in starts:
            self._record(EventKind.CHIRP_STARTED, p, found, number)

    def _start_expected(self, expected: ExpectedBursts) -> None:
        """Begin a burst at every expected place that holds one and is not modelled yet."""
        work = self.work
        noise_residual = (self.residual - work.signal).reshape(-1, *work.model.shape)
        tones = tone_scores(noise_residual)
        starts, slopes = expected.candidates()
        for p in np.unique(expected.ramps).tolist():
            table = work.table
            chirps = table.chirps.chosen(table.rows == p)
            centres = -chirps.start_frequency / chirps.slope
            free = np.flatnonzero(expected.free(p, centres, work.model))
            if len(free) == 0 or len(chirps) >= work.schedule.bursts_per_ramp:
                continue
            rows = np.repeat(noise_residual[:, p : p + 1], len(free), axis=1)
            scores = expected_scores(rows, starts[free], slopes[free], work.model)
            place = np.unravel_index(int(np.argmax(scores)), scores.shape)
            best = free[place[0]], place[1]
            score = scores[place][None]
            found = ChirpCandidates(
                starts[best][None], slopes[best][None], score, tones[p : p + 1], score
            )
            if self._expected_there(p, found):
                self._start([(p, 0)], found)
                self._record(EventKind.CHIRP_STARTED, p, found, 0)

    def _expected_there(self, p: int, found: ChirpCandidates) -> bool:
        """Whether a burst is there, and no strong tone that would explain more."""
        score, tone = float(found.score[0]), float(found.tone_score[0])
        is_tone = tone >= score and self.noise_precision * tone > self.threshold
        enough = self.noise_precision * score > self.expected_threshold
        return enough and not is_tone and bool(score >= self._least_scores()[p])

    def _num_bursts(self) -> IntArray:
        """(P,) bursts modelled in every ramp."""
        work = self.work
        own = work.table.rows[: work.num_shared]
        return np.bincount(own, minlength=work.model.num_ramps)

    def _find(self, rows: ComplexArray, ramps: IntArray) -> ChirpCandidates:
        """Best chirp of rows in some ramps; the schedule with one in every ramp uses all."""
        least_score = 0.0 if self.keeps_every_template else self.threshold / self.noise_precision
        found, known = None, self.work.known_slopes
        if known is not None:
            found = find_single_chirps(
                rows, self.work.assumed, least_score=least_score, known_slopes=known
            )
            noise = rows.size / found.score.size / self.noise_precision
            others = found.score < EXPLAINED * (row_energies(rows) - noise)
        if found is None or others.all():
            found = find_single_chirps(rows, self.work.assumed, least_score=least_score)
        elif others.any():
            found = found.with_others(
                others,
                find_single_chirps(
                    rows[..., others, :], self.work.assumed, least_score=least_score
                ),
            )
        if self.keeps_every_template:
            return found
        tones = found.tone_score > np.maximum(found.score, least_score)
        if self.beside_bursts:  # what is left of a burst there is no longer one
            tones[:] = False
        elif tones.any():
            tones &= lone_tones(self._by_antenna(self.residual))[ramps]
        return with_long_chirps(found, rows, tones, self.work.assumed)

    def _confirmed(self, found: ChirpCandidates, number: int) -> bool:
        ratio = self.noise_precision * float(found.score[number])
        return ratio > self.threshold and bool(found.score[number] > found.tone_score[number])

    def _least_scores(self) -> FloatArray:
        """(P,) what is more than the fit of a ramp's bursts has not reached yet."""
        work = self.work
        least = np.zeros(work.model.num_ramps)
        own = row_energies(self._by_antenna(work.table.signals))
        np.maximum.at(least, work.table.rows[: work.num_shared], self.weakest_share * own)
        return least

    def _record(self, kind: EventKind, p: int, found: ChirpCandidates, number: int) -> None:
        ratio = self.noise_precision * float(found.score[number])
        self.work.record(kind, p, ratio, self.threshold)

    def _start(self, starts: Sequence[tuple[int, int]], found: ChirpCandidates) -> None:
        """Begin a burst in each of some ramps, given with the number of its candidate."""
        if not starts:
            return
        work, numbers = self.work, [number for _, number in starts]
        chirps = place_chirps(found.start_frequency[numbers], found.slope[numbers], work.model)
        ramps = np.array([p for p, _ in starts])
        antennas = np.arange(work.model.num_antennas)
        rows = (antennas[:, None] * work.model.num_ramps + ramps).ravel()
        places = work.table.add_bursts(
            rows, chirps.some(np.tile(np.arange(len(ramps)), len(antennas)))
        )
        if not self.keeps_every_template:
            self._initialise_columns(places)

    def _initialise_columns(self, places: IntArray) -> None:
        """Give new bursts one component at zero delay, refined from the search grid."""
        work, table = self.work, self.work.table
        none = np.zeros(len(places))
        columns = table.add_columns(places, none.astype(np.int64), none)
        # theta from (71), several steps from the grid
        work.refine_burst(places, self.residual, self.noise_precision, max_steps=START_STEPS)
        fit = work.posteriors(self.residual, self.noise_precision)
        lost = [
            last
            for ramp, last in zip(
                table.ramps_of_bursts[places].tolist(), columns.tolist(), strict=True
            )
            if not self._initialise_column(ramp, fit)
        ]
        table.remove_columns(lost)
        work.synthesize()

    def _initialise_column(self, ramp: int, fit: FlatPosterior) -> bool:
        """Give the last column of a ramp its prior precision, and tell whether it stays.

        An antenna may receive next to nothing of a burst that the others show, and beside the
        other bursts of its ramp nothing may be left of one: no precision (77) explains that.
        """
        work, table = self.work, self.work.table
        columns, none = table.columns_of(ramp), np.zeros((0, 0), dtype=np.complex128)
        covariance, means = table.covariance_of(ramp, fit.covariances), fit.amplitudes[columns]
        own = Posterior(none, none.ravel(), covariance, means, float(fit.log_determinants[ramp]))
        active = ActiveSet.fitted(own, table.precisions[columns], self.noise_precision)
        last = len(active) - 1
        rho, omega_sq = active.flat_prior_moments(last)  # (23)-(24)
        least_ratio = work.threshold if work.model.num_antennas > 1 else 1.0
        if activation_ratio(rho, omega_sq) <= least_ratio:
            share = means[last] / covariance[last, last].real
            table.amplitudes[columns] = means - covariance[:, last] * share  # those of the others
            table.amplitudes[columns][last] = 0.0
            return False
        active.set_precision(last, converged_precision(rho, omega_sq))  # gamma from (77)
        table.amplitudes[columns], table.precisions[columns] = active.amplitudes, active.precisions
        return True
