"""A recorded frame of a 77 GHz sensor with simulated bursts.

The other radar hits every fourth ramp near its middle, and its crossing drifts through the ramp.
"""

import numpy as np

from vsep.presets.channels import direct_path
from vsep.presets.record import RecordedPreset
from vsep.signal.radar import ChirpSequence, InterfererSequence
from vsep.signal.scene import Interferer

EVERY = 4  # ramps
DRIFT = 0.3  # of a ramp, from the first one of the frame to the last
_RADAR = ChirpSequence(
    start_frequency_hz=77.4201e9,
    slope_hz_per_s=6e13,
    sample_rate_hz=2.5e6,
    ramp_period_s=184e-6,
    num_samples=128,
    num_ramps=128,
    lowest_beat=0.0,
)


def _sequence(slope_hz_per_s: float, shift_s: float = 0.0) -> InterfererSequence:
    difference = slope_hz_per_s - _RADAR.slope_hz_per_s
    ramp_s = _RADAR.num_samples / _RADAR.sample_rate_hz
    crossing_s = ramp_s / 2.0 + shift_s
    hits = -(-_RADAR.num_ramps // EVERY)
    drift_s = DRIFT * ramp_s * difference / slope_hz_per_s
    return InterfererSequence(
        start_frequency_hz=_RADAR.start_frequency_hz - difference * crossing_s,
        slope_hz_per_s=slope_hz_per_s,
        ramp_duration_s=ramp_s,
        ramp_period_s=EVERY * _RADAR.ramp_period_s + drift_s / hits,
        num_ramps=hits,
        time_offset_s=-drift_s / 2.0,
    )


def _interferer(seed: int, slope_hz_per_s: float, shift_s: float) -> Interferer:
    return Interferer(
        sequence=_sequence(slope_hz_per_s, shift_s),
        channel=direct_path(np.random.default_rng(seed)),
    )


PRESET = RecordedPreset(
    name="real-frame",
    label="Real frame with simulated interference",
    help="128 ramps of 128 samples of a person in a room, recorded; only the bursts are simulated.",
    radar=_RADAR,
    interferer=_sequence(59.9e12),
    frame_file="frames/openradar_doppler_example_1.npz",
    draw_interferer=_interferer,
    sir_db=-10.0,
    # A person is no point: one component after the other is found in a body that moves.
    max_iterations=12,
    slope_range_hz_per_s=(59.5e12, 60.5e12),
    cutoff_range_hz=(0.2e6, 1.25e6),
    shift_range_s=(-20e-6, 20e-6),
)
