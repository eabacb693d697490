"""The settings file of a recording: what the file of samples itself does not say.

JSON or YAML, one level of ``name: value``. Radar values are those of the chirp profile, as the
sensor sent it: ``num_ramps`` counts the ramps of all transmitters in a frame and
``ramp_period_s`` is the time from one to the next, whoever sends it.
"""

import difflib
import json
import math
from collections.abc import Mapping
from dataclasses import MISSING, dataclass, fields
from pathlib import Path
from typing import Any, Final

from vsep._optional import require_library
from vsep._validation import require_range
from vsep.errors import InputError
from vsep.files.opening import read_bounded
from vsep.recordings.readers import READERS
from vsep.signal.doppler_division import parse_doppler_division

RAW_FORMATS: Final = (
    "dca1000-xwr14xx",
    "dca1000-xwr16xx",
    "tda2",
    "tsw1400",
    "tsw1400-xwr16xx",
)
FORMATS: Final = (*READERS, *RAW_FORMATS)
SIGNS: Final = ("positive", "negative")
REAL: Final = "real"
COMPLEX_1X, COMPLEX_2X = "complex-1x", "complex-2x"
SAMPLE_KINDS: Final = ("complex", COMPLEX_1X, COMPLEX_2X, REAL)
OFFSETS: Final = ("automatic", "remove", "keep")
MIGRATIONS: Final = ("automatic", "modelled", "neglected")
ADC_BITS: Final = (12, 14, 16)
MAX_FILE = 65536  # bytes of a settings file
_MOST = 2**20
_MAX_DEPTH = 8  # of lists within lists
_MAX_BITS = 14_000  # of an integer; Python writes no longer ones than 4,300 digits
_RAMP_COUNTS = ("num_samples", "num_ramps")
_NUMBERS = (
    "start_frequency_hz",
    "slope_hz_per_s",
    "sample_rate_hz",
    "ramp_period_s",
    "adc_start_s",
    "lowest_beat",
    "antenna_spacing_wavelengths",
)
_LISTS = {"antennas": 1024, "start_times_s": 65536, "start_frequencies_hz": 65536}
_TEXTS = ("format", "sign", "samples", "offset", "range_migration", "key", "axes")


@dataclass(frozen=True, kw_only=True, slots=True)
class RecordingSettings:
    """What must be known to make a frame of a recording.

    Raises `InputError` if a value is outside of its range.
    """

    format: str  #: one of `FORMATS`
    start_frequency_hz: float  #: of the chirp profile, where the ramp starts
    slope_hz_per_s: float  #: of the ramps; may be negative
    sample_rate_hz: float  #: of the converter, samples per second of each antenna
    #: from the start of one ramp to the next one's, whichever transmitter sends it
    ramp_period_s: float
    #: samples of a ramp and ramps of a frame, those of all transmitters. A raw file needs the
    #: first; without the second the whole file is one frame.
    num_samples: int | None = None
    num_ramps: int | None = None
    num_antennas: int = 1  #: receive antennas of a raw file
    #: transmitters that take turns, ramp by ramp; each makes virtual antennas of its own
    num_transmitters: int = 1
    #: of transmitters that send in every ramp with phase steps, as ``2/3``: how many, and bands of
    #: Doppler frequency; see `vsep.signal.doppler_division`
    doppler_division: str | None = None
    #: of dithered ramps: by how much each starts later than the period says, and higher than the
    #: start frequency; a list, or ``uniform REACH SEED``, see `vsep.signal.dithering`
    start_times_s: str | None = None
    start_frequencies_hz: str | None = None
    sign: str = "positive"  #: of the beat frequency of a target in the file
    #: what the converter recorded: Complex 1x (beat frequencies from zero to the sample rate),
    #: Complex 2x (both signs) or real; of complex ones that say no more the samples tell
    samples: str = "complex"
    adc_bits: int = 16  #: 12, 14 or 16 bits of a raw word
    adc_start_s: float = 0.0  #: from the start of the ramp to its first sample
    #: samples to leave out at the start of every ramp: the receiver's settling transient
    crop_start_samples: int = 0
    #: see `ChirpSequence`; by default it follows from `samples`
    lowest_beat: float | None = None
    #: a constant offset is removed where the words are unsigned (automatic), always or never
    offset: str = "automatic"
    #: of objects within a frame; automatic: where one of the frame's objects walks visibly, see
    #: `vsep.recordings.migration`
    range_migration: str = "automatic"
    skip_bytes: int = 0  #: of a raw file, before its first frame
    #: receive antennas to keep, from 0 with commas between; all that are not dead by default
    antennas: str | None = None
    frame: int = 0  #: which frame of the file, from 0
    #: name of the array in a file that holds several, or of the topic in a ROS bag
    key: str | None = None
    #: names of the array's axes in their order, of ``frames, transmitters, antennas, ramps,
    #: samples, iq`` and ``iiqq`` (samples and iq in words I I Q Q); (ramps, samples) or
    #: (antennas, ramps, samples) by default
    axes: str | None = None
    #: between neighbours of a uniform line of (virtual) antennas
    antenna_spacing_wavelengths: float | None = None

    def __post_init__(self) -> None:
        """Check what `ChirpSequence` and `Frame` will not see."""
        for key, choices in (
            ("format", FORMATS),
            ("sign", SIGNS),
            ("samples", SAMPLE_KINDS),
            ("offset", OFFSETS),
            ("range_migration", MIGRATIONS),
            ("adc_bits", ADC_BITS),
        ):
            value = getattr(self, key)
            if value not in choices:
                listed = ", ".join(str(choice) for choice in choices)
                raise InputError(f"{key} is {str(value)[:40]!r}; it must be one of {listed}.")
        for key in _RAMP_COUNTS:
            if getattr(self, key) is not None:
                require_range(key, getattr(self, key), 1, _MOST)
        require_range("num_antennas", self.num_antennas, 1, 1024)
        require_range("num_transmitters", self.num_transmitters, 1, 64)
        if self.doppler_division is not None:
            parse_doppler_division(self.doppler_division)
        require_range("frame", self.frame, 0, _MOST)
        require_range("crop_start_samples", self.crop_start_samples, 0, _MOST)
        require_range("skip_bytes", self.skip_bytes, 0, 2**40)
        require_range("adc_start_s", self.adc_start_s, 0.0, 1.0, "s")
        # As `ChirpSequence` asks, but before anything is divided by them.
        require_range("sample_rate_hz", self.sample_rate_hz, 1e2, 1e12, "Hz")
        require_range("ramp_period_s", self.ramp_period_s, 1e-9, 1e2, "s")
        self.chosen_antennas()
        if self.format in RAW_FORMATS and self.num_samples is None:
            raise InputError(f"num_samples is not given; a file of format {self.format} needs it.")

    def chosen_antennas(self) -> tuple[int, ...] | None:
        """Return which receive antennas to keep; None for all that are not dead.

        Raises `InputError` unless they are different whole numbers with commas between.
        """
        if self.antennas is None:
            return None
        words = [word.strip() for word in self.antennas.split(",")]
        if not all(word.isascii() and word.isdigit() and len(word) < 6 for word in words) or len(
            set(map(int, words))
        ) != len(words):
            raise InputError(
                f"antennas is {self.antennas[:40]!r}; it must be different whole numbers from 0 "
                "with commas between, for example 0,2."
            )
        return tuple(int(word) for word in words)


SETTING_NAMES: Final = tuple(field.name for field in fields(RecordingSettings))
NEEDED_SETTINGS: Final = tuple(
    field.name for field in fields(RecordingSettings) if field.default is MISSING
)


def read_settings(path: str) -> RecordingSettings:
    """Read a settings file, JSON or YAML by its suffix.

    Raises `InputError` whatever is wrong with the file or a value.
    """
    stored = settings_values(path, _read_text(path))
    try:
        return parse_settings(stored)
    except InputError as error:
        raise InputError(f"{path}: {error}") from error


def settings_values(name: str, text: str) -> dict[Any, Any]:
    """Return the names and values of a settings file's text, not yet judged.

    Parameters
    ----------
    name : str
        Of the file; its suffix says whether it is JSON or YAML.
    text : str
        What it holds.

    Raises
    ------
    InputError
        In one sentence, if it holds no names and values.

    Examples
    --------
    >>> settings_values("radar.json", '{"format": "npy"}')
    {'format': 'npy'}
    """
    suffix = Path(name).suffix.lower()
    if suffix == ".json":
        stored = _from_json(name, text)
    elif suffix in (".yaml", ".yml"):
        stored = _from_yaml(name, text)
    else:
        raise InputError(f"{name} has the suffix {suffix!r}; it must be .json, .yaml or .yml.")
    if not isinstance(stored, dict):
        raise InputError(f"{name} holds no settings; lines of name: value are needed.")
    return stored


def parse_settings(stored: Mapping[Any, Any]) -> RecordingSettings:
    """Make settings of names and values as a file holds them.

    Raises `InputError` if a name is unknown or missing, or a value of another kind or outside of
    its range.

    Examples
    --------
    >>> parse_settings({"format": "npy", "start_frequency_hz": "77e9", "slope_hz_per_s": 3e13,
    ...                 "sample_rate_hz": 2e7, "ramp_period_s": 3e-5}).start_frequency_hz
    77000000000.0
    """
    for name in stored:
        if name not in SETTING_NAMES:
            close = difflib.get_close_matches(str(name), SETTING_NAMES, n=1)
            meant = close[0] if close else ", ".join(SETTING_NAMES)
            raise InputError(f"{str(name)[:40]!r} is no setting; did you mean {meant}?")
    missing = [name for name in NEEDED_SETTINGS if stored.get(name) is None]
    if missing:
        raise InputError(f"{missing[0]} is not given; needed are {', '.join(NEEDED_SETTINGS)}.")
    given = {name: value for name, value in stored.items() if value is not None}
    return RecordingSettings(**{name: _parsed(name, value) for name, value in given.items()})


def _parsed(name: str, value: Any) -> Any:
    if name in _LISTS:
        listed = value if isinstance(value, list) else [value]
        return ",".join(str(item) for item in listed[: _LISTS[name]])
    if name in _TEXTS:
        if not isinstance(value, str):
            raise InputError(f"{name} is {_shown(value)}; a text is needed.")
        return value
    number = _number(name, value)
    if name in _NUMBERS:
        return number
    if not number.is_integer():
        raise InputError(f"{name} is {number:g}; a whole number is needed.")
    return int(number)


def _number(name: str, value: Any) -> float:
    """Read a number; YAML takes 77e9, without a point and a sign, for a text."""
    try:
        number = float(value) if isinstance(value, int | float | str) else math.nan
    except (ValueError, OverflowError):
        number = math.nan
    if isinstance(value, bool) or not math.isfinite(number):
        raise InputError(f"{name} is {_shown(value)}; a finite number is needed.")
    return number


def _shown(value: Any) -> str:
    """Write a value of any size on one short line."""
    if isinstance(value, dict | list):
        return "a list" if isinstance(value, list) else "a group of settings"
    if isinstance(value, int) and value.bit_length() > _MAX_BITS:
        return "a number of thousands of digits"  # which Python does not write
    return str(value)[:40] if not isinstance(value, str) else repr(value[:40])


def _read_text(path: str) -> str:
    content = read_bounded(path, path, "a settings file", MAX_FILE)
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise InputError(f"{path} is no text in UTF-8; a settings file is needed.") from error


def _from_json(path: str, text: str) -> Any:
    try:
        return json.loads(text)
    except json.JSONDecodeError as error:
        raise InputError(f"{path} is no JSON: {error.msg} in line {error.lineno}.") from error
    except (RecursionError, ValueError) as error:
        raise InputError(f"{path} is no settings file; it must be plain name: value.") from error


def _require_plain(path: str, yaml: Any, text: str) -> None:
    """Refuse what takes far more time or memory than its length: aliases and deep nesting."""
    depth = 0
    for event in yaml.parse(text):
        if isinstance(event, yaml.AliasEvent):
            # A few lines of aliases of aliases stand for millions of values.
            raise InputError(f"{path} refers to parts of itself by *; write each value out.")
        depth += isinstance(event, yaml.CollectionStartEvent)
        depth -= isinstance(event, yaml.CollectionEndEvent)
        if depth > _MAX_DEPTH:
            raise InputError(f"{path} has groups within groups; it must be plain name: value.")


def _from_yaml(path: str, text: str) -> Any:
    yaml = require_library("yaml", f"{path} is YAML; it", "yaml")
    try:
        _require_plain(path, yaml, text)
        return yaml.safe_load(text)
    except InputError:
        raise
    except yaml.YAMLError as error:
        mark = getattr(error, "problem_mark", None)
        where = f" in line {mark.line + 1}" if mark is not None else ""
        raise InputError(f"{path} is no YAML: something is wrong{where}.") from error
    except (RecursionError, ValueError, OverflowError, TypeError) as error:
        raise InputError(f"{path} is no settings file; it must be plain name: value.") from error
