"""Arrays of recordings: NumPy's .npy and .npz, and MATLAB's .mat.

Sizes are judged before data are read, and pickled objects are refused. Records of two numbers and
two arrays (``key: I,Q``) make complex samples.
"""

import os
from typing import Any

import numpy as np
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
    if array.dtype.names is not None:
        array = _paired(path, array)
    if array.dtype.kind not in "iufc":
        raise InputError(f"{path} holds an array of type {array.dtype}; numbers are needed.")
    return array


def _paired(path: str, array: NDArray[Any]) -> NDArray[Any]:
    """Return complex samples of an array of pairs of numbers, I and Q."""
    names = array.dtype.names or ()
    if len(names) != 2:
        raise InputError(
            f"{path} holds an array of records of {len(names)} fields; two numbers, I and Q, are "
            "needed."
        )
    return _joined(path, array[names[0]], array[names[1]])


def _joined(path: str, first: NDArray[Any], second: NDArray[Any]) -> NDArray[Any]:
    """Return complex samples of I and Q apart."""
    if first.shape != second.shape or {first.dtype.kind, second.dtype.kind} - set("iuf"):
        raise InputError(
            f"{path}: I has shape {first.shape} and type {first.dtype}, Q {second.shape} and "
            f"{second.dtype}; real numbers of one shape are needed."
        )
    samples = np.empty(first.shape, dtype=np.complex128)
    samples.real, samples.imag = first, second
    return samples


def _stored(path: str, kind: str, key: str | None) -> NDArray[Any]:
    if key is not None and "," in key:
        names = [name.strip() for name in key.split(",")]
        if len(names) != 2:
            raise InputError(f"key is {key[:60]!r}; one array or two, I and Q, are needed.")
        return _joined(path, *(_stored(path, kind, name) for name in names))
    if kind == "npz":
        with Archive(path, path) as archive:
            return archive.array(choose_array(path, key, archive.names()))
    if kind == "npy" and key is not None:
        raise InputError(f"key is {key[:40]!r}; a .npy file holds one array without a name.")
    with open_regular(path, path, "a recording") as file:
        if kind == "mat":
            return read_matlab(file, path, key)
        return read_array(file, path, os.path.getsize(path))
