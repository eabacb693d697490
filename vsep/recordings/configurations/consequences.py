"""Consequences of a radar's numbers: bandwidth, range, velocity, and what contradicts."""

from collections.abc import Iterator
from typing import Final

from vsep.recordings.configurations.configuration import Configuration
from vsep.recordings.settings import REAL, RecordingSettings
from vsep.signal.radar import SPEED_OF_LIGHT_MPS, ChirpSequence

_UNITS: Final = {
    "start_frequency_hz": (1e-9, "GHz"),
    "slope_hz_per_s": (1e-12, "MHz/us"),
    "sample_rate_hz": (1e-6, "MHz"),
    "ramp_period_s": (1e6, "us"),
    "adc_start_s": (1e6, "us"),
}


def lines_of(configuration: Configuration) -> Iterator[str]:
    """Yield a line for every setting that a sensor's tool wrote: value, and where it came from."""
    for name, said in configuration.settings.items():
        if said.is_own:
            continue
        factor, unit = _UNITS.get(name, (0.0, ""))
        try:
            shown = f"{float(said.value) * factor:.7g} {unit}" if unit else f"{said.value}"
        except (TypeError, ValueError):
            shown = f"{said.value}"
        yield f"{name}: {shown[:60]}  ({said.source})"


def consequences(radar: ChirpSequence, settings: RecordingSettings) -> Iterator[str]:
    """Yield what follows for a frame: a line each.

    Parameters
    ----------
    radar : ChirpSequence
        That of the frame.
    settings : RecordingSettings
        What it was made with.
    """
    light = SPEED_OF_LIGHT_MPS
    slope = abs(radar.slope_hz_per_s)
    sampled_s = radar.num_samples / radar.sample_rate_hz
    swept_hz = slope * sampled_s
    yield (
        f"bandwidth: {swept_hz / 1e6:.4g} MHz swept in {radar.num_samples} samples "
        f"({sampled_s * 1e6:.4g} us) of {slope / 1e12:.4g} MHz/us"
    )
    cell_m = light / (2.0 * swept_hz)
    reach_m = radar.sample_rate_hz / slope * light / 2.0
    shown = reach_m / 2.0 if radar.lowest_beat == -0.5 else reach_m
    kind = "real samples" if settings.samples == REAL else _kind(radar)
    yield f"range: cells of {cell_m:.4g} m, up to {shown:.4g} m ({kind})"
    centre_hz = radar.start_frequency_hz + radar.slope_hz_per_s * sampled_s / 2.0
    most = light / (4.0 * radar.start_frequency_hz * radar.ramp_period_s)
    yield (
        f"velocity: up to {most:.4g} m/s, cells of {2.0 * most / radar.num_ramps:.4g} m/s "
        f"({radar.num_ramps} ramps every {radar.ramp_period_s * 1e6:.5g} us"
        + (
            f", {settings.num_transmitters} transmitters taking turns)"
            if settings.num_transmitters > 1
            else ")"
        )
    )
    at_centre = light / (4.0 * centre_hz * radar.ramp_period_s)
    if abs(at_centre / most - 1.0) > 0.01:
        yield (
            f"velocity: {at_centre:.4g} m/s by the centre frequency, {most:.4g} m/s by that of the "
            "first sample, which is used"
        )
    yield (
        f"range migration: an object moves one range cell in a frame at "
        f"{radar.one_cell_mps:.4g} m/s; " + ("modelled" if radar.motion.coupling else "neglected")
    )


def _kind(radar: ChirpSequence) -> str:
    return "both signs of the beat frequency" if radar.lowest_beat == -0.5 else "Complex 1x"
