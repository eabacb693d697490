"""Lines of a Texas Instruments ``.cfg`` file, as the demonstrations of the mmWave SDK take them.

``profileCfg id start_GHz idle_us adc_start_us ramp_end_us power phase slope_MHz_per_us tx_start_us
samples rate_ksps ...``, ``chirpCfg first last profile 0 0 0 0 transmitters``, ``frameCfg first last
loops frames period_ms ...``, ``channelCfg receivers transmitters ...``, ``adcCfg bits kind``,
``adcbufCfg [subframe] kind swap interleave ...``.
"""

import math
import re
from dataclasses import replace
from typing import Final

from vsep.errors import InputError
from vsep.recordings.configurations.configuration import Configuration, Said, number
from vsep.recordings.configurations.ti_setup import Chirp, TiProfile, TiSetup
from vsep.signal.radar import SPEED_OF_LIGHT_MPS

DIFFERENCE: Final = 0.05  # from which two derivations of a range cell contradict each other
_RESOLUTION = re.compile(r"%.*range resolution\s*\(m[^)]*\)\s*:\s*(\d*\.?\d+)", re.IGNORECASE)
_PLATFORM = re.compile(r"(?:platform|device)\s*[:=]\s*\w*?((?:xwr|awr|iwr)\w+)", re.IGNORECASE)
_LEAST = {"profileCfg": 11, "chirpCfg": 8, "frameCfg": 5, "channelCfg": 2, "adcCfg": 2}


def is_cfg(name: str, text: str) -> bool:
    """Whether a text is such a file."""
    return bool(re.search(r"^\s*profileCfg\s", text, flags=re.MULTILINE)) or name.endswith(".cfg")


def read_cfg(name: str, text: str) -> Configuration:
    """Read such a file.

    Raises `InputError` if a line lacks numbers, or there is no profile.
    """
    setup = TiSetup(name)
    claimed_m = None
    for place, line in enumerate(text.splitlines(), 1):
        if (found := _PLATFORM.search(line)) and line.lstrip().startswith("%"):
            setup.device = Said(found[1], f"line {place}")
        if found := _RESOLUTION.search(line):
            claimed_m = float(found[1])
        words = line.split("%", maxsplit=1)[0].split()
        if not words:
            continue
        command, source = words[0], f"{words[0]}, line {place}"
        if command == "advFrameCfg":
            setup.remarks.append(
                f"{source} makes frames of several parts, which are not read; say num_ramps and "
                "num_transmitters of the part that is wanted."
            )
        if len(words) - 1 < _LEAST.get(command, 0):
            raise InputError(
                f"{name}: {source} holds {len(words) - 1} numbers; at least {_LEAST[command]} are "
                "needed."
            )
        _take(setup, command, words[1:], source)
    configuration = setup.configuration()
    if claimed_m:
        values = configuration.values
        swept = abs(values["slope_hz_per_s"]) * values["num_samples"] / values["sample_rate_hz"]
        cell_m = SPEED_OF_LIGHT_MPS / (2.0 * swept) if swept else math.inf
        if not abs(cell_m / claimed_m - 1.0) <= DIFFERENCE:
            remark = (
                f"A comment of {name} says range cells of {claimed_m:g} m; slope, samples and "
                f"sample rate make {cell_m:.4g} m, which are used."
            )
            configuration = replace(configuration, remarks=(*configuration.remarks, remark))
    return configuration


def _take(setup: TiSetup, command: str, words: list[str], source: str) -> None:
    """Take what a line says; most say nothing of the samples."""
    if command not in (*_LEAST, "adcbufCfg", "lvdsStreamCfg"):
        return
    values = [number(setup.name, word, source) for word in words]
    if command == "profileCfg":
        setup.profiles[int(values[0])] = TiProfile(
            number=int(values[0]),
            start_frequency_ghz=values[1],
            idle_us=values[2],
            adc_start_us=values[3],
            ramp_end_us=values[4],
            slope_mhz_per_us=values[7],
            num_samples=int(values[9]),
            sample_rate_ksps=values[10],
            source=source,
        ).in_si()
    elif command == "chirpCfg":
        first, last, profile = (int(value) for value in values[:3])
        setup.chirps.append(Chirp(first, last, profile, int(values[7])))
        setup.chirps_source = "chirpCfg"
    elif command == "frameCfg":
        setup.frame = int(values[0]), int(values[1]), int(values[2])
        setup.frame_source, setup.frame_period_s = source, values[4] * 1e-3
    elif command == "channelCfg":
        setup.receivers = Said(int(values[0]), source)
    elif command == "adcCfg":
        setup.sample_kind = Said(int(values[1]), source)
    elif command == "adcbufCfg":
        _take_buffer(setup, values, source)
    elif len(values) > 1 and values[1]:
        setup.remarks.append(
            f"{source} adds headers to the stream; the capture then holds more than samples."
        )


def _take_buffer(setup: TiSetup, values: list[float], source: str) -> None:
    """Take the kind of samples where adcCfg is absent, and what order they are in."""
    first = 1 if len(values) > 4 else 0
    if len(values) < first + 3:
        return
    if values[first] == 1 and setup.sample_kind is None:
        setup.sample_kind = Said(0, source)
    if values[first + 1] == 0 and values[first] == 0:
        setup.remarks.append(
            f"{source} has SampleSwap 0, I before Q; if everything lies at negative distances, say "
            "sign: negative."
        )
    if values[first + 2] == 0:
        setup.remarks.append(
            f"{source} interleaves the receivers, which no format of a two-lane DCA1000 capture "
            "does; xWR12xx/14xx have format: dca1000-xwr14xx."
        )
