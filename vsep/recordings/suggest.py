"""Suggested settings of a recording, from what its file says of itself."""

import json
from pathlib import Path
from typing import Any, Final

from vsep.errors import InputError
from vsep.files.archive import Archive
from vsep.files.frame import SETTINGS_OF_RADAR
from vsep.files.opening import open_regular
from vsep.recordings.matlab import matlab_shapes, read_matlab
from vsep.recordings.settings import MAX_FILE, NEEDED_SETTINGS, SETTING_NAMES

RAW_FORMAT: Final = "dca1000-xwr16xx"
"""Suggested for files that say nothing: the usual card and the most common sensors."""

_SIGNAL = "received"
_BY_START: Final = ((b"\x93NUMPY", "npy"), (b"PK\x03\x04", "npz"), (b"MATLAB 5.0", "mat"))
_BY_SUFFIX: Final = {".npz": "npz", ".npy": "npy", ".mat": "mat"}


def suggest_settings(path: str, name: str) -> dict[str, Any]:
    """Return settings as far as a file tells them.

    Its kind is told by its suffix, or by its first bytes where that is unknown. A frame file tells
    all; of other archives the largest array is taken for the recording, and scalars that are called
    as a setting for its value, also numbers inside of a text in JSON.

    Parameters
    ----------
    path : str
        The file.
    name : str
        What the sentences of an `InputError` call it; its suffix counts.

    Returns
    -------
    dict
        Names in the order of `RecordingSettings`; None for what is needed and not known.

    Raises
    ------
    InputError
        In one sentence, if the file is not what its suffix says.
    """
    kind = _kind(path, name)
    found: dict[str, Any] = {"format": kind}
    if kind == "npz":
        with Archive(path, name) as archive:
            found |= _of_frame(archive) if is_frame(archive) else _of_archive(archive)
    elif kind == "mat":
        found |= _of_matlab(path, name)
    wanted = NEEDED_SETTINGS if kind in _BY_SUFFIX.values() else (*NEEDED_SETTINGS, "num_samples")
    return {key: found.get(key) for key in SETTING_NAMES if key in found or key in wanted}


def _kind(path: str, name: str) -> str:
    known = _BY_SUFFIX.get(Path(name).suffix.lower())
    if known is not None:
        return known
    with open_regular(path, name, "a recording") as file:
        start = file.read(16)
    return next((kind for first, kind in _BY_START if start.startswith(first)), RAW_FORMAT)


def is_frame(archive: Archive) -> bool:
    """Whether an archive is a frame file."""
    return all(key in archive for key in (_SIGNAL, *SETTINGS_OF_RADAR))


def is_frame_file(path: str, name: str) -> bool:
    """Whether a file is a frame file; also False for what is no archive at all."""
    if Path(name).suffix.lower() != ".npz":
        return False
    with Archive(path, name) as archive:
        return is_frame(archive)


def _of_frame(archive: Archive) -> dict[str, Any]:
    found: dict[str, Any] = {key: archive.number(key) for key in SETTINGS_OF_RADAR}
    rising = archive.number("beat_sign", -1.0) > 0.0
    found |= {"key": _SIGNAL, "sign": "positive" if rising else "negative"}
    for key in ("lowest_beat", "antenna_spacing_wavelengths"):
        if key in archive:
            found[key] = archive.number(key)
    modelled = archive.whole_number("range_migration", 0) != 0
    return found | {"range_migration": "modelled" if modelled else "neglected"}


def _of_archive(archive: Archive) -> dict[str, Any]:
    names = archive.names()
    found: dict[str, Any] = {}
    for key in names:
        found |= _told(archive, key)
    if len(names) > 1:
        found["key"] = archive.largest()
    return found


def _told(archive: Archive, key: str) -> dict[str, Any]:
    """Return the settings that one array of an archive tells; most tell none."""
    try:
        if key in SETTING_NAMES:
            return {key: _plain(archive.array(key, max_elements=1))}
        return _of_json(archive.text(key))
    except InputError:
        return {}


def _plain(array: Any) -> Any:
    """Return the number or text of an array of one element."""
    return array.reshape(()).item()


def _of_json(text: str) -> dict[str, Any]:
    try:
        stored = json.loads(text[:MAX_FILE])
    except (ValueError, RecursionError):
        return {}
    if not isinstance(stored, dict):
        return {}
    # A text such as "axes" may be called so and mean something else.
    return {
        key: stored[key]
        for key in SETTING_NAMES
        if isinstance(stored.get(key), int | float) and not isinstance(stored[key], bool)
    }


def _of_matlab(path: str, name: str) -> dict[str, Any]:
    with open_regular(path, name, "a recording") as file:
        shapes = matlab_shapes(file, name)
        sizes = {key: _count(shape) for key, shape in shapes.items()}
        found: dict[str, Any] = {}
        for key in SETTING_NAMES:
            if sizes.get(key) == 1:
                file.seek(0)
                found[key] = _plain(read_matlab(file, name, key))
    if len(sizes) > 1:
        found["key"] = max(sizes, key=lambda key: sizes[key])
    return found


def _count(shape: tuple[int, ...]) -> int:
    count = 1
    for length in shape:
        count *= length
    return count
