"""Algorithm 3 for the objects of a radar with dithered ramps.

The cost (70) is that of all other objects; only inner products of atoms differ, see
`vsep.signal.dithered_atoms`. The grid of candidates is a Fourier transform over the samples, a
phase for the start frequency of each ramp, and a transform over the ramps' true start times.
"""

from functools import lru_cache
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import fft

from vsep._typing import ComplexArray, FloatArray
from vsep.inference.core.state import SeparationState
from vsep.inference.objects.refinement import place_components
from vsep.inference.objects.workspace import ObjectThreshold, ObjectWorkspace
from vsep.kernels.candidates import (
    CANDIDATE_PEAKS,
    NEW_COMPONENT_STEPS,
    Candidate,
    candidate_at,
    next_peak,
)
from vsep.kernels.convergence import largest_change
from vsep.kernels.doppler_intervals import FOLD_GAIN, FOLD_SHARE
from vsep.kernels.moving_atoms import fold_width
from vsep.kernels.newton_ascent import NO_GAIN, TRIALS, Updated, newton_or_gradient_step
from vsep.kernels.object_cost import MIN_SCHUR, CostJet
from vsep.signal.dithered_atoms import RampDither, pair_jet, signal_jet
from vsep.signal.dithered_spectra import dithered_spectrum
from vsep.signal.template import SignalModel
from vsep.units import wrap_frequency

ABSENT: Final = 1e9  # of lambda: prior precision of a component that has no weight any more
MOVED_CELLS: Final = 0.25  # between the motions of candidates that are looked at together
ROUNDS: Final = 2  # of single steps of all objects, in the place of one of all together


def object_workspace(
    state: SeparationState,
    residual: ComplexArray,
    noise_precision: float,
    model: SignalModel,
    threshold: ObjectThreshold,
) -> ObjectWorkspace:
    """Begin Algorithm 3 with the objects of a state, as the ramps of the model see them.

    Parameters as for `ObjectWorkspace`.
    """
    kind = DitheredWorkspace if isinstance(model.migration, RampDither) else ObjectWorkspace
    return kind(
        state.objects,
        residual,
        noise_precision,
        threshold=threshold,
        next_id=state.next_component_id,
        num_antennas=model.num_antennas,
        migration=model.migration,
    )


class _Others(NamedTuple):
    """Posterior of all objects but one."""

    atoms: tuple[ComplexArray, ...]  # of `RampDither.atoms`
    covariance: ComplexArray  # (K, K)
    amplitudes: ComplexArray  # (K, A)


class DitheredWorkspace(ObjectWorkspace):
    """The object components of a radar with dithered ramps while Algorithm 3 changes them."""

    @property
    def _dither(self) -> RampDither:
        assert isinstance(self.placed.migration, RampDither)
        return self.placed.migration

    @property
    def _signals(self) -> ComplexArray:
        """(A, P, N) what is to be explained."""
        return self.residual.reshape(self.num_antennas, *self._shape)

    def _best_candidate(self) -> Candidate:
        """Look for one more component in what the others leave unexplained."""
        left = self._signals - self.signal.reshape(self._signals.shape)
        power = candidate_power(left, self._dither, FOLD_GAIN / self.active.noise_precision)
        num_rows, num_columns = power.shape
        levels = self.threshold.levels(np.arange(num_columns) / num_columns)
        power /= levels.astype(np.float32)
        highest = power.argmax(axis=1)
        columns = self.placed.columns
        atoms = self._dither.atoms(self.points, self._shape[1])
        others = _Others(atoms, columns.covariance, columns.amplitudes)
        best = Candidate(0.0, 0.0, 0.0, 0.0, True)
        for _ in range(CANDIDATE_PEAKS):
            row, column = next_peak(power, highest)
            doppler = (row - num_rows // 2) / (2 * self._shape[0])
            peak = np.array([column / num_columns, doppler])
            top, end, start = self._ascended(peak, 0.0, others, NEW_COMPONENT_STEPS)
            for (beat, doppler), jet in ((top, end), (peak, start)):
                level = float(levels[int(np.rint(beat * num_columns)) % num_columns])
                precision = self.active.noise_precision
                candidate = candidate_at(
                    beat, doppler, jet, self.num_antennas, precision, level, True
                )
                if candidate.ratio > self.threshold.ratio and not candidate.absorbed:
                    return candidate
                if candidate.ratio > best.ratio:
                    best = candidate
        return best

    def update_components(self, *, jointly: bool = True) -> None:
        """Refine, re-estimate or prune every component in turn (the loop of Algorithm 3)."""
        start, kept = self.points, np.arange(len(self.ids))
        for _ in range(ROUNDS if jointly else 1):
            new = self._updated()
            self.forget(new.kept, new.ratios)
            kept = kept[new.kept]
            before, active = self.placed, self.active
            self.placed = place_components(
                new.points[new.kept],
                new.precisions[new.kept],
                self.residual,
                active.noise_precision,
                before.background,
                before.migration,
            )
        points = self.placed.points.copy()
        self.max_frequency_change = largest_change(
            start[kept], points, self.placed.active.precisions, self.placed.columns
        )
        points[:, 0] = wrap_frequency(points[:, 0])
        self.placed = place_components(
            points,
            self.placed.active.precisions,
            self.residual,
            self.placed.active.noise_precision,
            self.placed.background,
            self.placed.migration,
        )

    def _updated(self) -> Updated:
        """Move, test and re-estimate every component, with the posterior of all others."""
        points, precisions = self.points.copy(), self.active.precisions.copy()
        levels = self.threshold.kept_levels(points[:, 0], 2 * self.residual.shape[1])
        count, noise_precision = len(points), self.active.noise_precision
        new = Updated(points, precisions, np.ones(count, np.bool_), np.zeros(count))
        for index in range(count):
            columns = self.placed.columns
            atoms = self._dither.atoms(self.points, self._shape[1])
            others = _without(index, atoms, columns.covariance, columns.amplitudes)
            start = self._unfolded_point(points[index], precisions[index], others)
            moved, jet, _ = self._ascended(start, precisions[index], others, 1)
            if jet.inverse_rho > MIN_SCHUR * noise_precision:
                new.ratios[index] = jet.power / jet.inverse_rho / levels[index]
            new.kept[index] = new.ratios[index] > self.threshold.ratio
            if new.kept[index]:
                points[index] = moved
                excess = levels[index] * (new.ratios[index] / self.num_antennas - 1.0)
                precisions[index] = jet.inverse_rho / excess  # the fixed point (77)
            else:
                precisions[index] = ABSENT * noise_precision
            self._place(points, precisions)
        return new

    def _unfolded_point(self, point: FloatArray, precision: float, others: _Others) -> FloatArray:
        """Return a point in the interval of Doppler frequency in which it explains most."""
        motion = self._dither.motion
        if motion.coupling == 0.0:
            return point
        step = np.array([-motion.ramp_share, fold_width(motion, self._shape[1])])
        farthest = step[1] * (motion.folds + 0.5)
        current = self._cost(point, precision, others)
        turns = [turn for turn in range(-2 * motion.folds, 2 * motion.folds + 1) if turn != 0]
        beside = [point + turn * step for turn in turns]
        places = [each for each in beside if abs(each[1]) <= farthest]
        values = [self._cost(each, precision, others).value for each in places]
        best = int(np.argmax(values))
        inverse_rho = max(current.inverse_rho, MIN_SCHUR * self.active.noise_precision)
        loss = _fold_loss(self._dither, self._shape[1])
        gain = max(FOLD_GAIN, FOLD_SHARE * loss * current.power / inverse_rho)
        return places[best] if values[best] > current.value + gain else point

    def _place(self, points: FloatArray, precisions: FloatArray) -> None:
        """Posterior of all components at new points."""
        before = self.placed
        self.placed = place_components(
            points.copy(),
            precisions.copy(),
            self.residual,
            before.active.noise_precision,
            before.background,
            before.migration,
        )

    def _ascended(
        self, point: FloatArray, precision: float, others: _Others, max_steps: int
    ) -> tuple[FloatArray, CostJet, CostJet]:
        """Maximise (70) by safeguarded Newton steps; the point, and the costs there and before."""
        place = np.array(point, dtype=np.float64)
        start = current = self._cost(place, precision, others)
        num_ramps, num_samples = self._shape
        for _ in range(max_steps):
            step = np.array(newton_or_gradient_step(current, num_samples, num_ramps))
            if current.by_beat * step[0] + current.by_doppler * step[1] < 2.0 * NO_GAIN:
                break
            for _ in range(TRIALS):
                trial = self._cost(place + step, precision, others)
                if trial.value >= current.value:
                    break
                step *= 0.25
            else:
                break
            place, current = place + step, trial
        return place, current, start

    def _cost(self, point: FloatArray, precision: float, others: _Others) -> CostJet:
        """Cost (70) of one component with gradient and Hessian; see `cost_jet`."""
        num_samples, noise_precision = self._shape[1], self.active.noise_precision
        rows = pair_jet(point, others.atoms, self._dither, num_samples)  # phi^H Phi
        innovations = signal_jet(point, self._signals, self._dither) - rows @ others.amplitudes
        weighted = others.covariance @ rows[:3].conj().T  # C Phi^H phi
        powers = noise_precision**2 * (innovations @ innovations.conj().T).real
        overlaps = -(noise_precision**2) * (rows @ weighted).real
        pairs = ((1, 1, 3), (1, 2, 4), (2, 2, 5))
        power, by = powers[0, 0], 2.0 * powers[0, 1:3]
        twice = [2.0 * (powers[i, j] + powers[0, k]) for i, j, k in pairs]
        inverse_rho = noise_precision + overlaps[0, 0]
        schur = max(inverse_rho + precision, MIN_SCHUR * noise_precision)
        schur_by = 2.0 * overlaps[1:3, 0]
        schur_twice = [2.0 * (overlaps[k, 0] + overlaps[i, j]) for i, j, k in pairs]
        ratio, antennas = power / schur, self.num_antennas
        rise, bend = antennas + ratio, (antennas + 2.0 * ratio) / schur
        hessian = [
            (
                p
                - rise * s
                - (by[a] * schur_by[b] + by[b] * schur_by[a]) / schur
                + bend * schur_by[a] * schur_by[b]
            )
            / schur
            for p, s, (a, b) in zip(twice, schur_twice, ((0, 0), (0, 1), (1, 1)), strict=True)
        ]
        gradient = (by - rise * schur_by) / schur
        value = ratio - antennas * np.log(schur)
        return CostJet(*(float(each) for each in (value, *gradient, *hessian, inverse_rho, power)))


def _without(
    index: int,
    atoms: tuple[ComplexArray, ...],
    covariance: ComplexArray,
    amplitudes: ComplexArray,
) -> _Others:
    """Posterior of the others as if one were not there."""
    keep = np.arange(len(amplitudes)) != index
    column = covariance[keep, index] / covariance[index, index].real
    return _Others(
        tuple(each[keep] for each in atoms),
        covariance[np.ix_(keep, keep)] - np.outer(column, covariance[keep, index].conj()),
        amplitudes[keep] - np.outer(column, amplitudes[index]),
    )


@lru_cache(maxsize=4)
def _transforms(
    dither: RampDither, num_samples: int
) -> tuple[NDArray[np.complex64], NDArray[np.complex64]]:
    """Phases (P, 2N) of the start frequencies, and the transform (2P, P) over start times."""
    num_ramps = len(dither.start_ramps)
    beats = dither.unambiguous(np.arange(2 * num_samples) / (2 * num_samples))
    dopplers = (np.arange(2 * num_ramps) - num_ramps) / (2 * num_ramps)
    phases = np.exp(2j * np.pi * dither.samples[:, None] * beats)
    turns = np.exp(2j * np.pi * dopplers[:, None] * dither.ramps)
    scale = 1.0 / np.sqrt(num_ramps * num_samples)
    return phases.astype(np.complex64), (scale * turns).astype(np.complex64)


@lru_cache(maxsize=4)
def _fold_loss(dither: RampDither, num_samples: int) -> float:
    """Power that an atom in the next interval of Doppler frequency misses, to what it explains."""
    beside = np.array([[-dither.motion.ramp_share, fold_width(dither.motion, num_samples)]])
    origin = dither.atoms(np.zeros((1, 2)), num_samples)
    kept = float(abs(pair_jet(beside[0], origin, dither, num_samples)[0, 0]) ** 2)
    return 1.0 / kept - 1.0


def candidate_power(
    signals: ComplexArray, dither: RampDither, lead: float = 0.0
) -> NDArray[np.float32]:
    """(R, 2N) power that atoms on a grid of half a cell explain of signals (A, P, N).

    Doppler frequencies are centred at zero, one interval or all that motion tells apart; beats
    begin at zero. What is not in the first interval is lowered as `favour_first_interval` does it,
    by its share and by the lead.
    """
    if dither.motion.coupling != 0.0:
        num_ramps, num_samples = signals.shape[1:]
        num_rows = 2 * num_ramps * (2 * dither.motion.folds + 1)
        dopplers = (np.arange(num_rows) - num_rows // 2) / (2 * num_ramps)
        single = (signals / np.sqrt(num_ramps * num_samples)).astype(np.complex64)
        moving = dithered_spectrum(single, dither, dopplers, 2 * num_samples, cells=MOVED_CELLS)
        power = np.asarray((moving.real**2 + moving.imag**2).sum(axis=0))
        share = 1.0 / (1.0 + FOLD_SHARE * _fold_loss(dither, num_samples))
        beyond = abs(np.arange(num_rows) - num_rows // 2) > num_ramps
        power[beyond] = np.maximum(share * power[beyond] - lead, 0.0)
        return power
    phases, turns = _transforms(dither, signals.shape[2])
    single = signals.astype(np.complex64)
    across = phases * fft.ifft(single, 2 * signals.shape[2], axis=2, norm="forward")
    products = turns @ across
    return np.asarray((products.real**2 + products.imag**2).sum(axis=0), dtype=np.float32)
