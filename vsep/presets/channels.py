"""Objects and interference paths of Table I, drawn at random; with more or fewer objects if wanted.

Objects are drawn ten at a time, so that a scene of more objects begins with those of one with less.
"""

from dataclasses import replace

import numpy as np

from vsep._typing import ComplexArray
from vsep._validation import require_range
from vsep.parameters import MAX_OBJECTS
from vsep.signal.radar import SPEED_OF_LIGHT_MPS, ChirpSequence
from vsep.signal.scene import Channel

SINGLE_DELAY_S = 80.06e-9
_NUM_PATHS = 10
_DELAY_RANGE_S = (3.97e-9, 127e-9)
_DOPPLER_RANGE_HZ = (-5e3, 5e3)


def single_path(rng: np.random.Generator, delay_s: float) -> Channel:
    """One path of unit weight and random phase."""
    return Channel(delays_s=np.array([delay_s]), dopplers_hz=np.zeros(1), weights=_phases(rng, 1))


def direct_path(rng: np.random.Generator) -> Channel:
    """Line of sight: one path without delay."""
    return single_path(rng, 0.0)


def one_object(rng: np.random.Generator, count: int | None = None) -> Channel:
    """Return the object of Simulation I, of level 0 dB; further ones are drawn as in Simulation II.

    Parameters
    ----------
    rng : numpy.random.Generator
        Draws phases, delays and levels.
    count : int, optional
        Number of objects, one by default. A single ramp shows no Doppler, so further ones stand
        still; their level is that of their distance, against the first one's.
    """
    first = single_path(rng, SINGLE_DELAY_S)
    if count is None or count == 1:
        return first
    others = many_objects(rng, count, already=1)
    own = (SINGLE_DELAY_S * SPEED_OF_LIGHT_MPS + 1.0) ** 2
    return Channel(
        delays_s=np.concatenate([first.delays_s, others.delays_s]),
        dopplers_hz=np.zeros(count),
        weights=np.concatenate([first.weights, own * others.weights]),
    )


def many_objects(
    rng: np.random.Generator, count: int | None = None, *, already: int = 0
) -> Channel:
    """Objects of Simulation II: level -40 log10(tau c_0 + 1) dB, give or take 3 dB.

    Parameters
    ----------
    rng : numpy.random.Generator
        Draws delays, Dopplers, levels and phases.
    count : int, optional
        Number of objects, ten by default.
    already : int
        So many of them are there already.

    Raises
    ------
    InputError
        If there are none or too many.
    """
    wanted = _NUM_PATHS if count is None else count
    require_range("num_objects", wanted, 1, MAX_OBJECTS)
    left = wanted - already
    batches = [_ten_objects(rng) for _ in range(-(-left // _NUM_PATHS))]
    return Channel(
        delays_s=np.concatenate([batch.delays_s for batch in batches])[:left],
        dopplers_hz=np.concatenate([batch.dopplers_hz for batch in batches])[:left],
        weights=np.concatenate([batch.weights for batch in batches])[:left],
    )


def with_first_delay(objects: Channel, radar: ChirpSequence, delay_s: float | None) -> Channel:
    """Move the first object to another delay, None leaves it.

    Raises `InputError` if the delay lies outside of the unambiguous interval.
    """
    if delay_s is None:
        return objects
    limit_s = 0.5 * radar.sample_rate_hz / abs(radar.slope_hz_per_s)
    require_range("object_delay_s", delay_s, -limit_s, limit_s, "s")
    return replace(objects, delays_s=np.concatenate([[delay_s], objects.delays_s[1:]]))


def interference_paths(rng: np.random.Generator) -> Channel:
    """Interference paths of Simulation II; the first is direct, with delay 0 and magnitude 1."""
    delays_s = rng.uniform(*_DELAY_RANGE_S, _NUM_PATHS)
    level_db = rng.uniform(-10.0, 0.0, _NUM_PATHS)
    delays_s[0] = level_db[0] = 0.0
    level_db -= 20.0 * np.log10(delays_s * SPEED_OF_LIGHT_MPS + 1.0)
    weights = 10.0 ** (level_db / 20.0) * _phases(rng, _NUM_PATHS)
    return Channel(delays_s=delays_s, dopplers_hz=np.zeros(_NUM_PATHS), weights=weights)


def _ten_objects(rng: np.random.Generator) -> Channel:
    delays_s = rng.uniform(*_DELAY_RANGE_S, _NUM_PATHS)
    dopplers_hz = rng.uniform(*_DOPPLER_RANGE_HZ, _NUM_PATHS)
    level_db = -40.0 * np.log10(delays_s * SPEED_OF_LIGHT_MPS + 1.0)
    level_db += rng.uniform(-3.0, 3.0, _NUM_PATHS)
    weights = 10.0 ** (level_db / 20.0) * _phases(rng, _NUM_PATHS)
    return Channel(delays_s=delays_s, dopplers_hz=dopplers_hz, weights=weights)


def _phases(rng: np.random.Generator, count: int) -> ComplexArray:
    return np.asarray(np.exp(1j * rng.uniform(0.0, 2.0 * np.pi, count)))
