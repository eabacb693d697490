"""Sources of frames: files and folders in order, arrays of a pipe, the simulated street."""

from collections.abc import Iterable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from numpy.lib import format as npy

from vsep.errors import InputError
from vsep.files.frame import Frame
from vsep.presets.street import StreetFrame, street_frames
from vsep.presets.street_traffic import RADAR

_MOST_SAMPLES = 2**28  # of a frame in a pipe


def frame_files(names: Iterable[str]) -> tuple[str, ...]:
    """Frame files in order; a folder stands for its ``.npz`` files by name.

    Raises
    ------
    InputError
        If a folder holds none.

    Examples
    --------
    >>> frame_files(["b.npz", "a.npz"])
    ('b.npz', 'a.npz')
    """
    files: list[str] = []
    for name in names:
        if not Path(name).is_dir():
            files.append(name)
            continue
        inside = sorted(str(path) for path in Path(name).glob("*.npz"))
        if not inside:
            raise InputError(f"{name} holds no frame file; at least one *.npz is needed.")
        files += inside
    return tuple(files)


def piped_frames(stream: BinaryIO, like: Frame) -> Iterator[Frame]:
    """Yield the frames of a pipe: NumPy arrays one after another, as `numpy.save` writes them.

    Parameters
    ----------
    stream : binary file
        Read as frames are taken; its end is the end of the sequence.
    like : Frame
        Radar, filter and sign of all of them.

    Raises
    ------
    InputError
        If something else comes, or an array of another shape.

    Examples
    --------
    >>> import io
    >>> frame = next(street_sequence(seed=1, num_frames=1))
    >>> pipe = io.BytesIO()
    >>> np.save(pipe, frame.received)
    >>> [each.name for each in piped_frames(io.BytesIO(pipe.getvalue()), frame)]
    ['frame 0']
    """
    shape = like.received.shape if like.antennas is None else like.antennas.shape
    number = 0
    while (array := _next_array(stream, f"Frame {number} of the pipe")) is not None:
        if array.shape != shape or array.dtype.kind not in "fciu":
            raise InputError(
                f"Frame {number} of the pipe has shape {array.shape} and type {array.dtype}; it "
                f"must be {shape} numbers, as {like.name} is."
            )
        signal = array.astype(np.complex128)
        signal = signal if like.beat_sign == -1 else np.conj(signal)
        yield replace(
            like,
            received=signal if like.antennas is None else signal[like.antenna],
            antennas=None if like.antennas is None else signal,
            name=f"frame {number}",
            truth=None,
            antennas_truth=None,
            truth_mask=None,
        )
        number += 1


class _OnlyRead:
    """A stream of which NumPy only reads: a pipe cannot be sought in."""

    def __init__(self, stream: BinaryIO, begun: bytes) -> None:
        self._stream, self._begun = stream, begun

    def read(self, size: int) -> bytes:
        begun, self._begun = self._begun[:size], self._begun[size:]
        return begun + self._stream.read(size - len(begun))


def _next_array(stream: BinaryIO, what: str) -> "np.ndarray[Any, Any] | None":
    """Read one array; None at the end of the stream."""
    begun = stream.read(len(npy.MAGIC_PREFIX))
    if not begun:
        return None
    reader: Any = _OnlyRead(stream, begun)
    try:
        version = npy.read_magic(reader)
        read_header = npy.read_array_header_1_0 if version == (1, 0) else npy.read_array_header_2_0
        shape, fortran_order, dtype = read_header(reader)
        count = int(np.prod(shape, dtype=np.int64))
        if dtype.hasobject or not 0 < count <= _MOST_SAMPLES:
            raise InputError(
                f"{what} has {count} elements of type {dtype}; it must have 1 to {_MOST_SAMPLES}."
            )
        content = reader.read(count * dtype.itemsize)
        array = np.frombuffer(content, dtype, count)
    except InputError:
        raise
    except (ValueError, EOFError, OSError) as error:
        raise InputError(
            f"{what} cannot be read ({error}); NumPy arrays one after another are needed."
        ) from error
    return array.reshape(shape, order="F" if fortran_order else "C")


def street_sequence(*, seed: int, num_frames: int, **options: Any) -> Iterator[Frame]:
    """Yield the first frames of the simulated street, with their truth.

    Parameters
    ----------
    seed, num_frames, **options
        As for `vsep.presets.street.street_frames`.
    """
    for each in street_frames(seed=seed, num_frames=num_frames, **options):
        yield frame_of_street(each)


def frame_of_street(each: StreetFrame) -> Frame:
    """Return a frame of the street as its file holds it."""
    return Frame(
        received=each.observation.received,
        radar=RADAR,
        anti_aliasing_filter=each.assumed_filter,
        truth=each.observation.truth,
        name=f"street {each.number}",
    )
