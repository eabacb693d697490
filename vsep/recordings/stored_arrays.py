"""Arrays of recordings; records of two numbers and two arrays (``key: I,Q``) are complex."""

from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from vsep.errors import InputError
from vsep.recordings.readers import READERS, RecordingReader
from vsep.recordings.settings import RecordingSettings

STREAM_AXES: Final = "frames,ramps,samples,antennas"


def read_stored_array(path: str, settings: RecordingSettings) -> NDArray[Any]:
    """Read the array of a recording, as it is stored; streams have `STREAM_AXES`.

    Raises `InputError` whatever is wrong with the file.
    """
    reader = READERS[settings.format]
    array = _stored(path, reader, settings.key)
    if array.dtype.names is not None:
        array = _paired(path, array)
    if array.dtype.kind not in "iufc":
        raise InputError(f"{path} holds an array of type {array.dtype}; numbers are needed.")
    return _cut(path, array, settings) if reader.is_stream else array


def _cut(path: str, stream: NDArray[Any], settings: RecordingSettings) -> NDArray[Any]:
    """Cut a stream (samples, channels) into frames with the axes `STREAM_AXES`."""
    length = settings.num_samples
    if length is None or settings.axes is not None:
        raise InputError(
            f"{path} is a stream of samples; num_samples must say where it is cut into ramps, and "
            "axes must not be given."
        )
    count = settings.num_ramps or len(stream) // length
    frames = len(stream) // (count * length) if count else 0
    if frames == 0:
        raise InputError(
            f"{path} holds {len(stream)} samples of a channel, which is no frame of "
            f"{max(count, 1)} ramps of {length}."
        )
    return stream[: frames * count * length].reshape(frames, count, length, -1)


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


def _stored(path: str, reader: RecordingReader, key: str | None) -> NDArray[Any]:
    if key is None or "," not in key:
        return reader.read(path, key)
    names = [name.strip() for name in key.split(",")]
    if len(names) != 2:
        raise InputError(f"key is {key[:60]!r}; one array or two, I and Q, are needed.")
    return _joined(path, *(reader.read(path, name) for name in names))
