"""Cars as extended objects: spectral lines over an extent that move together."""

import numpy as np

from vsep._typing import FloatArray
from vsep._validation import require_range
from vsep.parameters import MAX_CARS
from vsep.signal.radar import SPEED_OF_LIGHT_MPS, ChirpSequence
from vsep.signal.scene import Channel

LINES = (3, 8)
EXTENTS_M = (1.5, 4.5)
LEVELS_DB = (-6.0, 0.0)  # of a line, to the median object
VELOCITY_STD_MPS = 0.03  # of the lines of a car
CLEAR_M, CLEAR_MPS = 1.0, 0.5  # around a car, where nothing else is
_TRIALS = 200


def with_cars(
    rng: np.random.Generator, radar: ChirpSequence, objects: Channel, count: int
) -> Channel:
    """Add cars to an object channel; ``groups`` says which lines are of which car.

    Parameters
    ----------
    rng : numpy.random.Generator
        Draws numbers of lines, extents, places, levels and phases.
    radar : ChirpSequence
        Cars lie in the near half of what it tells apart, and have any velocity that it tells apart.
    objects : Channel
        What else is there.
    count : int
        Number of cars.

    Raises
    ------
    InputError
        If there are too many.

    Examples
    --------
    >>> import numpy as np
    >>> from vsep.presets.registry import simulated_preset
    >>> radar = simulated_preset("simulation-2-a").radar
    >>> point = Channel(delays_s=np.array([1e-7]), dopplers_hz=np.zeros(1), weights=np.ones(1))
    >>> with_cars(np.random.default_rng(1), radar, point, 1).groups
    array([-1,  0,  0,  0,  0,  0])
    """
    require_range("num_cars", count, 0, MAX_CARS)
    level = float(np.median(abs(objects.weights)))
    for _ in range(count):
        num_lines = int(rng.integers(LINES[0], LINES[1] + 1))
        levels_db = rng.uniform(*LEVELS_DB, num_lines)
        extent_m = float(rng.uniform(*EXTENTS_M))
        objects = with_car(rng, radar, objects, level * 10.0 ** (levels_db / 20.0), extent_m)
    return objects


def with_car(
    rng: np.random.Generator,
    radar: ChirpSequence,
    objects: Channel,
    magnitudes: FloatArray,
    extent_m: float,
) -> Channel:
    """Add one car with lines of these magnitudes, one in each equal part of its extent.

    It lies where nothing else is within `CLEAR_M` and `CLEAR_MPS` of it, if there is such a place.
    """
    num_lines = len(magnitudes)
    metres = SPEED_OF_LIGHT_MPS / 2.0
    highest_m = metres * radar.sample_rate_hz / abs(radar.slope_hz_per_s) * (radar.lowest_beat + 1)
    fastest = float(abs(radar.velocity_from_doppler(np.array([0.45]))[0]))
    to_hz = radar.start_frequency_hz / metres
    others_m, others_mps = metres * objects.delays_s, objects.dopplers_hz / to_hz
    for _ in range(_TRIALS):
        range_m = rng.uniform(extent_m, max(0.5 * highest_m, extent_m))
        velocity_mps = rng.uniform(-fastest, fastest) if radar.num_ramps > 1 else 0.0
        near = abs(others_m - range_m) < 0.5 * extent_m + CLEAR_M
        if not np.any(near & (abs(others_mps - velocity_mps) < CLEAR_MPS)):
            break
    inside = (np.arange(num_lines) + rng.uniform(0.1, 0.9, num_lines)) / num_lines - 0.5
    spread = rng.normal(0.0, VELOCITY_STD_MPS, num_lines) if radar.num_ramps > 1 else 0.0
    phases = np.exp(2j * np.pi * rng.uniform(size=num_lines))
    groups = np.full(objects.num_paths, -1) if objects.groups is None else objects.groups
    return Channel(
        delays_s=np.concatenate([objects.delays_s, (range_m + extent_m * inside) / metres]),
        dopplers_hz=np.concatenate(
            [objects.dopplers_hz, to_hz * (velocity_mps + spread) * np.ones(num_lines)]
        ),
        weights=np.concatenate([objects.weights, magnitudes * phases]),
        groups=np.concatenate([groups, np.full(num_lines, groups.max(initial=-1) + 1)]),
    )
