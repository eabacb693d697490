"""Traffic of the simulated street: who is where, and whose radar sends, at any time.

The own car drives at constant speed along the x axis. Road users of a kind come again and again,
one a period, on straight lines at constant speed; poles and parked cars stand along the road. What
is drawn belongs to one of them and is the same whichever frame shows it.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from vsep.signal.filters import RaisedCosineFilter
from vsep.signal.radar import ChirpSequence, InterfererSequence
from vsep.signal.scene import Channel, Interferer

RADAR: Final = ChirpSequence(
    start_frequency_hz=77e9,
    slope_hz_per_s=10e12,
    sample_rate_hz=10.2e6,
    ramp_period_s=30e-6,
    num_samples=256,
    num_ramps=32,
)
"""The own radar: 0.6 m and 2 m/s of resolution, up to 76 m and 32 m/s."""
FILTER: Final = RaisedCosineFilter(cutoff_hz=RADAR.sample_rate_hz / 4.0, rolloff=0.25)
"""Its anti-aliasing filter."""
OWN_SPEED_MPS: Final = 10.0

_REFERENCE_M = 10.0
_NEAREST_M, _FARTHEST_M = 2.0, 75.0
_EDGE_OF_VIEW = 0.35  # cosine of the largest bearing
_CAR_LENGTH_M = 3.9
_POLE_SPACING_M = 13.0
_JITTER = 0.15  # of a period
_PATHS_S = (0.0, 21e-9, 55e-9)  # excess delays from an interferer
_PATH_LEVELS_DB = (0.0, -13.0, -19.0)
_CLUTTER = 1001  # key of what is drawn for it, beside those of the kinds of road users


@dataclass(frozen=True, kw_only=True, slots=True)
class Kind:
    """Road users that come again and again, one a period."""

    name: str
    period_s: float
    first_s: float  # when the first of them starts
    start_m: tuple[float, float]  # ahead of the own car, and to its left
    velocity_mps: tuple[float, float]  # over ground
    level_dbsm: float
    length_m: float = 0.0  # of what reflects at both ends
    chirps: InterfererSequence | None = None  # of its radar
    sends_s: tuple[float, float] = (1.0, 1.0)  # for so long, every so often


def _chirps(slope_hz_per_s: float, ramp_period_s: float) -> InterfererSequence:
    return InterfererSequence(
        start_frequency_hz=RADAR.start_frequency_hz,
        slope_hz_per_s=slope_hz_per_s,
        ramp_duration_s=25e-6,
        ramp_period_s=ramp_period_s,
        num_ramps=64,
    )


KINDS: Final = (
    Kind(
        name="car",
        period_s=6.0,
        first_s=-1.0,
        start_m=(72.0, 3.5),
        velocity_mps=(-11.0, 0.0),
        level_dbsm=12.0,
        length_m=_CAR_LENGTH_M,
        chirps=_chirps(9.2e12, 27.3e-6),
        sends_s=(21e-3, 47e-3),
    ),
    Kind(
        name="van",
        period_s=7.0,
        first_s=1.5,
        start_m=(72.0, 3.8),
        velocity_mps=(-8.0, 0.0),
        level_dbsm=15.0,
        length_m=_CAR_LENGTH_M,
        chirps=_chirps(11.8e12, 33.7e-6),
        sends_s=(18e-3, 53e-3),
    ),
    Kind(
        name="cyclist",
        period_s=9.0,
        first_s=-4.0,
        start_m=(45.0, -2.5),
        velocity_mps=(5.0, 0.0),
        level_dbsm=3.0,
    ),
    Kind(
        name="pedestrian",
        period_s=8.0,
        first_s=0.6,
        start_m=(24.0, -6.0),
        velocity_mps=(0.0, 1.4),
        level_dbsm=-2.0,
    ),
)
OTHER_SLOPE_HZ_PER_S: Final = 9.2e12
"""Chirp slope of the oncoming cars' radars; the vans' is 11.8 MHz/us."""


@dataclass(frozen=True, slots=True)
class Point:
    """A reflecting point and where it is."""

    name: str
    x_m: float
    y_m: float
    vx_mps: float
    vy_mps: float
    level_dbsm: float
    phase: float

    @property
    def range_m(self) -> float:
        """Distance, m."""
        return math.hypot(self.x_m, self.y_m)

    @property
    def radial_mps(self) -> float:
        """Radial velocity, m/s, positive for what recedes."""
        return (self.x_m * self.vx_mps + self.y_m * self.vy_mps) / self.range_m

    @property
    def in_view(self) -> bool:
        """Whether the radar looks there."""
        ahead = self.x_m > _EDGE_OF_VIEW * self.range_m
        return ahead and _NEAREST_M < self.range_m < _FARTHEST_M

    @property
    def amplitude(self) -> float:
        """Of a unit-norm atom, with an antenna that looks ahead."""
        spread = (_REFERENCE_M / self.range_m) ** 2 * (self.x_m / self.range_m) ** 2
        return float(10.0 ** (self.level_dbsm / 20.0)) * spread


def _rng(seed: int, kind: int, index: int) -> np.random.Generator:
    """Return what draws one object, whichever frame shows it."""
    # Keys are not negative, indices of what was there at the start are.
    key = (kind, 2 * index if index >= 0 else -2 * index - 1)
    return np.random.default_rng(np.random.SeedSequence(seed, spawn_key=key))


def points_of_street(seed: int, time_s: float) -> Iterator[Point]:
    """Yield all reflecting points that may be in view."""
    for number, kind in enumerate(KINDS):
        for index, start_s in _passages(seed, number, kind, time_s):
            yield from _road_user(seed, number, index, time_s - start_s)
    own_m = OWN_SPEED_MPS * time_s
    first = math.ceil(own_m / _POLE_SPACING_M) - 1
    for index in range(first, first + math.ceil(_FARTHEST_M / _POLE_SPACING_M) + 1):
        rng = _rng(seed, _CLUTTER, index)
        side, away = rng.choice([-1.0, 1.0]), rng.uniform(5.5, 9.0)
        place_m = _POLE_SPACING_M * (index + rng.uniform(-0.4, 0.4))
        level, phase = rng.uniform(0.0, 8.0), rng.uniform(0.0, 2.0 * np.pi)
        x_m = place_m - own_m
        yield Point(f"clutter {index}", x_m, side * away, -OWN_SPEED_MPS, 0.0, level, phase)


def _passages(seed: int, number: int, kind: Kind, time_s: float) -> Iterator[tuple[int, float]]:
    """Yield number and start of the road users of a kind that may be in view."""
    lasts_s = 2.0 * _FARTHEST_M / abs(kind.velocity_mps[0] - OWN_SPEED_MPS)
    first = math.floor((time_s - lasts_s - kind.first_s) / kind.period_s)
    last = math.ceil((time_s - kind.first_s) / kind.period_s)
    for index in range(max(first, 0), last + 1):
        delay = _rng(seed, number, index).uniform(0.0, _JITTER)
        start_s = kind.first_s + kind.period_s * (index + delay)
        if start_s <= time_s:
            yield index, start_s


def _road_user(seed: int, number: int, index: int, age_s: float) -> Iterator[Point]:
    """Yield the points of a road user, so long after its start."""
    kind = KINDS[number]
    rng = _rng(seed, number, index)
    level = kind.level_dbsm + rng.uniform(-2.0, 2.0)
    vx, vy = kind.velocity_mps[0] - OWN_SPEED_MPS, kind.velocity_mps[1]
    x, y = kind.start_m[0] + vx * age_s, kind.start_m[1] + vy * age_s
    name = f"{kind.name} {index + 1}"
    yield Point(name, x, y, vx, vy, level, rng.uniform(0.0, 2.0 * np.pi))
    if kind.length_m:
        phase = rng.uniform(0.0, 2.0 * np.pi)
        yield Point(f"{name} rear", x + kind.length_m, y, vx, vy, level - 6.0, phase)


def sending_radars(seed: int, time_s: float, other_slope_hz_per_s: float) -> list[Interferer]:
    """Radars that send while the frame lasts, with their paths to the own one."""
    found = []
    for number, kind in enumerate(KINDS):
        if kind.chirps is None:
            continue
        for index, start_s in _passages(seed, number, kind, time_s):
            place = next(_road_user(seed, number, index, time_s - start_s))
            if not place.in_view:
                continue
            rng = _rng(seed, number + len(KINDS), index)
            sends_s, every_s = kind.sends_s
            age_s = (time_s + rng.uniform(0.0, every_s)) % every_s
            if age_s > sends_s:
                continue
            sequence = kind.chirps
            if sequence.slope_hz_per_s == OTHER_SLOPE_HZ_PER_S:
                sequence = replace(sequence, slope_hz_per_s=other_slope_hz_per_s)
            offset_s = -(age_s % sequence.ramp_period_s)
            amplitude = _REFERENCE_M / place.range_m / math.sqrt(_whole_burst(sequence))
            found.append(
                Interferer(
                    sequence=replace(sequence, time_offset_s=offset_s),
                    channel=_paths(rng, amplitude),
                )
            )
    return found


def _whole_burst(sequence: InterfererSequence) -> float:
    """Energy of a burst of unit amplitude: the samples for which it is in the band."""
    difference = abs(sequence.slope_hz_per_s - RADAR.slope_hz_per_s)
    return 2.0 * FILTER.cutoff_hz / difference * RADAR.sample_rate_hz


def _paths(rng: np.random.Generator, amplitude: float) -> Channel:
    levels = amplitude * 10.0 ** (np.array(_PATH_LEVELS_DB) / 20.0)
    phases = rng.uniform(0.0, 2.0 * np.pi, len(levels))
    return Channel(
        delays_s=np.array(_PATHS_S),
        dopplers_hz=np.zeros(len(levels)),
        weights=levels * np.exp(1j * phases),
    )
