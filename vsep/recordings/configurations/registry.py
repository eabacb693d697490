"""Kinds of configurations that are read, and what follows from their numbers."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

from vsep.errors import InputError
from vsep.files.opening import read_bounded
from vsep.recordings.configurations.configuration import Configuration, Reader, Said
from vsep.recordings.configurations.json_files import (
    is_infineon_json,
    is_studio_json,
    read_infineon_json,
    read_studio_json,
)
from vsep.recordings.configurations.mmwave_studio import is_log, is_lua, read_log, read_lua
from vsep.recordings.configurations.ti_cfg import is_cfg, read_cfg
from vsep.recordings.configurations.xwr_yaml import is_xwr, read_xwr
from vsep.recordings.guess import Guess
from vsep.recordings.readers import format_of_name
from vsep.recordings.settings import (
    MAX_FILE,
    RAW_FORMATS,
    SETTING_NAMES,
    RecordingSettings,
    parse_settings,
    settings_values,
)
from vsep.recordings.suggest import suggest_settings

READERS: Final = (
    Reader("mmWave Studio's JSON", is_studio_json, read_studio_json),
    Reader("Infineon's config.json", is_infineon_json, read_infineon_json),
    Reader("a script of mmWave Studio", is_lua, read_lua),
    Reader("a log file of mmWave Studio", is_log, read_log),
    Reader("a configuration of xwr", is_xwr, read_xwr),
    Reader("a .cfg file of Texas Instruments", is_cfg, read_cfg),
)
SUFFIXES: Final = (".yaml", ".yml", ".json", ".cfg", ".lua", ".txt", ".log")
"""Names of files that are configurations or settings, not recordings."""

MAX_BYTES: Final = 8 * 2**20


def read_configuration(name: str, text: str) -> Configuration:
    """Read a configuration of any kind, or settings as vsep has them.

    Parameters
    ----------
    name : str
        Of the file.
    text : str
        What it holds.

    Raises
    ------
    InputError
        In one sentence, if it is none or damaged.

    Examples
    --------
    >>> line = "profileCfg 0 77 7 6 60 0 0 29.982 1 256 10000 0 0 30"
    >>> round(read_configuration("radar.cfg", line).values["ramp_period_s"], 9)
    6.7e-05
    """
    for reader in READERS:
        if reader.recognises(name, text):
            return reader.read(name, text)
    if len(text) > MAX_FILE:
        raise InputError(f"{name} is larger than {MAX_FILE} bytes; a settings file is needed.")
    return Configuration(
        {key: Said(value, name, is_own=True) for key, value in settings_values(name, text).items()}
    )


def configuration_values(name: str, text: str) -> dict[str, Any]:
    """Return the settings of a configuration of any kind by name, not yet judged.

    Raises `InputError` as `read_configuration` does.
    """
    return read_configuration(name, text).values


def read_configuration_file(path: str) -> Configuration:
    """Read the file of a configuration; raises `InputError` whatever is wrong with it."""
    content = read_bounded(path, path, "a settings file", MAX_BYTES)
    try:
        return read_configuration(path, content.decode("utf-8-sig"))
    except UnicodeDecodeError as error:
        raise InputError(f"{path} is no text in UTF-8; a settings file is needed.") from error


def for_recording(configuration: Configuration, recording: str) -> Configuration:
    """Return a configuration with the format of a recording of another kind, and its array.

    A configuration tells of the sensor; an array of NumPy or MATLAB holds samples in an order of
    its own, which its axes name. Of several arrays the largest one is taken.
    """
    kind = format_of_name(recording)
    settings = dict(configuration.settings)
    said = settings.get("format")
    name = Path(recording).name
    if kind is not None and said is not None and said.value in RAW_FORMATS:
        kept = {key: each for key, each in settings.items() if key not in _OF_RAW}
        settings = {"format": Said(kind, f"the name of {name}")} | kept
    if "key" not in settings and "format" in settings and settings["format"].value in _OF_ARRAYS:
        largest = suggest_settings(recording, recording).get("key")
        if largest is not None:
            settings["key"] = Said(largest, f"the largest array of {name}")
    return replace(configuration, settings=settings)


def told_by(suggested: Mapping[str, Any], recording: str) -> Configuration:
    """Return what a recording tells of itself as a configuration."""
    return Configuration(
        {
            name: Said(value, recording, is_own=True)
            for name, value in suggested.items()
            if value is not None
        }
    )


def completed(configuration: Configuration, guess: Guess) -> Configuration:
    """Return a configuration with what it leaves open of a raw capture's layout as guessed."""
    settings = dict(configuration.settings)
    for name, value in guess.settings.items():
        if name not in settings:
            settings[name] = Said(value, "guessed from the samples")
    return Configuration(settings, configuration.remarks)


_OF_RAW: Final = ("format", "num_antennas", "skip_bytes")
_OF_ARRAYS: Final = ("npz", "mat", "hdf5")


def settings_of(configuration: Configuration, recording: str, where: str) -> RecordingSettings:
    """Return the settings of a recording that a configuration says.

    Parameters
    ----------
    configuration : Configuration
        Of the sensor or by hand.
    recording : str
        Its path; the suffix tells the format where the configuration says that of a raw capture.
    where : str
        Names of the files that say it, for the sentence of an `InputError`.

    Raises
    ------
    InputError
        If something is missing or out of its range.
    """
    try:
        return parse_settings(for_recording(configuration, recording).values)
    except InputError as error:
        raise InputError(f"{where}: {error}") from error


def merged(configurations: Mapping[str, Configuration]) -> Configuration:
    """Return what several files say together; the last one that says a setting counts."""
    settings: dict[str, Said] = {}
    remarks: list[str] = []
    for path, each in configurations.items():
        several = len(configurations) > 1
        for name, said in each.settings.items():
            if said.value is not None:
                source = f"{said.source} of {path}" if several and said.source != path else None
                settings[name] = replace(said, source=source or said.source)
        remarks.extend(each.remarks)
    order: list[Any] = [name for name in SETTING_NAMES if name in settings]
    order += [name for name in settings if name not in SETTING_NAMES]
    return Configuration({name: settings[name] for name in order}, tuple(remarks))
