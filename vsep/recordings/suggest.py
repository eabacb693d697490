"""Suggested settings of a recording, from what its file says of itself."""

import json
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

from vsep.errors import InputError
from vsep.files.archive import Archive
from vsep.files.frame import SETTINGS_OF_RADAR
from vsep.files.opening import open_regular
from vsep.recordings.hdf5 import HDF5_START, hdf5_shapes, is_hdf5, read_hdf5
from vsep.recordings.matlab import matlab_shapes, read_matlab
from vsep.recordings.readers import READERS, format_of_name
from vsep.recordings.ros_bags import is_bag
from vsep.recordings.settings import MAX_FILE, NEEDED_SETTINGS, SETTING_NAMES

RAW_FORMAT: Final = "dca1000-xwr16xx"
"""Suggested for files that say nothing: the usual card and the most common sensors."""

_SIGNAL = "received"
_PARTS: Final = (("i", "q"), ("re", "im"), ("real", "imag"))
_BY_START: Final = (
    (b"\x93NUMPY", "npy"),
    (b"PK\x03\x04", "npz"),
    (b"MATLAB 5.0", "mat"),
    (b"MATLAB 7.3", "mat"),
    (b"\x89HDF\r\n\x1a\n", "hdf5"),
)


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
    elif kind in ("mat", "hdf5"):
        found |= _of_named(path, name)
    elif kind in READERS:
        found |= READERS[kind].settings(path)
    needs_length = kind not in READERS or READERS[kind].is_stream
    wanted = (*NEEDED_SETTINGS, "num_samples") if needs_length else NEEDED_SETTINGS
    return {key: found.get(key) for key in SETTING_NAMES if key in found or key in wanted}


def _kind(path: str, name: str) -> str:
    known = format_of_name(name)
    if known is not None:
        return known
    if is_bag(path):
        return RAW_FORMAT
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
        found["key"] = _largest(archive.sizes())
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


def _of_named(path: str, name: str) -> dict[str, Any]:
    """Return what the arrays of a file of MATLAB or HDF5 tell."""
    with open_regular(path, name, "a recording") as file:
        by_hdf5 = is_hdf5(file.read(HDF5_START))
        file.seek(0)
        shapes = hdf5_shapes(path) if by_hdf5 else matlab_shapes(file, name)
        sizes = {key: _count(shape) for key, shape in shapes.items()}
        found: dict[str, Any] = {}
        for key in SETTING_NAMES:
            if sizes.get(key) == 1:
                file.seek(0)
                array = read_hdf5(path, key) if by_hdf5 else read_matlab(file, name, key)
                found[key] = _plain(array)
    if len(sizes) > 1:
        found["key"] = _largest(sizes)
    return found


def _largest(sizes: Mapping[str, int]) -> str:
    """Return the key of the largest array, or of I and Q where they lie apart."""
    most = max(sizes.values())
    largest = [key for key in sizes if sizes[key] == most]
    parts = {re.split(r"\W", key)[-1].lower(): key for key in largest}
    for first, second in _PARTS:
        if first in parts and second in parts:
            return f"{parts[first]},{parts[second]}"
    return largest[0]


def _count(shape: tuple[int, ...]) -> int:
    count = 1
    for length in shape:
        count *= length
    return count
