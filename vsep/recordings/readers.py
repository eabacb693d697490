"""Kinds of files with arrays of samples, open to other distributions.

Another distribution adds one by an entry point of the group ``vsep.readers``, a `RecordingReader`.
Raw captures are words in an order of their own, see `vsep.recordings.raw_words`.
"""

import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final

from numpy.typing import NDArray

from vsep._entry_points import load_entries
from vsep.errors import InputError
from vsep.files.archive import Archive, read_array
from vsep.files.opening import open_regular
from vsep.recordings.hdf5 import HDF5_START, is_hdf5, read_hdf5
from vsep.recordings.matlab import choose_array, read_matlab
from vsep.recordings.sigmf_files import DATA, META, read_sigmf, sigmf_settings

GROUP: Final = "vsep.readers"


def _nothing(_path: str) -> dict[str, Any]:
    return {}


@dataclass(frozen=True, kw_only=True, slots=True)
class RecordingReader:
    """A kind of file.

    Parameters
    ----------
    name : str
        As `format` calls it; that of the entry point where it comes from another distribution.
    label : str
        As forms print it.
    read : callable
        Returns the array of a path and of the setting `key`; raises `InputError` in one sentence
        if it cannot.
    suffixes : tuple of str
        Of its files, in small letters.
    settings : callable
        Returns of a path the settings that the file tells, by name.
    is_stream : bool
        Whether the array is (samples, channels), to be cut into ramps of `num_samples`.

    Examples
    --------
    >>> import numpy as np
    >>> reader = RecordingReader(name="zeros", label="Zeros", read=lambda path, key: np.zeros(4))
    >>> reader.read("any.file", None).shape
    (4,)
    """

    name: str
    label: str
    read: Callable[[str, str | None], NDArray[Any]]
    suffixes: tuple[str, ...] = ()
    settings: Callable[[str], Mapping[str, Any]] = _nothing
    is_stream: bool = False


def format_of_name(name: str) -> str | None:
    """Return the format that a file's suffix tells, if it does.

    Examples
    --------
    >>> format_of_name("adc.MAT"), format_of_name("adc_data.bin")
    ('mat', None)
    """
    suffix = Path(name).suffix.lower()
    return next((each.name for each in READERS.values() if suffix in each.suffixes), None)


def _read_npz(path: str, key: str | None) -> NDArray[Any]:
    with Archive(path, path) as archive:
        return archive.array(choose_array(path, key, archive.names()))


def _read_npy(path: str, key: str | None) -> NDArray[Any]:
    if key is not None:
        raise InputError(f"key is {key[:40]!r}; a .npy file holds one array without a name.")
    with open_regular(path, path, "a recording") as file:
        return read_array(file, path, os.path.getsize(path))


def _read_mat(path: str, key: str | None) -> NDArray[Any]:
    with open_regular(path, path, "a recording") as file:
        if not is_hdf5(file.read(HDF5_START)):
            file.seek(0)
            return read_matlab(file, path, key)
    return read_hdf5(path, key)


_OWN: Final = (
    RecordingReader(
        name="npz",
        label="NumPy archive, frame (.npz)",
        read=_read_npz,
        suffixes=(".npz",),
    ),
    RecordingReader(name="npy", label="NumPy array (.npy)", read=_read_npy, suffixes=(".npy",)),
    RecordingReader(name="mat", label="MATLAB (.mat)", read=_read_mat, suffixes=(".mat",)),
    RecordingReader(
        name="hdf5",
        label="HDF5 (.h5)",
        read=read_hdf5,
        suffixes=(".h5", ".hdf5", ".hdf"),
    ),
    RecordingReader(
        name="sigmf",
        label="SigMF (.sigmf-meta)",
        read=read_sigmf,
        suffixes=(META, DATA),
        settings=sigmf_settings,
        is_stream=True,
    ),
)
READERS: Final[dict[str, RecordingReader]] = {
    **{each.name: each for each in _OWN},
    **{
        name: replace(each, name=name)
        for name, each in load_entries(GROUP).items()
        if isinstance(each, RecordingReader) and name not in {own.name for own in _OWN}
    },
}
