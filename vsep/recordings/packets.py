"""Captures that still hold the headers of their network packets.

A DCA1000 card sends packets of a 4-byte sequence number, a 6-byte count of the bytes sent before,
and up to 1456 bytes of samples. Texas Instruments' recorder keeps these headers in its ``_Raw_``
files with 4 bytes for the payload's length between (14 bytes in all); other recorders write what
they receive (10 bytes). Payloads go where their byte count says; what never came is missing.
"""

from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from vsep._typing import BoolArray
from vsep.errors import InputError
from vsep.files.archive import MAX_SAMPLES

PAYLOAD: Final = 1456  # bytes of a full packet
LONGEST_PAYLOAD: Final = 1472
CHECKED: Final = 8  # packets that must fit before a file counts as one of packets
_MAX_BYTES = 4 * MAX_SAMPLES


class Packets(NamedTuple):
    """Bytes of a capture without headers, and which of them never came."""

    content: NDArray[np.uint8]
    lost: BoolArray | None
    remark: str


def header_bytes(start: bytes) -> tuple[int, int] | None:
    """Recognise packets by their counters.

    Parameters
    ----------
    start : bytes
        Beginning of the file; a few packets are enough.

    Returns
    -------
    (int, int) or None
        Lengths of header and payload; None where the file is none of packets.
    """
    if len(start) < 14:
        return None
    length = int.from_bytes(start[4:8], "little")
    for header, payload in ((14, length), (10, PAYLOAD)):
        if not 0 < payload <= LONGEST_PAYLOAD or payload % 2:
            continue
        stride = header + payload
        numbers, places = [], []
        for first in range(0, min(len(start), CHECKED * stride) - header + 1, stride):
            length = int.from_bytes(start[first + 4 : first + 8], "little")
            if header == 14 and first + stride <= len(start) and length != payload:
                break
            numbers.append(int.from_bytes(start[first : first + 4], "little"))
            place = first + header - 6
            places.append(int.from_bytes(start[place : place + 6], "little"))
        else:
            if len(numbers) < 2:
                continue
            # Each count is that of the first packet, farther by whole payloads.
            steps = np.diff(numbers) * payload
            if np.array_equal(np.diff(places), steps) and np.all(steps != 0):
                return header, payload
    return None


def without_headers(path: str, content: NDArray[np.uint8], shape: tuple[int, int]) -> Packets:
    """Sort payloads by their byte counts and leave the headers out.

    Parameters
    ----------
    path : str
        What the sentences call the file.
    content : (B,) uint8
        The whole file.
    shape : (int, int)
        Lengths of header and payload, see `header_bytes`.

    Raises
    ------
    InputError
        If the counts reach farther than a file that is read may.
    """
    header, payload = shape
    stride = header + payload
    whole = content.size // stride
    packets = content[: whole * stride].reshape(whole, stride)
    places = _numbers(packets[:, header - 6 : header])
    rest = content[whole * stride :]
    last = int(places.max()) + payload
    first = int(places.min())
    if rest.size > header:
        place = int(_numbers(rest[None, header - 6 : header])[0])
        last = max(last, place + rest.size - header)
        first = min(first, place)
    if last - first > min(_MAX_BYTES, 64 * content.size):
        raise InputError(
            f"{path} holds packets whose byte counts reach from {first} to {last}; at most "
            f"{_MAX_BYTES} bytes between them are read."
        )
    sorted_bytes = np.zeros(last - first, dtype=np.uint8)
    lost = np.ones(last - first, dtype=np.bool_)
    into = (places - first)[:, None] + np.arange(payload)
    sorted_bytes[into] = packets[:, header:]
    lost[into] = False
    if rest.size > header:
        into = place - first + np.arange(rest.size - header)
        sorted_bytes[into] = rest[header:]
        lost[into] = False
    number = int(np.count_nonzero(lost)) // payload
    unsorted = int(np.count_nonzero(np.diff(places) < 0))
    remark = (
        f"{path} holds the {header}-byte headers of {whole + (rest.size > header)} packets, which "
        f"are left out; {unsorted} came out of turn and {number} are lost."
    )
    return Packets(sorted_bytes, lost if lost.any() else None, remark)


def _numbers(field: NDArray[np.uint8]) -> NDArray[np.int64]:
    """Read little-endian whole numbers, one a row."""
    powers = 256 ** np.arange(field.shape[1], dtype=np.int64)
    return np.asarray(field.astype(np.int64) @ powers)
