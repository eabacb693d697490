"""A car that drives through range cells within the frame, beside weak objects that stand still."""

import numpy as np

from vsep.parameters import MAX_OBJECTS
from vsep.presets.channels import interference_paths, many_objects
from vsep.presets.record import SimulatedPreset
from vsep.signal.radar import SPEED_OF_LIGHT_MPS, ChirpSequence, InterfererSequence
from vsep.signal.scene import Channel

CAR_M, CAR_MPS = 20.0, 15.0
OTHERS_DB = (-40.0, -30.0)  # levels of the others, to that of the car
_RADAR = ChirpSequence(
    start_frequency_hz=77e9,
    slope_hz_per_s=29.96e12,  # 767 MHz in a ramp
    sample_rate_hz=10e6,
    ramp_period_s=60e-6,
    num_samples=256,
    num_ramps=128,
    range_migration=True,
)


def car_and_others(rng: np.random.Generator, count: int | None = None) -> Channel:
    """Return the car, at 20 m and 15 m/s in mid-frame, and others that stand or hardly move.

    Parameters
    ----------
    rng : numpy.random.Generator
        Draws the others' delays, velocities up to 1.5 m/s, levels, and all phases.
    count : int, optional
        Number of objects with the car, one by default.
    """
    levels_db = rng.uniform(*OTHERS_DB, MAX_OBJECTS)
    velocities_mps = rng.uniform(-1.5, 1.5, MAX_OBJECTS)
    others = many_objects(rng, count or 1)
    level_db, speeds = levels_db[: others.num_paths], velocities_mps[: others.num_paths]
    level_db[0], speeds[0] = 0.0, CAR_MPS
    delays_s = others.delays_s.copy()
    delays_s[0] = 2.0 * CAR_M / SPEED_OF_LIGHT_MPS
    phases = others.weights / np.abs(others.weights)
    return Channel(
        delays_s=delays_s,
        dopplers_hz=2.0 * speeds / SPEED_OF_LIGHT_MPS * _RADAR.start_frequency_hz,
        weights=10.0 ** (level_db / 20.0) * phases,
    )


PRESET = SimulatedPreset(
    name="moving-car",
    label="Moving car: 0.6 range cells in the frame",
    help="A car at 20 m and 15 m/s, 128 ramps of 256 samples over 767 MHz: it moves by 0.6 range "
    "cells within the frame.",
    radar=_RADAR,
    interferer=InterfererSequence(
        start_frequency_hz=77.008e9,
        slope_hz_per_s=28.8e12,
        ramp_duration_s=25.6e-6,
        ramp_period_s=60.02e-6,
        num_ramps=128,
    ),
    draw_objects=car_and_others,
    draw_paths=interference_paths,
    num_objects=1,
    snr_db=62.0,
    slope_range_hz_per_s=(24e12, 36e12),
    cutoff_range_hz=(0.8e6, 5e6),
    shift_range_s=(-12e-6, 12e-6),
)
