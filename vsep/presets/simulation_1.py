"""Simulation I of Table I: one object, one ramp."""

from vsep.presets.channels import SINGLE_DELAY_S, direct_path, one_object
from vsep.presets.record import SimulatedPreset
from vsep.signal.radar import ChirpSequence, InterfererSequence

PRESET = SimulatedPreset(
    name="simulation-1",
    label="Simulation I: one object, one ramp",
    help="One object at 12 m, one ramp of 256 samples, one burst.",
    radar=ChirpSequence(
        start_frequency_hz=79e9,
        slope_hz_per_s=1e13,
        sample_rate_hz=10.2e6,
        ramp_period_s=25e-6,
        num_samples=256,
        num_ramps=1,
    ),
    interferer=InterfererSequence(
        start_frequency_hz=79.01e9,
        slope_hz_per_s=9.2e12,
        ramp_duration_s=25e-6,
        ramp_period_s=25e-6,
        num_ramps=1,
    ),
    draw_objects=one_object,
    draw_paths=direct_path,
    num_objects=1,
    object_delay_s=SINGLE_DELAY_S,
    noise_scene="noise-1",
    snr_db=30.0,
    slope_range_hz_per_s=(8e12, 12e12),
    cutoff_range_hz=(0.8e6, 5e6),
    shift_range_s=(-12e-6, 12e-6),
)
