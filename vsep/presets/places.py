"""Places of objects that somebody chose, in the place of those that a preset draws."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from vsep._validation import require_range
from vsep.errors import InputError, shown
from vsep.parameters import MAX_OBJECTS
from vsep.signal.radar import SPEED_OF_LIGHT_MPS, ChirpSequence
from vsep.signal.scene import Channel

MAX_LEVEL_DB = 120.0


class Place(NamedTuple):
    """Where an object is, and how strong."""

    range_m: float
    velocity_mps: float  #: Positive for a receding object.
    level_db: float  #: Of its weight; only ratios matter, the SNR sets all together.


def parse_places(text: str) -> tuple[Place, ...]:
    """Return the objects that a text names: range, velocity and level of each, then a semicolon.

    Raises `InputError` if it is no such text, or names too many.

    Examples
    --------
    >>> parse_places("12,1.5,-3; 20,0,0")[0]
    Place(range_m=12.0, velocity_mps=1.5, level_db=-3.0)
    """
    parts = [part.split(",") for part in text.split(";") if part.strip()]
    require_range("number of objects", len(parts), 0, MAX_OBJECTS)
    try:
        places = tuple(Place(*map(float, part)) for part in parts)
    except (TypeError, ValueError):
        raise InputError(
            f"The objects are {shown(text)}; each is a range in m, a velocity in m/s and a level "
            "in dB, as in 12,1.5,0; 20,0,-6."
        ) from None
    for place in places:
        require_range("level of an object", place.level_db, -MAX_LEVEL_DB, MAX_LEVEL_DB, "dB")
    return places


def places_text(places: Sequence[Place]) -> str:
    """Return objects as `parse_places` reads them, to a centimetre, cm/s and a tenth of a dB.

    Examples
    --------
    >>> places_text([Place(12.0, 1.5, -3.04)])
    '12,1.5,-3'
    """
    return ";".join(
        f"{round(each.range_m, 2) + 0.0:g},{round(each.velocity_mps, 2) + 0.0:g},"
        f"{round(each.level_db, 1) + 0.0:g}"
        for each in places
    )


def placed_objects(
    rng: np.random.Generator, radar: ChirpSequence, places: Sequence[Place]
) -> Channel:
    """Return the object channel of places, with phases at random.

    Raises `InputError` if a place lies outside of what the radar tells apart.
    """
    limit_hz = 0.5 / radar.ramp_period_s
    metres = SPEED_OF_LIGHT_MPS * radar.sample_rate_hz / (2.0 * abs(radar.slope_hz_per_s))
    lowest, highest = radar.lowest_beat * metres, (radar.lowest_beat + 1.0) * metres
    fastest = limit_hz * SPEED_OF_LIGHT_MPS / (2.0 * radar.start_frequency_hz)
    for place in places:
        require_range("range of an object", place.range_m, lowest, highest, "m")
        require_range("velocity of an object", place.velocity_mps, -fastest, fastest, "m/s")
    ranges, velocities, levels = np.array(places, dtype=np.float64).reshape(-1, 3).T
    phases = np.exp(2j * np.pi * rng.uniform(size=len(places)))
    return Channel(
        delays_s=2.0 * ranges / SPEED_OF_LIGHT_MPS,
        dopplers_hz=2.0 * velocities * radar.start_frequency_hz / SPEED_OF_LIGHT_MPS,
        weights=10.0 ** (levels / 20.0) * phases,
    )
