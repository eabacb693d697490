"""Objects of a radar with Doppler division: the lines of its transmitters, joined.

Lines of an object are orthogonal as far as 1 / K is many cells, so that they are estimated as any
others, and joined afterwards: the Cramer-Rao bound of the joint model is kept.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from vsep._typing import BoolArray, ComplexArray, FloatArray, IntArray
from vsep.errors import InputError
from vsep.inference.core.state import SeparationState
from vsep.inference.deviations import state_deviations
from vsep.signal.chirped_atoms import ChirpedPoint, chirped_products, chirped_signals
from vsep.signal.dithered_atoms import coupled_products, coupled_signals
from vsep.signal.doppler_division import DopplerDivision
from vsep.signal.radar import ChirpSequence
from vsep.units import wrap_frequency

REACH_DEVIATIONS: Final = 6.0  # by which lines of one object differ at most ...
REACH_CELLS: Final = 0.05  # ... or this


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class DividedObjects:
    """Objects of a radar with Doppler division.

    Parameters
    ----------
    lines : (L, T) int
        Which object of the estimate is the line of each transmitter, -1 where none is found.
    beats, dopplers : (L,) float
        Their own frequencies.
    beat_std, doppler_std : (L,) float
        Standard deviations.
    amplitudes : (L, T A) complex
        Weights, transmitter by transmitter.
    variance : float
        Of each weight.
    """

    lines: IntArray
    beats: FloatArray
    dopplers: FloatArray
    beat_std: FloatArray
    doppler_std: FloatArray
    amplitudes: ComplexArray
    variance: float


def join_lines(
    received: ComplexArray,
    state: SeparationState,
    radar: ChirpSequence,
    waveform: DopplerDivision,
) -> DividedObjects:
    """Join the lines of an estimate to objects, the strongest first.

    A line may be that of any transmitter: each is tried, with the nearest lines where the others
    must be, or with what is left of the frame there. The weights are those at the common place.

    Parameters
    ----------
    received : (P, N) or (A, P, N) complex
        The frame.
    state : SeparationState
        Of any estimator, of all antennas together.
    radar : ChirpSequence
        The victim; its objects stay in their range cells, and its ramps start at equal times.
    waveform : DopplerDivision
        The transmitters.

    Raises
    ------
    InputError
        If the radar models range migration, or start times of its ramps are dithered.
    """
    if not can_be_joined(radar):
        raise InputError(
            "Lines are joined where range_migration is off and ramps start at equal times, as the "
            "phases of the transmitters step from ramp to ramp; of this radar it is on, or start "
            "times are dithered."
        )
    joining = _Joining(received, state, radar, waveform)
    free = np.ones(state.objects.num_components, dtype=np.bool_)
    lines = []
    for seed in np.argsort(-state.objects.powers):
        if free[seed]:
            chosen = joining.best_lines(int(seed), free)
            free[[line for line in chosen if line >= 0]] = False
            lines.append(chosen)
    return joining.joined(lines)


def can_be_joined(radar: ChirpSequence) -> bool:
    """Whether a line of a transmitter is that of an object at another Doppler frequency."""
    return radar.motion.coupling == 0.0 and not any(radar.start_times_s)


class _Joining:
    """An estimate whose lines are joined."""

    def __init__(
        self,
        received: ComplexArray,
        state: SeparationState,
        radar: ChirpSequence,
        waveform: DopplerDivision,
    ) -> None:
        left = state.cleaned(received.reshape(state.object_signal.shape)) - state.object_signal
        self.left = left.reshape(-1, *radar.shape)
        self.objects, self.offsets = state.objects, waveform.offsets
        self.precision = state.effective_precision
        self.std = state_deviations(state, radar.shape, radar.migration)
        self.shape, self.dither = radar.shape, radar.dither

    def best_lines(self, seed: int, free: BoolArray) -> list[int]:
        """Return the lines of a seed's object, by the transmitter that explains most with it."""
        trials = [self._lines(seed, transmitter, free) for transmitter in range(len(self.offsets))]
        return max(trials, key=lambda each: each[0])[1]

    def _lines(self, seed: int, transmitter: int, free: BoolArray) -> tuple[float, list[int]]:
        """Evidence and lines if a seed is the line of this transmitter."""
        objects, lines, evidence = self.objects, [], 0.0
        for offset in self.offsets - self.offsets[transmitter]:
            beat, doppler = objects.beats[seed], objects.dopplers[seed] + offset
            line = seed if offset == 0.0 else self._nearest(seed, float(doppler), free)
            if line < 0:
                power = float(np.sum(abs(self._products(beat, doppler, self.left)) ** 2))
            else:
                power = float(objects.powers[line]) * len(self.left)
            evidence += float(np.log1p(self.precision * power))
            lines.append(line)
        return evidence, lines

    def _nearest(self, seed: int, doppler: float, free: BoolArray) -> int:
        """Return the free line at a seed's beat and a Doppler frequency, -1 where there is none."""
        objects, std = self.objects, self.std
        apart = np.stack([objects.beats - objects.beats[seed], objects.dopplers - doppler])
        apart = abs(wrap_frequency(apart))
        deviations = np.stack([np.hypot(each, each[seed]) for each in (std.beats, std.dopplers)])
        cells = np.array([[1.0 / self.shape[1]], [1.0 / self.shape[0]]])
        reach = np.maximum(REACH_DEVIATIONS * deviations, REACH_CELLS * cells)
        reach = np.minimum(reach, 0.5 * cells)
        distance = np.where(free & np.all(apart <= reach, axis=0), np.sum(apart / reach, axis=0), 9)
        nearest = int(np.argmin(distance))
        return nearest if distance[nearest] < 9 and nearest != seed else -1

    def joined(self, lines: Sequence[Sequence[int]]) -> DividedObjects:
        """Return objects at the common places of their lines."""
        chosen = np.array(lines, dtype=np.int64).reshape(len(lines), len(self.offsets))
        places = np.array([self._place(each) for each in chosen]).reshape(-1, 4)
        weights = [self._weights(each, place) for each, place in zip(chosen, places, strict=True)]
        size = len(self.offsets) * len(self.left)
        return DividedObjects(
            lines=chosen,
            beats=places[:, 0],
            dopplers=places[:, 1],
            beat_std=places[:, 2],
            doppler_std=places[:, 3],
            amplitudes=np.array(weights, dtype=np.complex128).reshape(-1, size),
            variance=1.0 / self.precision,
        )

    def _place(self, lines: IntArray) -> tuple[float, float, float, float]:
        """Means of the lines' frequencies, weighted by their variances, and deviations."""
        found = lines[lines >= 0]
        own = self.objects.dopplers[found] - self.offsets[lines >= 0]
        means, stds = [], []
        for values, std in ((self.objects.beats[found], self.std.beats), (own, self.std.dopplers)):
            weights = 1.0 / std[found] ** 2
            around = values[0] + wrap_frequency(values - values[0])
            means.append(float(wrap_frequency(np.average(around, weights=weights))))
            stds.append(float(1.0 / np.sqrt(weights.sum())))
        return means[0], means[1], stds[0], stds[1]

    def _weights(self, lines: IntArray, place: FloatArray) -> ComplexArray:
        """(T A,) weights of an object at its place."""
        weights = []
        for line, offset in zip(lines, self.offsets, strict=True):
            signals = self.left
            if line >= 0:
                signals = signals + self._signals(line)
            weights.append(self._products(place[0], place[1] + offset, signals))
        return np.concatenate(weights)

    def _products(self, beat: float, doppler: float, signals: ComplexArray) -> ComplexArray:
        """Inner products (A,) of an atom with signals (A, P, N)."""
        if self.dither is None:
            return chirped_products(ChirpedPoint(float(beat), float(doppler), 0.0), signals)
        point, rows = np.array([[beat, doppler]]), signals.reshape(-1, self.shape[1])
        return np.asarray(coupled_products(point, self.dither, self.shape[0], rows)[0])

    def _signals(self, line: int) -> ComplexArray:
        """Signals (A, P, N) of a line of the estimate."""
        objects = self.objects
        own = np.array([[objects.beats[line], objects.dopplers[line], 0.0]])
        amplitudes = objects.amplitudes[line].reshape(1, -1)
        if self.dither is None:
            return np.asarray(chirped_signals(own, amplitudes, self.shape)[0])
        rows = coupled_signals(own[:, :2], amplitudes, self.dither, *self.shape)
        return rows.reshape(-1, *self.shape)
