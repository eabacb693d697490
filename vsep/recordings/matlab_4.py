"""Matrices in MATLAB's .mat files of version 4.

A file is a row of matrices: five whole numbers of 4 bytes (kind, rows, columns, whether it is
complex, length of the name), the name, the real part and the imaginary part, column by column. The
kind is four decimal digits: order of the bytes, zero, type of the numbers, zero for a full matrix.
"""

import os
from typing import IO, Any, Final, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from vsep.files.archive import MAX_MEMBERS, MAX_SAMPLES

_HEADER = 20  # bytes
_TYPES: Final = ("f8", "f4", "i4", "i2", "u2", "u1")
_ORDERS: Final[tuple[tuple[Literal["little", "big"], str], ...]] = (("little", "<"), ("big", ">"))
_LONGEST_NAME = 256


class Matrix(NamedTuple):
    """A matrix of a file of version 4, and where its numbers are."""

    dtype: np.dtype[Any]
    shape: tuple[int, int]
    is_complex: bool
    place: int


def matrices_of_version_4(file: IO[bytes]) -> dict[str, Matrix] | None:
    """Return the full matrices of numbers in a file by name; None if it is no such file."""
    size = file.seek(0, os.SEEK_END)
    found: dict[str, Matrix] = {}
    place = 0
    while place < size:
        if len(found) >= MAX_MEMBERS:
            return None
        file.seek(place)
        header = _header(file.read(_HEADER))
        if header is None:
            return None
        dtype, rows, columns, is_complex, length = header
        name = file.read(length)
        num_bytes = rows * columns * dtype.itemsize * (1 + is_complex)
        first = place + _HEADER + length
        place = first + num_bytes
        if place > size or rows * columns > MAX_SAMPLES or name[-1:] != b"\0":
            return None
        text = name[:-1].decode("latin-1")
        found[text] = Matrix(dtype, (rows, columns), is_complex, first)
    return found or None


def read_matrix(file: IO[bytes], matrix: Matrix) -> NDArray[Any]:
    """Read the numbers of a matrix."""
    file.seek(matrix.place)
    count = matrix.shape[0] * matrix.shape[1]
    parts = [
        np.frombuffer(file.read(count * matrix.dtype.itemsize), dtype=matrix.dtype)
        for _ in range(1 + matrix.is_complex)
    ]
    values = parts[0] + 1j * parts[1] if matrix.is_complex else parts[0]
    return values.reshape(matrix.shape, order="F")


def _header(header: bytes) -> tuple[np.dtype[Any], int, int, bool, int] | None:
    """Read and judge the five numbers of a header."""
    if len(header) < _HEADER:
        return None
    for number, (order, letter) in enumerate(_ORDERS):
        kind, rows, columns, imaginary, length = (
            int.from_bytes(header[i : i + 4], order) for i in range(0, _HEADER, 4)
        )
        thousands, zero, precision, full = (kind // 10**i % 10 for i in (3, 2, 1, 0))
        if kind < 10_000 and (thousands, zero, full) == (number, 0, 0):
            usual = precision < len(_TYPES) and imaginary in (0, 1)
            if usual and 0 < length <= _LONGEST_NAME and max(rows, columns) < 2**31:
                dtype = np.dtype(letter + _TYPES[precision])
                return dtype, rows, columns, bool(imaginary), length
    return None
