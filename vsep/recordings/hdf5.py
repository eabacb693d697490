"""Arrays of HDF5 files, MATLAB's of version 7.3 among them.

Sizes are judged before data are read; data sets in other files are refused. MATLAB stores arrays
with their axes turned round, and keeps structures as groups.
"""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from vsep._optional import require_library
from vsep.errors import InputError
from vsep.files.archive import EXPANSION, MAX_MEMBERS, MAX_SAMPLES, MIN_EXPANDED_BYTES
from vsep.files.opening import open_regular
from vsep.recordings.matlab import choose_array

HDF5_START: Final = 520
"""Bytes of a file that tell whether it is HDF5."""

_SIGNATURE = b"\x89HDF\r\n\x1a\n"
_MATLAB = b"MATLAB"
_UNREADABLE = (OSError, RuntimeError, KeyError, ValueError, TypeError, OverflowError)


def is_hdf5(start: bytes) -> bool:
    r"""Whether a file begins as one of HDF5 does, or as one of MATLAB that is HDF5.

    Examples
    --------
    >>> is_hdf5(bytes(512) + b"\x89HDF\r\n\x1a\n"), is_hdf5(b"MATLAB 5.0 MAT-file")
    (True, False)
    """
    return any(start[place : place + len(_SIGNATURE)] == _SIGNATURE for place in (0, 512))


def read_hdf5(path: str, key: str | None) -> NDArray[Any]:
    """Read an array by its name, ``group/name``, or ``radar.adc`` as MATLAB calls it.

    Raises `InputError` if h5py is missing, or whatever is wrong with the file.
    """
    with _opened(path) as (arrays, turned):
        by_name = {name.replace("/", "."): name for name in arrays}
        wanted = None if key is None else key.replace("/", ".")
        name = by_name[choose_array(path, wanted, tuple(by_name))]
        array = np.asarray(arrays[name][()])
        return array.T if turned else array


def hdf5_shapes(path: str) -> dict[str, tuple[int, ...]]:
    """Return the shapes of the arrays of numbers by their names, axes as they are read.

    Raises `InputError` as `read_hdf5` does.
    """
    with _opened(path) as (arrays, turned):
        return {
            name.replace("/", "."): data.shape[::-1] if turned else data.shape
            for name, data in arrays.items()
        }


@contextmanager
def _opened(path: str) -> Iterator[tuple[dict[str, Any], bool]]:
    """Open a file: its arrays of numbers, and whether their axes are turned round."""
    h5py = require_library("h5py", f"{path} is HDF5; it", "hdf5")
    with open_regular(path, path, "a recording") as file:
        turned = file.read(len(_MATLAB)) == _MATLAB
        most = max(EXPANSION * os.fstat(file.fileno()).st_size, MIN_EXPANDED_BYTES)
        file.seek(0)
        try:
            with h5py.File(file, "r") as content:
                found: dict[str, Any] = {}
                content.visititems(_collector(path, found, h5py.Dataset))
                for name, data in found.items():
                    _judge(path, name, data, most)
                yield found, turned
        except InputError:
            raise
        except _UNREADABLE as error:
            raise InputError(f"{path} is damaged or no HDF5 file; write it again.") from error


def _collector(path: str, found: dict[str, Any], kind: Any) -> Any:
    seen = 0

    def collect(name: str, each: Any) -> None:
        nonlocal seen
        seen += 1
        if seen > MAX_MEMBERS:
            raise InputError(
                f"{path} holds more than {MAX_MEMBERS} groups and arrays; a recording is needed."
            )
        # MATLAB's own bookkeeping is no variable.
        if isinstance(each, kind) and not name.startswith("#") and _holds_numbers(each):
            found[name] = each

    return collect


def _holds_numbers(data: Any) -> bool:
    fields = data.dtype.fields
    kinds = [data.dtype] if fields is None else [field[0] for field in fields.values()]
    return data.shape is not None and all(kind.kind in "iufc" for kind in kinds)


def _judge(path: str, name: str, data: Any, most: int) -> None:
    """Refuse what is too large, or lies in another file."""
    count = 1
    for length in data.shape:
        count *= int(length)
    if count > MAX_SAMPLES or count * data.dtype.itemsize > most:
        raise InputError(
            f"{path}: {name[:60]} holds {count} elements; at most {MAX_SAMPLES} are read, and "
            f"{EXPANSION} times the size of the file."
        )
    if data.external or data.is_virtual:
        raise InputError(f"{path}: {name[:60]} lies in other files; write it into one.")
