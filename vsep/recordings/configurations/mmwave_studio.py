"""Scripts (``.lua``) and log files of Texas Instruments' mmWave Studio.

Scripts call ``ar1.ProfileConfig(id, start_GHz, idle_us, adc_start_us, ramp_end_us, 3 powers, 3
phases, slope_MHz_per_us, tx_start_us, samples, rate_ksps, ...)``, ``ar1.ChirpConfig(first, last,
profile, 4 variations, tx0, tx1, tx2)``, ``ar1.FrameConfig(first, last, frames, loops, period_ms,
...)`` and ``ar1.ChanNAdcConfig(3 transmitters, 4 receivers, bits, kind, ...)``; those for cascades
end in ``_mult`` and begin with a device. Log files hold ``API:ProfileConfig,...`` in the units of
the interface: 10 ns, 3.6 GHz/2^26 (2.7 GHz/2^26 at 60 GHz) and 3.6 GHz/2^26 times 900/s per us.
"""

import re

from vsep.errors import InputError
from vsep.recordings.configurations.configuration import Configuration, Said, number
from vsep.recordings.configurations.ti_setup import Chirp, Profile, TiProfile, TiSetup

_CALL = re.compile(r"\bar1\.(\w+?)(_mult)?\s*\(([^()]*)\)")
_CONSTANT = re.compile(r"^\s*(?:local\s+)?([A-Za-z_]\w*)\s*=\s*([-+.\w]+)\s*$")
_LOGGED = re.compile(r"API:(\w+),([^\n]*)")
_LEAST = {"ProfileConfig": 15, "ChirpConfig": 10, "FrameConfig": 5, "ChanNAdcConfig": 9}
_LEAST_LOGGED = {
    "ProfileConfig": 11,
    "ChirpConfig": 8,
    "FrameConfig": 5,
    "ChannelConfig": 2,
    "AdcOutConfig": 2,
}
_UNIT_77_HZ, _UNIT_60_HZ = 3.6e9 / 2**26, 2.7e9 / 2**26
_TICK_S, _FRAME_TICK_S = 10e-9, 5e-9


def is_lua(_name: str, text: str) -> bool:
    """Whether a text is a script that sets a profile."""
    return "ar1.ProfileConfig" in text


def is_log(_name: str, text: str) -> bool:
    """Whether a text is a log file that holds a profile."""
    return "API:ProfileConfig," in text


def read_lua(name: str, text: str) -> Configuration:
    """Read a script; of calls that come again the last one counts.

    Raises `InputError` if a call lacks numbers.
    """
    setup = TiSetup(name)
    constants: dict[str, str] = {}
    lines = [line.split("--", maxsplit=1)[0] for line in text.splitlines()]
    for line in lines:
        if found := _CONSTANT.match(line):
            constants[found[1]] = found[2]
    for place, line in enumerate(lines, 1):
        for command, cascaded, inside in _CALL.findall(line):
            words = [word.strip().strip("\"'") for word in inside.split(",")]
            words = words[1:] if cascaded else words
            words = [constants.get(word, word) for word in words]
            if command == "SelectChipVersion" and words:
                setup.device = Said(words[0], f"line {place}")
            if command not in _LEAST:
                continue
            source = f"ar1.{command}, line {place}"
            _require(name, source, len(words), _LEAST[command])
            _take(setup, command, [number(name, word, source) for word in words], source)
    return setup.configuration()


def _take(setup: TiSetup, command: str, values: list[float], source: str) -> None:
    if command == "ProfileConfig":
        setup.profiles[int(values[0])] = TiProfile(
            number=int(values[0]),
            start_frequency_ghz=values[1],
            idle_us=values[2],
            adc_start_us=values[3],
            ramp_end_us=values[4],
            slope_mhz_per_us=values[11],
            num_samples=int(values[13]),
            sample_rate_ksps=values[14],
            source=source,
        ).in_si()
    elif command == "ChirpConfig":
        mask = sum(1 << number for number in range(3) if values[7 + number])
        setup.chirps.append(Chirp(int(values[0]), int(values[1]), int(values[2]), mask))
        setup.chirps_source = "ar1.ChirpConfig"
    elif command == "FrameConfig":
        setup.frame = int(values[0]), int(values[1]), int(values[3])
        setup.frame_source, setup.frame_period_s = source, values[4] * 1e-3
    else:
        mask = sum(1 << number for number in range(4) if values[3 + number])
        setup.receivers = Said(mask, source)
        setup.sample_kind = Said(int(values[8]), source)


def read_log(name: str, text: str) -> Configuration:
    """Read a log file; of lines that come again the last one counts.

    Raises `InputError` if a line lacks numbers.
    """
    setup = TiSetup(name)
    found: list[tuple[str, list[float], str]] = []
    for place, line in enumerate(text.splitlines(), 1):
        for command, inside in _LOGGED.findall(line):
            words = [word.strip() for word in inside.split(",") if word.strip()]
            if command.lower().startswith("select_chip") and words:
                setup.device = Said(words[0], f"line {place}")
            if command not in _LEAST_LOGGED:
                continue
            source = f"API:{command}, line {place}"
            _require(name, source, len(words), _LEAST_LOGGED[command])
            found.append((command, [number(name, word, source) for word in words], source))
    device = "" if setup.device is None else str(setup.device.value)
    unit_hz = _UNIT_60_HZ if re.search(r"6[48]\d\d|6xx", device) else _UNIT_77_HZ
    for command, values, source in found:
        _take_logged(setup, command, values, source, unit_hz)
    return setup.configuration()


def _take_logged(
    setup: TiSetup, command: str, values: list[float], source: str, unit_hz: float
) -> None:
    if command == "ProfileConfig":
        setup.profiles[int(values[0])] = Profile(
            number=int(values[0]),
            start_frequency_hz=values[1] * unit_hz,
            idle_s=values[2] * _TICK_S,
            adc_start_s=values[3] * _TICK_S,
            ramp_end_s=values[4] * _TICK_S,
            slope_hz_per_s=_signed(values[7]) * unit_hz * 900.0 * 1e6,
            num_samples=int(values[9]),
            sample_rate_hz=values[10] * 1e3,
            source=source,
        )
    elif command == "ChirpConfig":
        first, last, profile = (int(value) for value in values[:3])
        setup.chirps.append(Chirp(first, last, profile, int(values[7])))
        setup.chirps_source = "API:ChirpConfig"
    elif command == "FrameConfig":
        setup.frame = int(values[0]), int(values[1]), int(values[3])
        setup.frame_source, setup.frame_period_s = source, values[4] * _FRAME_TICK_S
    elif command == "ChannelConfig":
        setup.receivers = Said(int(values[1]), source)
    else:
        setup.sample_kind = Said(int(values[1]), source)


def _signed(word: float) -> float:
    """Return a 16-bit word with its sign, as logs may hold it without."""
    return word - 2**16 if word >= 2**15 else word


def _require(name: str, source: str, count: int, least: int) -> None:
    if count < least:
        raise InputError(f"{name}: {source} holds {count} values; at least {least} are needed.")
