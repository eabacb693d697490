"""Where bursts start, stay, restart and end: the modelled ones against an exhaustive search."""

from collections.abc import Iterator, Sequence

import numpy as np
from scipy import fft

from vsep._arrays import BoolArray, ComplexArray, FloatArray, from_db
from vsep.inference.chirp_refinement import place_chirps
from vsep.inference.chirp_search import (
    ChirpCandidates,
    find_single_chirps,
    squared_norms,
    tone_scores,
)
from vsep.inference.expected_bursts import (
    ExpectedBursts,
    expected_scores,
    expected_threshold,
)
from vsep.inference.interference import InterferenceWorkspace
from vsep.inference.ramp_work import RampWork
from vsep.inference.sbl import activation_ratio, converged_precision, threshold_of_sum
from vsep.inference.state import EventKind

START_STEPS = 4  # Newton steps on a new chirp, which comes from a grid
CLEARLY_BETTER = 1.05  # score by which a searched chirp must beat the modelled one to replace it
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
    """

    def __init__(
        self,
        work: InterferenceWorkspace,
        residual: ComplexArray,
        noise_precision: float,
        *,
        weakest_share: float,
        expected: ExpectedBursts | None = None,
    ) -> None:
        self.work = work
        self.residual = residual
        self.noise_precision = noise_precision
        self.weakest_share = weakest_share
        first = work.schedule.first_threshold_db
        self.literal = first is None
        threshold = work.threshold if first is None else float(from_db(first))
        self.threshold = threshold_of_sum(threshold, work.model.num_antennas)
        self.expected = expected
        if expected is not None:
            lower = min(expected_threshold(work.assumed, threshold, expected.reach), threshold)
            self.expected_threshold = threshold_of_sum(lower, work.model.num_antennas)

    def run(self) -> None:
        """Check every burst on what the others leave, then look for one more in the quiet ramps."""
        changed = self._check_bursts()
        self._start_bursts(changed)
        if self.expected is not None:
            self._start_expected(self.expected)

    def _check_bursts(self) -> set[int]:
        """Keep, restart or drop every burst; return the ramps in which something changed."""
        # From the back, so that an index stays valid while bursts are removed behind it.
        held = [
            (ramp, index)
            for ramp in self.work.first_antenna()
            for index in reversed(range(len(ramp.chirps)))
        ]
        if not held:
            return set()
        rows = self._of_antennas(
            [
                [self.residual[each.ramp] - each.signal + each.signals[index] for each in together]
                for together, index in self._together(held)
            ]
        )
        scores = self._scores(held, rows)
        doubtful = np.flatnonzero(
            self._doubtful(scores, rows) & np.logical_not(self._as_expected(held, scores))
        )
        if len(doubtful) == 0:
            return set()
        found = self._find(rows[..., doubtful, :])
        changed = set()
        for number, place in enumerate(doubtful.tolist()):
            ramp, index = held[place]
            kind = self._verdict(found, number, float(scores[:, place].max()))
            if kind is None:
                continue
            changed.add(ramp.ramp)
            self.work.remove_burst(ramp, index)
            if kind is EventKind.CHIRP_RESTARTED:
                self._start([(ramp.ramp, number)], found)
            self._record(kind, ramp.ramp, found, number)
        return changed

    def _together(
        self, held: Sequence[tuple[RampWork, int]]
    ) -> Iterator[tuple[list[RampWork], int]]:
        """Yield the ramp of each burst as every antenna received it."""
        return ((self.work.same_ramp(ramp), index) for ramp, index in held)

    @staticmethod
    def _of_antennas(rows: Sequence[Sequence[ComplexArray]]) -> ComplexArray:
        """(B, N) rows of B ramps at one antenna, or (A, B, N) at several."""
        return np.swapaxes(np.array(rows), 0, 1) if len(rows[0]) > 1 else np.array(rows)[:, 0]

    def _scores(self, held: Sequence[tuple[RampWork, int]], rows: ComplexArray) -> FloatArray:
        """(2, B) best single-component score of modelled bursts, and what all of each explains.

        The score is ``|a^H r|^2 / ||a||^2`` over the channel grid.
        """
        templates = np.array([ramp.chirps[index].template for ramp, index in held])
        rest = rows - self._of_antennas(
            [[each.signals[index] for each in together] for together, index in self._together(held)]
        )
        num_bins = self.work.grid.num_bins
        products = fft.ifft(templates.conj() * rows, num_bins, axis=-1, norm="forward")
        power = _sum_of_antennas(np.abs(products) ** 2)
        single = np.max(power, axis=1) / squared_norms(templates)
        return np.array([single, row_energies(rows) - row_energies(rest)])

    def _doubtful(self, scores: FloatArray, rows: ComplexArray) -> BoolArray:
        """(B,) whether a search can say anything of a burst but that it stays as it is.

        No chirp scores more than the energy of its row, and the best one of the search comes close
        to the modelled one at least.
        """
        single, explained = scores
        needed = np.maximum(tone_scores(rows), self.threshold / self.noise_precision)
        certain = (CLEARLY_BETTER * explained > row_energies(rows)) & (SURE * single > needed)
        return np.asarray(~certain | self.literal)

    def _as_expected(
        self, held: Sequence[tuple[RampWork, int]], scores: FloatArray
    ) -> BoolArray | bool:
        """(B,) whether a burst lies where one is expected and is still strong enough for that."""
        expected, work = self.expected, self.work
        if expected is None:
            return False
        margin = work.threshold / work.prune_threshold
        places = [(ramp.ramp, ramp.chirps[index]) for ramp, index in held]
        near = [
            expected.near(p, -chirp.start_frequency / chirp.slope, chirp.slope, work.model)
            for p, chirp in places
        ]
        strong = self.noise_precision * scores[0] * margin > self.expected_threshold
        return np.asarray(np.array(near) & strong)

    def _verdict(self, found: ChirpCandidates, number: int, score: float) -> EventKind | None:
        """Tell what a search means for a burst; None if it stays as it is.

        A chirp fitted with many components need not be the best with one: only one that explains
        more than the whole burst shows that the burst is wrong.
        """
        if self.literal:
            return EventKind.CHIRP_RESTARTED
        if not self._confirmed(found, number):
            return EventKind.CHIRP_DROPPED
        better = found.score[number] > CLEARLY_BETTER * score
        return EventKind.CHIRP_RESTARTED if better else None

    def _start_bursts(self, changed: set[int]) -> None:
        """Begin a burst in every ramp whose rest holds a chirp."""
        work = self.work
        rest = self.residual - work.signal
        if work.model.num_antennas > 1:
            rest = rest.reshape(-1, *work.model.shape)
        energies = row_energies(rest)
        ramps = [
            p
            for p in range(work.model.num_ramps)
            if p not in changed
            and self._num_bursts(p) < work.schedule.bursts_per_ramp
            # No chirp scores more than the energy there is.
            and self._strong(p, energies[p])
        ]
        if not ramps:
            return
        found = self._find(rest[..., ramps, :])
        starts = [
            (p, number)
            for number, p in enumerate(ramps)
            if self.literal
            or (self._confirmed(found, number) and self._strong(p, found.score[number]))
        ]
        self._start(starts, found)
        for p, number in starts:
            self._record(EventKind.CHIRP_STARTED, p, found, number)

    def _start_expected(self, expected: ExpectedBursts) -> None:
        """Begin a burst at every expected place that holds one and is not modelled yet."""
        work = self.work
        rest = (self.residual - work.signal).reshape(-1, *work.model.shape)
        tones = tone_scores(rest)
        starts, slopes = expected.candidates()
        for p in np.unique(expected.ramps).tolist():
            chirps = work.ramps[p].chirps if p in work.ramps else []
            centres = np.array([-chirp.start_frequency / chirp.slope for chirp in chirps])
            free = np.flatnonzero(expected.free(p, centres, work.model))
            if len(free) == 0 or len(chirps) >= work.schedule.bursts_per_ramp:
                continue
            rows = np.repeat(rest[:, p : p + 1], len(free), axis=1)
            scores = expected_scores(rows, starts[free], slopes[free], work.model)
            place = np.unravel_index(int(np.argmax(scores)), scores.shape)
            best = free[place[0]], place[1]
            found = ChirpCandidates(
                starts[best][None], slopes[best][None], scores[place][None], tones[p : p + 1]
            )
            if self._expected_there(p, found):
                self._start([(p, 0)], found)
                self._record(EventKind.CHIRP_STARTED, p, found, 0)

    def _expected_there(self, p: int, found: ChirpCandidates) -> bool:
        """Whether a burst is there, and no strong tone that would explain more."""
        score, tone = float(found.score[0]), float(found.tone_score[0])
        is_tone = tone >= score and self.noise_precision * tone > self.threshold
        enough = self.noise_precision * score > self.expected_threshold
        return enough and not is_tone and self._strong(p, score)

    def _num_bursts(self, p: int) -> int:
        return len(self.work.ramps[p].chirps) if p in self.work.ramps else 0

    def _find(self, rows: ComplexArray) -> ChirpCandidates:
        """Best chirp of every row; the schedule that keeps one in every ramp uses all of them."""
        least_score = 0.0 if self.literal else self.threshold / self.noise_precision
        return find_single_chirps(rows, self.work.assumed, least_score=least_score)

    def _confirmed(self, found: ChirpCandidates, number: int) -> bool:
        ratio = self.noise_precision * float(found.score[number])
        return ratio > self.threshold and bool(found.score[number] > found.tone_score[number])

    def _strong(self, p: int, score: float) -> bool:
        """Whether a further burst is not just what the fit of the others has not reached yet."""
        if p not in self.work.ramps:
            return True
        together = self.work.same_ramp(self.work.ramps[p])
        energy = sum(np.sum(np.abs(each.signals) ** 2, axis=1) for each in together)
        return bool(score >= self.weakest_share * energy.max())

    def _record(self, kind: EventKind, p: int, found: ChirpCandidates, number: int) -> None:
        ratio = self.noise_precision * float(found.score[number])
        self.work.record(kind, p, ratio, self.threshold)

    def _start(self, starts: Sequence[tuple[int, int]], found: ChirpCandidates) -> None:
        """Begin a burst in each of some ramps, given with the number of its candidate."""
        if not starts:
            return
        work, numbers = self.work, [number for _, number in starts]
        chirps = place_chirps(found.start_frequency[numbers], found.slope[numbers], work.model)
        begun: dict[int, list[RampWork]] = {}  # by the index of the burst in its ramp
        for (p, _), chirp in zip(starts, chirps, strict=True):
            rows = range(p, p + work.model.rows_shape[0], work.model.num_ramps)
            together = [work.ramps.setdefault(row, RampWork(row)) for row in rows]
            begun.setdefault(len(together[0].chirps), []).extend(together)
            for ramp in together:
                ramp.chirps.append(chirp)
        for index, ramps in begun.items():
            self._weigh_first(ramps, index)
            work.synthesize(ramps)

    def _weigh_first(self, ramps: Sequence[RampWork], index: int) -> None:
        """Give new bursts one component at zero delay, polished from the search grid."""
        work, noise_precision = self.work, self.noise_precision
        if self.literal:
            for ramp in ramps:
                active = work.posterior(ramp, self.residual[ramp.ramp], noise_precision)
                work.take_over(ramp, active)
            return
        for ramp in ramps:
            ramp.owners, ramp.bins = np.append(ramp.owners, index), np.append(ramp.bins, 0)
            ramp.precisions = np.append(ramp.precisions, 0.0)
        work.refine_burst(ramps, index, self.residual, noise_precision, max_steps=START_STEPS)
        for ramp in ramps:
            self._weigh_new(ramp)

    def _weigh_new(self, ramp: RampWork) -> None:
        """Give the last column of a ramp its prior precision, or take it out.

        An antenna may receive next to nothing of a burst that the others show.
        """
        work, residual = self.work, self.residual[ramp.ramp]
        active = work.posterior(ramp, residual, self.noise_precision)
        last = len(active) - 1
        rho, omega_sq = active.flat_prior_moments(last)
        if work.model.num_antennas > 1 and activation_ratio(rho, omega_sq) <= work.threshold:
            ramp.owners, ramp.bins = ramp.owners[:last], ramp.bins[:last]
            ramp.precisions = ramp.precisions[:last]
            active = work.posterior(ramp, residual, self.noise_precision)
        else:
            active.set_precision(last, converged_precision(rho, omega_sq))
        work.take_over(ramp, active)


def row_energies(rows: ComplexArray) -> FloatArray:
    """(B,) energies of the rows of B ramps, (B, N) or, summed over antennas, (A, B, N)."""
    return _sum_of_antennas(squared_norms(rows)[..., None])[:, 0]


def _sum_of_antennas(powers: FloatArray) -> FloatArray:
    """(B, N) of powers (B, N) or (A, B, N)."""
    return np.asarray(powers.sum(axis=0)) if powers.ndim == 3 else powers
