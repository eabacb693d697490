"""A car of several lines among points, fine enough in range to resolve them."""

import numpy as np

from vsep.parameters import MAX_OBJECTS
from vsep.presets.channels import interference_paths
from vsep.presets.moving_car import PRESET as MOVING_CAR
from vsep.presets.record import SimulatedPreset
from vsep.signal.radar import SPEED_OF_LIGHT_MPS
from vsep.signal.scene import Channel

_RANGES_M, _FASTEST_MPS = (2.0, 24.0), 15.0
_LEVELS_DB = (-20.0, 0.0)


def scattered_points(rng: np.random.Generator, count: int | None = None) -> Channel:
    """Return points anywhere in distance, velocity and level.

    Parameters
    ----------
    rng : numpy.random.Generator
        Draws all of them; a scene of more has those of one with less.
    count : int, optional
        Number of points, twenty by default.
    """
    wanted = 20 if count is None else count
    ranges_m = rng.uniform(*_RANGES_M, MAX_OBJECTS)[:wanted]
    speeds_mps = rng.uniform(-_FASTEST_MPS, _FASTEST_MPS, MAX_OBJECTS)[:wanted]
    levels_db = rng.uniform(*_LEVELS_DB, MAX_OBJECTS)[:wanted]
    phases = np.exp(2j * np.pi * rng.uniform(size=MAX_OBJECTS))[:wanted]
    to_hz = 2.0 * MOVING_CAR.radar.start_frequency_hz / SPEED_OF_LIGHT_MPS
    return Channel(
        delays_s=2.0 * ranges_m / SPEED_OF_LIGHT_MPS,
        dopplers_hz=speeds_mps * to_hz,
        weights=10.0 ** (levels_db / 20.0) * phases,
    )


PRESET = SimulatedPreset(
    name="extended-car",
    label="Extended car: several lines among points",
    help="A car of three to eight lines over some metres among twenty points, 128 ramps of 256 "
    "samples over 767 MHz.",
    radar=MOVING_CAR.radar,
    interferer=MOVING_CAR.interferer,
    draw_objects=scattered_points,
    draw_paths=interference_paths,
    num_objects=20,
    num_cars=1,
    snr_db=40.0,
    slope_range_hz_per_s=MOVING_CAR.slope_range_hz_per_s,
    cutoff_range_hz=MOVING_CAR.cutoff_range_hz,
    shift_range_s=MOVING_CAR.shift_range_s,
)
