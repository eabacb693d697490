"""Simulation II of Table I: ten objects, 16 ramps, and its three parameter sets."""

from dataclasses import replace

from vsep.presets.channels import interference_paths, many_objects
from vsep.presets.record import SimulatedPreset
from vsep.presets.simulation_1 import PRESET as SIMULATION_1
from vsep.signal.radar import InterfererSequence

# Carrier, slope and ramp period are those of Simulation I.
_RADAR = replace(SIMULATION_1.radar, sample_rate_hz=5.1e6, num_samples=128, num_ramps=16)


def _parameter_set(
    letter: str,
    bursts: str,
    start_frequency_hz: float,
    slope_hz_per_s: float,
    ramp_period_s: float,
    num_ramps: int,
) -> SimulatedPreset:
    return SimulatedPreset(
        name=f"simulation-2-{letter}",
        label=f"Simulation II {letter}: {bursts}",
        help=f"Ten objects, 16 ramps of 128 samples, {bursts}.",
        radar=_RADAR,
        interferer=InterfererSequence(
            start_frequency_hz=start_frequency_hz,
            slope_hz_per_s=slope_hz_per_s,
            ramp_duration_s=25.02e-6,
            ramp_period_s=ramp_period_s,
            num_ramps=num_ramps,
        ),
        draw_objects=many_objects,
        draw_paths=interference_paths,
        num_objects=10,
        family="simulation-2",
        noise_scene="noise-2",
        snr_db=60.0,
        slope_range_hz_per_s=(8e12, 12e12),
        cutoff_range_hz=(0.4e6, 2.5e6),
        shift_range_s=(-12e-6, 12e-6),
    )


PRESETS = (
    _parameter_set("a", "2 long bursts", 79.002e9, 9.8321e12, 75.01e-6, 2),
    _parameter_set("b", "4 bursts", 79.004e9, 9.7122e12, 50.01e-6, 4),
    _parameter_set("c", "8 short bursts", 79.008e9, 9.3925e12, 25.02e-6, 8),
)
