"""Where bursts start, stay, restart and end: the modelled ones against an exhaustive search."""

import numpy as np

from vsep._arrays import ComplexArray, from_db
from vsep.inference.channel import channel_posterior
from vsep.inference.chirp_refinement import ChannelCost, place_chirp, refine_chirp
from vsep.inference.chirp_search import ChirpCandidates, find_single_chirps
from vsep.inference.interference import BurstWork, InterferenceWorkspace
from vsep.inference.sbl import converged_precision
from vsep.inference.state import EventKind

START_STEPS = 4  # Newton steps on a new chirp, which comes from a grid
CLEARLY_BETTER = 1.05  # score by which a searched chirp must beat the modelled one to replace it


class BurstSearch:
    """A search for one chirp in every ramp, and what it means for the bursts modelled there.

    Parameters
    ----------
    work : InterferenceWorkspace
        The bursts; changed in place.
    residual : (P, N) complex
        Received signal minus the objects.
    noise_precision : float
        lambda.
    """

    def __init__(
        self, work: InterferenceWorkspace, residual: ComplexArray, noise_precision: float
    ) -> None:
        self.work = work
        self.residual = residual
        self.noise_precision = noise_precision
        first = work.schedule.first_threshold_db
        self.threshold = work.threshold if first is None else float(from_db(first))

    def run(self) -> None:
        """Check every burst on what the others leave, then look for one more in the quiet ramps."""
        changed = self._check_bursts()
        self._start_bursts(changed)

    def _check_bursts(self) -> set[int]:
        """Keep, restart or drop every burst; return the ramps in which something changed."""
        held = list(self.work.each_with_residual(self.residual))
        if not held:
            return set()
        rows = np.array([row for _, row in held])
        found = find_single_chirps(rows, self.work.model)
        changed = set()
        for index, (burst, row) in enumerate(held):
            kind = self._verdict(burst, found, index, row)
            if kind is None:
                continue
            changed.add(burst.ramp)
            self.work.bursts.remove(burst)
            if kind is EventKind.CHIRP_RESTARTED:
                self._start(burst.ramp, found, index, row)
            self._record(kind, burst.ramp, found, index)
        return changed

    def _verdict(
        self, burst: BurstWork, found: ChirpCandidates, index: int, row: ComplexArray
    ) -> EventKind | None:
        """Tell what a search means for a burst; None if it stays as it is."""
        if self.work.schedule.first_threshold_db is None:
            return EventKind.CHIRP_RESTARTED
        if not self._confirmed(found, index):
            return EventKind.CHIRP_DROPPED
        better = found.score[index] > CLEARLY_BETTER * self._single_score(burst, row)
        return EventKind.CHIRP_RESTARTED if better else None

    def _start_bursts(self, changed: set[int]) -> None:
        """Begin a burst in every ramp whose rest holds a chirp."""
        work = self.work
        ramps = [
            p
            for p in range(work.model.num_ramps)
            if p not in changed and len(work.bursts_in(p)) < work.schedule.bursts_per_ramp
        ]
        if not ramps:
            return
        rest = (self.residual - work.signal)[ramps]
        found = find_single_chirps(rest, work.model)
        for index, p in enumerate(ramps):
            if work.schedule.first_threshold_db is None or self._confirmed(found, index):
                self._start(p, found, index, rest[index])
                self._record(EventKind.CHIRP_STARTED, p, found, index)

    def _confirmed(self, found: ChirpCandidates, index: int) -> bool:
        ratio = self.noise_precision * float(found.score[index])
        return ratio > self.threshold and bool(found.score[index] > found.tone_score[index])

    def _record(self, kind: EventKind, ramp: int, found: ChirpCandidates, index: int) -> None:
        ratio = self.noise_precision * float(found.score[index])
        self.work.record(kind, ramp, ratio, self.threshold)

    def _single_score(self, burst: BurstWork, row: ComplexArray) -> float:
        """Best single-component score ``|a^H r|^2 / ||a||^2`` of a modelled chirp over the grid."""
        template = burst.chirp.template
        energy = float(np.vdot(template, template).real) / self.work.model.num_samples
        projections = self.work.grid.projections(template, row)
        return float(np.max(np.abs(projections)) ** 2 / energy)

    def _start(self, ramp: int, found: ChirpCandidates, index: int, row: ComplexArray) -> None:
        """Begin with one component at zero delay, polished from the search grid."""
        work = self.work
        chirp = place_chirp(
            float(found.start_frequency[index]), float(found.slope[index]), work.model
        )
        bins, flat = np.zeros(1, dtype=np.int64), np.zeros(1)
        if work.schedule.first_threshold_db is None:
            silent = np.zeros(work.model.num_samples, dtype=np.complex128)
            work.insert(BurstWork(ramp, chirp, bins[:0], flat[:0], silent))
            return
        cost = ChannelCost(work.grid, row, bins, flat, self.noise_precision)
        chirp = refine_chirp(chirp, work.model, cost, max_steps=START_STEPS)
        active = channel_posterior(work.grid, chirp.template, row, bins, flat, self.noise_precision)
        rho, omega_sq = active.flat_prior_moments(0)
        active.set_precision(0, converged_precision(rho, omega_sq))
        burst = BurstWork(ramp, chirp, bins, flat, row)
        burst.set_posterior(active, work.grid)
        work.insert(burst)
