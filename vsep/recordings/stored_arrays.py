"""Arrays of recordings: NumPy's .npy and .npz, and MATLAB's .mat.

Sizes are judged before data are read; pickled objects, cells and structures are refused.
"""

import os
from typing import Any

from numpy.typing import NDArray

from vsep.errors import InputError
from vsep.files.archive import Archive, read_array
from vsep.files.opening import open_regular
from vsep.recordings.matlab import choose_array, read_matlab
from vsep.recordings.settings import RecordingSettings


def read_stored_array(path: str, settings: RecordingSettings) -> NDArray[Any]:
    """Read the array of a recording, as it is stored.

    Raises `InputError` whatever is wrong with the file.
    """
    array = _stored(path, settings.format, settings.key)
    if array.dtype.kind not in "iufc":
        raise InputError(f"{path} holds an array of type {array.dtype}; numbers are needed.")
    return array


def _stored(path: str, kind: str, key: str | None) -> NDArray[Any]:
    if kind == "npz":
        with Archive(path, path) as archive:
            return archive.array(choose_array(path, key, archive.names()))
    if kind == "npy" and key is not None:
        raise InputError(f"key is {key[:40]!r}; a .npy file holds one array without a name.")
    with open_regular(path, path, "a recording") as file:
        if kind == "mat":
            return read_matlab(file, path, key)
        return read_array(file, path, os.path.getsize(path))
