"""Bytes of raw captures: files of another kind are refused, packet headers left out."""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from typing import BinaryIO, Final

import numpy as np
from numpy.typing import NDArray

from vsep._typing import BoolArray
from vsep.errors import InputError
from vsep.files.archive import MAX_SAMPLES
from vsep.files.opening import open_regular
from vsep.recordings.packets import CHECKED, LONGEST_PAYLOAD, Packets, header_bytes, without_headers
from vsep.recordings.ros_bags import is_bag, read_bag

_SIGNATURES: Final = (
    (b"\x93NUMPY", "a NumPy array", "say format: npy"),
    (b"PK\x03\x04", "a ZIP archive", "say format: npz if it is NumPy's, or unpack it"),
    (b"PK\x05\x06", "an empty ZIP archive", "a recording is needed"),
    (b"MATLAB 5.0 MAT-file", "a MATLAB file", "say format: mat"),
    (
        b"MATLAB 7.3 MAT-file",
        "a MATLAB file of version 7.3",
        "say format: mat",
    ),
    (
        b"\x89HDF\r\n\x1a\n",
        "an HDF5 file",
        "say format: hdf5",
    ),
    (b"\x1f\x8b", "a gzip archive", "unpack it"),
)
_START = max(CHECKED * (LONGEST_PAYLOAD + 14), 512)
_WORD = 2


class RawBytes:
    """An open raw capture; packets are put in order when it has their headers.

    Parameters
    ----------
    path : str
        What sentences call it.
    file : binary file or None
        The open file; None where `packets` are all there is.
    packets : Packets, optional
        Content that was read by other means.
    """

    def __init__(self, path: str, file: BinaryIO | None, packets: Packets | None = None) -> None:
        self._file = file
        self._packets = packets
        if file is None:
            self.num_bytes = 0 if packets is None else packets.content.size
            return
        self.num_bytes = os.fstat(file.fileno()).st_size
        start = file.read(_START)
        _refuse_other_kinds(path, start)
        shape = header_bytes(start)
        if shape is not None and self.num_bytes <= 4 * MAX_SAMPLES:
            file.seek(0)
            self._packets = without_headers(path, np.fromfile(file, dtype=np.uint8), shape)
            self.num_bytes = self._packets.content.size

    @property
    def remarks(self) -> tuple[str, ...]:
        """What was found out of the file."""
        return () if self._packets is None else (self._packets.remark,)

    def words(self, first_byte: int, count: int) -> tuple[NDArray[np.uint16], BoolArray | None]:
        """Return little-endian words from a byte on, and which of them were lost."""
        if self._packets is None:
            assert self._file is not None
            self._file.seek(first_byte)
            return np.fromfile(self._file, dtype="<u2", count=count), None
        inside = slice(first_byte, first_byte + _WORD * count)
        lost = self._packets.lost
        content = self._packets.content[inside]
        words = content[: content.size // _WORD * _WORD].view("<u2")
        if lost is None:
            return words, None
        return words, np.asarray(lost[inside].reshape(-1, _WORD).any(axis=1), dtype=np.bool_)


@contextmanager
def open_raw(path: str, topic: str | None = None) -> Iterator[RawBytes]:
    """Open a raw capture, also one in the messages of a ROS bag.

    Raises `InputError` if it cannot be read, or begins as a file of another kind does.
    """
    if is_bag(path):
        content, remark = read_bag(path, topic)
        yield RawBytes(path, None, Packets(content, None, remark))
        return
    with open_regular(path, path, "a recording") as file:
        yield RawBytes(path, file)


def _refuse_other_kinds(path: str, start: bytes) -> None:
    for signature, kind, advice in _SIGNATURES:
        if start.startswith(signature):
            raise InputError(f"{path} is no raw capture but {kind}; {advice}.")
