"""Scenes of other radars that send more, or other things, than one equal chirp a ramp.

The victim is that of the moving car with shorter frames; every ramp is interfered.
"""

from dataclasses import replace

import numpy as np

from vsep.presets.channels import interference_paths
from vsep.presets.record import SimulatedPreset
from vsep.presets.simulation_2 import PRESETS as SIMULATION_2
from vsep.signal.dithering import parse_starts
from vsep.signal.radar import SPEED_OF_LIGHT_MPS, ChirpSequence, InterfererSequence
from vsep.signal.scene import Channel

NUM_RAMPS = 32
_RADAR = ChirpSequence(
    start_frequency_hz=77e9,
    slope_hz_per_s=1e13,
    sample_rate_hz=1e7,
    ramp_period_s=30e-6,
    num_samples=256,
    num_ramps=NUM_RAMPS,
)
_NEAREST_M, _FARTHEST_M, _FASTEST_MPS = 5.0, 33.0, 30.0
_USUAL = 12


def spread_objects(rng: np.random.Generator, count: int | None = None) -> Channel:
    """Objects over distance and velocity, of levels within 15 dB.

    Parameters
    ----------
    rng : numpy.random.Generator
        Draws delays, Dopplers, levels and phases, object by object: a scene of more objects begins
        with those of one with less.
    count : int, optional
        Number of objects, twelve by default.
    """
    low = np.array([_NEAREST_M, -_FASTEST_MPS, -15.0, 0.0])
    high = np.array([_FARTHEST_M, _FASTEST_MPS, 0.0, 1.0])
    metres, speeds, levels_db, turns = rng.uniform(low, high, (count or _USUAL, 4)).T
    return Channel(
        delays_s=2.0 * metres / SPEED_OF_LIGHT_MPS,
        dopplers_hz=2.0 * speeds / SPEED_OF_LIGHT_MPS * _RADAR.start_frequency_hz,
        weights=10.0 ** (levels_db / 20.0) * np.exp(2j * np.pi * turns),
    )


MANY_BURSTS = SimulatedPreset(
    name="many-bursts",
    label="Four radars: four bursts in every ramp",
    help="Twelve objects, 32 ramps of 256 samples, and four other radars that each cross every "
    "ramp.",
    radar=_RADAR,
    interferer=InterfererSequence(
        start_frequency_hz=77.022e9,
        slope_hz_per_s=8.25e12,
        ramp_duration_s=30.01e-6,
        ramp_period_s=30.01e-6,
        num_ramps=NUM_RAMPS,
    ),
    draw_objects=spread_objects,
    draw_paths=interference_paths,
    num_objects=_USUAL,
    num_interferers=4,
    snr_db=40.0,
    slope_range_hz_per_s=(8e12, 12e12),
    cutoff_range_hz=(0.8e6, 5e6),
    shift_range_s=(-12e-6, 12e-6),
)
HOPPING_CHIRPS = replace(
    MANY_BURSTS,
    name="hopping-chirps",
    label="Hopping chirps: bursts anywhere in the ramps",
    help="Twelve objects, 32 ramps of 256 samples, and another radar whose chirps begin at another "
    "frequency each time, so that bursts lie anywhere.",
    num_interferers=1,
    waveform="hopping-chirps",
)
PHASE_CODED = replace(
    SIMULATION_2[1],
    name="phase-coded",
    label="Phase code: interference that is no chirp",
    help="Ten objects, 16 ramps of 128 samples, and a PMCW radar in 4 of them: a binary phase "
    "code is noise for as long as the victim sweeps through its band.",
    waveform="phase-coded",
    family="",
    noise_scene="",
)
DITHERED = replace(
    MANY_BURSTS,
    name="dithered-ramps",
    label="Dithered ramps: starts at random times and frequencies",
    help="Twelve objects, and 32 ramps that start by up to 3 us earlier or later and up to 8 MHz "
    "higher or lower than equal ones, as the radar knows; another radar crosses every ramp.",
    radar=replace(
        _RADAR,
        start_times_s=parse_starts("start_times_s", "uniform 3e-6 1", NUM_RAMPS),
        start_frequencies_hz=parse_starts("start_frequencies_hz", "uniform 8e6 2", NUM_RAMPS),
    ),
    num_interferers=1,
)
DIVIDED = replace(
    MANY_BURSTS,
    name="doppler-division",
    label="Doppler division: two transmitters in every ramp",
    help="Twelve objects, 32 ramps of 256 samples and two transmitters with phase steps: every "
    "object is seen at two Doppler frequencies, a third of a cycle a ramp apart; another radar "
    "crosses every ramp.",
    num_interferers=1,
    doppler_division="2/3",
)
PRESETS = (MANY_BURSTS, HOPPING_CHIRPS, PHASE_CODED, DITHERED, DIVIDED)
