"""Objects that brake or speed up within a frame of 12.8 ms."""

import numpy as np

from vsep.presets.channels import interference_paths, many_objects
from vsep.presets.record import SimulatedPreset
from vsep.signal.radar import ChirpSequence, InterfererSequence
from vsep.signal.scene import Channel


def five_objects(rng: np.random.Generator, count: int | None = None) -> Channel:
    """Objects of Simulation II, five by default."""
    return many_objects(rng, 5 if count is None else count)


PRESET = SimulatedPreset(
    name="braking",
    label="Braking objects: 0.8 Doppler cells in the frame",
    help="Five objects that gain or lose 10 m/s², as in emergency braking; 128 ramps of 100 us, so "
    "that their velocities change by 0.8 Doppler cells within the frame.",
    radar=ChirpSequence(
        start_frequency_hz=77e9,
        slope_hz_per_s=5.86e12,  # 150 MHz in a ramp
        sample_rate_hz=10e6,
        ramp_period_s=100e-6,
        num_samples=256,
        num_ramps=128,
    ),
    interferer=InterfererSequence(
        start_frequency_hz=77.008e9,
        slope_hz_per_s=4.7e12,
        ramp_duration_s=25.6e-6,
        ramp_period_s=100.02e-6,
        num_ramps=128,
    ),
    draw_objects=five_objects,
    draw_paths=interference_paths,
    num_objects=5,
    acceleration_mps2=10.0,
    snr_db=55.0,
    slope_range_hz_per_s=(3e12, 9e12),
    cutoff_range_hz=(0.8e6, 5e6),
    shift_range_s=(-12e-6, 12e-6),
)
