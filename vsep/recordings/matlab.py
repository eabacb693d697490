"""Arrays of numbers in MATLAB's .mat files of version 4 to 7.

SciPy's reader trusts the lengths in a file and can end the process on a damaged one; arrays of
numbers are a small part of the format, and here every length is checked against what is there.
A file is a header of 128 bytes and elements (type, length, data); a matrix, which may be compressed
on its own, is an element whose data are elements: flags, lengths, name, real part, imaginary part.
Arrays inside of structures and cells are matrices without a name; they are called as MATLAB calls
them, ``radar.adc``, ``radar(2).adc`` and ``frames{3}``.
"""

import itertools
import math
import os
import zlib
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import IO, Any, Final, Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from vsep.errors import InputError
from vsep.files.archive import EXPANSION, MAX_MEMBERS, MAX_SAMPLES, MIN_EXPANDED_BYTES
from vsep.recordings.matlab_4 import matrices_of_version_4, read_matrix

_Order: TypeAlias = Literal["little", "big"]
_HEADER = 128  # bytes
_ORDERS: Final[dict[bytes, _Order]] = {b"IM": "little", b"MI": "big"}
_INT32, _MATRIX, _COMPRESSED = 5, 14, 15
_STORED: Final = {
    **dict(enumerate(("i1", "u1", "i2", "u2", "i4", "u4", "f4"), 1)),
    **{9: "f8", 12: "i8", 13: "u8"},
}
_STRUCT = 2
_NESTED: Final = ("cell", "struct")
_DEEPEST = 8  # structures in structures
_LONGEST_FIELD = 256  # bytes of the name of a field
_CLASSES: Final = {1: "cell", 2: "struct", 3: "object", 4: "char", 5: "sparse"}
_NUMBERS: Final = dict(enumerate(("f8", "f4", "i1", "u1", "i2", "u2", "i4", "u4", "i8", "u8"), 6))
_COMPLEX, _LOGICAL = 0x08, 0x02  # flags
_BEGINNING = 65536  # bytes, in which flags, lengths and name must lie
_MAX_BYTES = 16 * MAX_SAMPLES + _BEGINNING
_AGAIN = "save it again in MATLAB with save(name, variable, '-v7')"


class _DamageError(Exception):
    """A length or type that cannot be."""


class _TooManyError(Exception):
    """More elements than are looked at."""


@dataclass(frozen=True, slots=True)
class _Variable:
    name: str
    class_number: int
    flags: int
    shape: tuple[int, ...]
    place: int  # of the real part, in the matrix
    order: _Order
    element: tuple[int, int, int]  # type, first byte and length in the file
    inside: tuple[int, int | None] = (
        0,
        None,
    )  # part of the element's data, for a matrix of a structure or cell


def read_matlab(file: IO[bytes], path: str, key: str | None) -> NDArray[Any]:
    """Read one array.

    Parameters
    ----------
    file : binary file
        The open file.
    path : str
        What the sentences of an `InputError` call it.
    key : str or None
        Name of the array; None where there is only one.

    Raises
    ------
    InputError
        In one sentence, whatever is wrong with the file.
    """
    if (matrices := matrices_of_version_4(file)) is not None:
        return read_matrix(file, matrices[choose_array(path, key, tuple(matrices))])
    file.seek(0)
    variables = _found(file, path)
    variable = variables[choose_array(path, key, tuple(variables))]
    _judge(path, variable)
    try:
        return _values(file, variable)
    except (_DamageError, zlib.error, OSError) as error:
        raise _damaged(path) from error


def matlab_shapes(file: IO[bytes], path: str) -> dict[str, tuple[int, ...]]:
    """Return the names of a file's variables with their lengths, which nobody has judged.

    Raises `InputError` if it is no such file.
    """
    if (matrices := matrices_of_version_4(file)) is not None:
        return {name: each.shape for name, each in matrices.items()}
    file.seek(0)
    return {name: each.shape for name, each in _found(file, path).items()}


def _found(file: IO[bytes], path: str) -> dict[str, _Variable]:
    """Return all variables by their names."""
    start = file.read(_HEADER)
    order = _ORDERS.get(start[_HEADER - 2 : _HEADER])
    if order is None:
        raise InputError(f"{path} is no MATLAB file of version 4 to 7; {_AGAIN}.")
    try:
        return {each.name: each for each in _variables(file, order)}
    except _TooManyError:
        raise InputError(
            f"{path} holds more than {MAX_MEMBERS} variables; save the recording alone."
        ) from None
    except (_DamageError, zlib.error, OSError) as error:
        raise _damaged(path) from error


def _damaged(path: str) -> InputError:
    return InputError(f"{path} is damaged or cut off; {_AGAIN}.")


def choose_array(path: str, key: str | None, names: tuple[str, ...]) -> str:
    """Return the name of the array to read, of those that a file holds.

    Raises `InputError` if the key is not among them, or needed and not given.
    """
    listed = ", ".join(name[:40] for name in names[:8]) + (" ..." if len(names) > 8 else "")
    if not names:
        raise InputError(f"{path} holds no array; a recording is needed.")
    if key is None and len(names) > 1:
        raise InputError(f"{path} holds the arrays {listed}; name one of them by key.")
    if key is not None and key not in names:
        raise InputError(f"{path} holds no array {key[:40]!r}; it holds {listed}.")
    return names[0] if key is None else key


def _variables(file: IO[bytes], order: _Order) -> Iterator[_Variable]:
    """Yield what the elements of a file say of themselves; others than matrices have no name."""
    size = file.seek(0, os.SEEK_END)
    place = _HEADER
    for number in itertools.count(1):
        if place >= size:
            return
        if number > MAX_MEMBERS:
            raise _TooManyError
        file.seek(place)
        tag = file.read(8)
        kind, length = (int.from_bytes(tag[i : i + 4], order) for i in (0, 4))
        if len(tag) < 8 or place + 8 + length > size:
            raise _DamageError
        element = kind, place + 8, length
        if kind in (_MATRIX, _COMPRESSED):
            content = _content(file, element, order, _BEGINNING)
            if (variable := _described(content, element, order)) is not None:
                yield from _arrays(file, variable)
        place += 8 + length


def _content(file: IO[bytes], element: tuple[int, int, int], order: _Order, most: int) -> bytes:
    """Return the data of a matrix, expanded if need be, up to a number of bytes."""
    kind, place, length = element
    file.seek(place)
    if kind == _MATRIX:
        return file.read(min(length, most))
    expanded = zlib.decompressobj().decompress(file.read(length), most + 8)
    if len(expanded) < 8 or int.from_bytes(expanded[:4], order) != _MATRIX:
        raise _DamageError
    return expanded[8 : 8 + int.from_bytes(expanded[4:8], order)]


def _described(content: bytes, element: tuple[int, int, int], order: _Order) -> _Variable | None:
    """Describe a variable; None for what MATLAB keeps there for itself, without a name."""
    variable = _matrix(content, element, order)
    return variable if variable.name else None


def _matrix(content: bytes, element: tuple[int, int, int], order: _Order) -> _Variable:
    """Read flags, lengths and name."""
    _, flags, place = _element(content, 0, order)
    kind, lengths, place = _element(content, place, order)
    _, name, place = _element(content, place, order)
    if len(flags) != 8 or kind != _INT32 or len(lengths) % 4 or len(lengths) > 4 * 32:
        raise _DamageError
    word = int.from_bytes(flags[:4], order)
    return _Variable(
        name=name.decode("latin-1"),
        class_number=word & 0xFF,
        flags=word >> 8 & 0xFF,
        shape=tuple(
            int.from_bytes(lengths[i : i + 4], order, signed=True)
            for i in range(0, len(lengths), 4)
        ),
        place=place,
        order=order,
        element=element,
    )


def _arrays(file: IO[bytes], variable: _Variable) -> Iterator[_Variable]:
    """Yield a variable, or in the place of a structure or cell the arrays of numbers in it."""
    inside = _CLASSES.get(variable.class_number)
    if inside not in _NESTED:
        yield variable
        return
    most = min(_MAX_BYTES, max(EXPANSION * variable.element[2], MIN_EXPANDED_BYTES))
    content = _content(file, variable.element, variable.order, most)
    yield from _inner(content, variable, _DEEPEST)


def _inner(content: bytes, outer: _Variable, depth: int) -> Iterator[_Variable]:
    """Yield the arrays of numbers in a structure or cell; others are nothing to read."""
    own, order = content[slice(*outer.inside)], outer.order
    place, names = outer.place, [""]
    if outer.class_number == _STRUCT:
        _, width, place = _element(own, place, order)
        _, text, place = _element(own, place, order)
        length = int.from_bytes(width, order)
        if not 0 < length <= _LONGEST_FIELD:
            raise _DamageError
        fields = [text[i : i + length] for i in range(0, len(text), length)]
        names = [field.split(b"\0")[0].decode("latin-1") for field in fields]
    count = math.prod(outer.shape) * len(names)
    if not 0 <= count <= MAX_MEMBERS:
        raise _TooManyError
    for number in range(count):
        tag = own[place : place + 8]
        kind, length = (int.from_bytes(tag[i : i + 4], order) for i in (0, 4))
        first = place + 8
        if len(tag) < 8 or kind != _MATRIX or first + length > len(own):
            raise _DamageError
        place = first + length
        if not length:
            continue
        start = outer.inside[0] + first
        which, field = divmod(number, len(names))
        matrix = replace(
            _matrix(own[first:place], outer.element, order),
            name=_path(outer, which, names[field]),
            inside=(start, start + length),
        )
        if matrix.class_number in _NUMBERS:
            yield matrix
        elif _CLASSES.get(matrix.class_number) in _NESTED and depth:
            yield from _inner(content, matrix, depth - 1)


def _path(outer: _Variable, which: int, field: str) -> str:
    """Return what MATLAB calls a part of a structure or cell."""
    if outer.class_number != _STRUCT:
        return f"{outer.name}{{{which + 1}}}"
    index = "" if math.prod(outer.shape) == 1 else f"({which + 1})"
    return f"{outer.name}{index}.{field}"


def _element(content: bytes, place: int, order: _Order) -> tuple[int, bytes, int]:
    """Type and data of an element, and where the next one starts; a short one is eight bytes."""
    tag = content[place : place + 8]
    if len(tag) < 8:
        raise _DamageError
    word, length = (int.from_bytes(tag[i : i + 4], order) for i in (0, 4))
    if word >> 16:
        kind, length, first, end = word & 0xFFFF, word >> 16, place + 4, place + 8
    else:
        kind, first = word, place + 8
        end = first + -(-length // 8) * 8
    if first + length > len(content) or first + length > end:
        raise _DamageError
    return kind, content[first : first + length], end


def _judge(path: str, variable: _Variable) -> None:
    """Refuse what is no array of numbers, or too large."""
    kind = _CLASSES.get(variable.class_number, "unknown")
    if variable.flags & _LOGICAL:
        kind = "logical"
    elif variable.class_number in _NUMBERS:
        kind = ""
    name = variable.name[:40]
    if kind:
        raise InputError(f"{path}: {name} is of class {kind}; an array of numbers is needed.")
    count = list(itertools.accumulate(variable.shape, int.__mul__, initial=1))[-1]
    if min(variable.shape, default=0) < 0 or not 0 < count <= MAX_SAMPLES:
        raise InputError(
            f"{path}: {name} declares {count} elements; between 1 and {MAX_SAMPLES} are allowed."
        )


def _values(file: IO[bytes], variable: _Variable) -> NDArray[Any]:
    most = min(_MAX_BYTES, max(EXPANSION * variable.element[2], MIN_EXPANDED_BYTES))
    content = _content(file, variable.element, variable.order, most)[slice(*variable.inside)]
    count = int(np.prod(variable.shape))
    real, place = _numbers(content, variable.place, variable.order, count)
    kind = np.dtype(_NUMBERS[variable.class_number])
    if not variable.flags & _COMPLEX:
        return real.astype(kind).reshape(variable.shape, order="F")
    imaginary, _ = _numbers(content, place, variable.order, count)
    values = np.empty(count, dtype=np.complex64 if kind == np.float32 else np.complex128)
    values.real, values.imag = real, imaginary
    return values.reshape(variable.shape, order="F")


def _numbers(content: bytes, place: int, order: _Order, count: int) -> tuple[NDArray[Any], int]:
    """Read one part of an array; MATLAB keeps whole numbers in the smallest type for them."""
    kind, data, place = _element(content, place, order)
    stored = _STORED.get(kind)
    if stored is None:
        raise _DamageError
    dtype = np.dtype(("<" if order == "little" else ">") + stored)
    if len(data) != count * dtype.itemsize:
        raise _DamageError
    return np.frombuffer(data, dtype=dtype), place
