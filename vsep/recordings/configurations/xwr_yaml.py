"""YAML of the Python package ``xwr``: a group ``radar`` of a chirp profile.

Frequencies in GHz, times in microseconds (the frame's period in milliseconds), the slope in MHz a
microsecond, the sample rate in thousands a second. ``frame_length`` counts loops; all transmitters
of the sensor take turns.
"""

import re
from collections.abc import Mapping
from typing import Any

from vsep.errors import InputError
from vsep.recordings.configurations.configuration import Configuration, Said, number
from vsep.recordings.configurations.ti_setup import Chirp, TiProfile, TiSetup
from vsep.recordings.settings import settings_values

_KEYS = ("frequency", "freq_slope", "adc_samples", "sample_rate")
_TRANSMITTERS = {"AWR1642": 2, "AWR1642Boost": 2, "AWR1843L": 2}
_USUAL = 3
_MOST = 16


def is_xwr(_name: str, text: str) -> bool:
    """Whether a text is such a configuration."""
    return all(re.search(rf"^\s*{key}\s*:", text, flags=re.MULTILINE) for key in _KEYS)


def read_xwr(name: str, text: str) -> Configuration:
    """Read such a configuration.

    Raises `InputError` if it lacks a value.
    """
    stored: Mapping[Any, Any] = settings_values(name, text)
    if isinstance(stored.get("radar"), Mapping):
        stored = stored["radar"]

    def of(key: str) -> float:
        if key not in stored:
            raise InputError(f"{name} holds no {key}, which the radar's group needs.")
        return number(name, stored[key], key)

    setup = TiSetup(name)
    setup.profiles[0] = TiProfile(
        number=0,
        start_frequency_ghz=of("frequency"),
        idle_us=of("idle_time"),
        adc_start_us=of("adc_start_time"),
        ramp_end_us=of("ramp_end_time"),
        slope_mhz_per_us=of("freq_slope"),
        num_samples=int(of("adc_samples")),
        sample_rate_ksps=of("sample_rate"),
        source="radar",
    ).in_si()
    device = str(stored.get("device", ""))
    count = int(number(name, stored.get("num_tx", _TRANSMITTERS.get(device, _USUAL)), "num_tx"))
    if not 1 <= count <= _MOST:
        raise InputError(f"{name}: num_tx is {count}; it must lie between 1 and {_MOST}.")
    setup.chirps = [Chirp(index, index, 0, 1 << index) for index in range(count)]
    setup.chirps_source = "num_tx" if "num_tx" in stored else "assumed of the device"
    setup.frame = 0, count - 1, int(of("frame_length"))
    setup.frame_source = "frame_length"
    setup.frame_period_s = number(name, stored.get("frame_period", 0), "frame_period") * 1e-3
    setup.receivers = Said(15, "all four, as xwr sets them")
    if device:
        setup.device = Said(device[:40], "device")
    return setup.configuration()
