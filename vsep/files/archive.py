"""Reading arrays from an ``.npz`` archive that nobody vouches for.

Every array's header is read and judged before its data: an archive may be cut off, lie about its
sizes, hold pickled objects or expand to more than the machine's memory. Whatever is wrong ends as
one sentence in an `InputError`. Memory is bounded by what the archive itself weighs: the arrays
read of it may expand to `EXPANSION` times its bytes, and to `MIN_EXPANDED_BYTES` in any case.
"""

import io
import struct
import tokenize
import zipfile
import zlib
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import IO, Any, BinaryIO, Self, TypeAlias

import numpy as np
from numpy.typing import NDArray

from vsep.errors import InputError
from vsep.files.opening import open_regular

MAX_SAMPLES = 64 * 2**20
"""Largest number of elements of one array, a gibibyte of complex128."""

MAX_MEMBERS = 1024
"""Largest number of arrays of an archive, or of variables of a MATLAB file."""

EXPANSION = 64
"""How many times its own size a compressed file may expand to; recorded samples reach 2 to 5."""

MIN_EXPANDED_BYTES = 64 * 2**20
"""What any compressed file may expand to: a small frame of zeros compresses a thousandfold."""

_MAX_TEXT = 4096
_MAX_DIRECTORY = 256 * MAX_MEMBERS  # bytes of an archive's directory
_MAX_HEADER = 65535  # bytes of an array's header
_MAX_ITEM = 64  # bytes of an element; complex128 has 16
# RuntimeError: encrypted members and unknown kinds of compression.
_UNREADABLE = (zipfile.BadZipFile, zlib.error, EOFError, RuntimeError, OSError, ValueError)

Source: TypeAlias = str | Path | BinaryIO


@dataclass(frozen=True, slots=True)
class _Header:
    shape: tuple[int, ...]
    dtype: np.dtype[Any]

    @property
    def num_elements(self) -> int:
        # Python integers: a shape made to overflow 64 bits must not come out small.
        count = 1
        for length in self.shape:
            count *= length
        return count


class Archive:
    """An open ``.npz`` archive; use it in a ``with`` statement.

    Parameters
    ----------
    source : str, Path or binary file
        The archive.
    name : str
        What the sentences of an `InputError` call it.

    Raises
    ------
    InputError
        If it cannot be opened or is not a zip archive.
    """

    def __init__(self, source: Source, name: str) -> None:
        self.name = name
        self._own_file: BinaryIO | None = None
        if isinstance(source, str | Path):
            source = self._own_file = open_regular(source, name, "a frame file (.npz)")
        file: BinaryIO = source
        try:
            num_bytes = file.seek(0, io.SEEK_END)
            _require_short_directory(file, num_bytes, name)
            self._left = max(EXPANSION * num_bytes, MIN_EXPANDED_BYTES)
            self._zip = zipfile.ZipFile(file)
        except InputError:
            self._close_own()
            raise
        except (zipfile.BadZipFile, RuntimeError, struct.error) as error:
            self._close_own()
            # RuntimeError: a version of the zip format that Python does not know.
            raise InputError(
                f"{name} is not a frame file; an .npz archive written by numpy.savez is needed, "
                "complete and uncut."
            ) from error
        except (OSError, ValueError) as error:
            self._close_own()
            reason = getattr(error, "strerror", None) or "it is no zip archive"
            raise InputError(
                f"{name} cannot be read: {reason}; a readable file is needed."
            ) from error
        if len(self._zip.NameToInfo) > MAX_MEMBERS:
            self.__exit__(None, None, None)
            raise InputError(
                f"{name} holds {len(self._zip.NameToInfo)} files; at most {MAX_MEMBERS} are read."
            )

    def _close_own(self) -> None:
        if self._own_file is not None:
            self._own_file.close()

    def __enter__(self) -> Self:
        """Return the archive itself."""
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        """Close the file, if it was opened here."""
        self._zip.close()
        self._close_own()

    def __contains__(self, key: str) -> bool:
        """Whether the archive holds the array `key`."""
        return f"{key}.npy" in self._zip.NameToInfo

    def names(self) -> tuple[str, ...]:
        """Return the names of the arrays, sorted."""
        names = (name.removesuffix(".npy") for name in self._zip.namelist() if name[-4:] == ".npy")
        return tuple(sorted(names))

    def num_elements(self, key: str) -> int:
        """Return how many elements an array declares, without reading it; 0 if it is absent.

        Raises `InputError` if it is damaged.
        """
        member = self._zip.NameToInfo.get(f"{key}.npy")
        if member is None:
            return 0
        try:
            with self._zip.open(member) as stream:
                return _read_header(stream).num_elements
        except _UNREADABLE as error:
            raise _damaged(f"{self.name}: array {key!r}") from error

    def sizes(self) -> dict[str, int]:
        """Return how many bytes every array has, by its name."""
        return {key: self._zip.NameToInfo[f"{key}.npy"].file_size for key in self.names()}

    def array(self, key: str, *, max_elements: int = MAX_SAMPLES) -> NDArray[Any]:
        """Read one array.

        Parameters
        ----------
        key : str
            Name of the array, without ``.npy``.
        max_elements : int
            Largest size accepted; checked before any data are read.

        Raises
        ------
        InputError
            If it is absent, too large, pickled, cut off or damaged.
        """
        member = self._zip.NameToInfo.get(f"{key}.npy")
        if member is None:
            raise InputError(f"{self.name} holds no array {key!r}, which a frame file needs.")
        if member.file_size > self._left:
            raise InputError(
                f"{self.name}: array {key!r} expands to {member.file_size} bytes, over {EXPANSION} "
                "times the size of the archive; write the file again with numpy.savez."
            )
        self._left -= member.file_size
        try:
            with self._zip.open(member) as stream:
                where = f"{self.name}: array {key!r}"
                return read_array(stream, where, member.file_size, max_elements=max_elements)
        except InputError:
            raise
        except _UNREADABLE as error:
            # What the zip archive itself finds, its checksums for instance.
            raise _damaged(f"{self.name}: array {key!r}") from error

    def number(self, key: str, default: float | None = None) -> float:
        """Read one real number; `default`, where given, stands in for an absent one."""
        if default is not None and key not in self:
            return default
        value = self.array(key, max_elements=1)
        if value.dtype.kind not in "iuf" or value.size != 1:
            raise InputError(
                f"{self.name}: {key} has type {value.dtype}; one real number is needed."
            )
        return float(value.reshape(()))

    def whole_number(self, key: str, default: int | None = None) -> int:
        """Read one whole number, exactly; `default`, where given, stands in for an absent one."""
        if default is not None and key not in self:
            return default
        value = self.array(key, max_elements=1)
        if value.dtype.kind in "iu" and value.size == 1:
            return int(value.reshape(()))
        number = self.number(key)
        if not number.is_integer():
            raise InputError(f"{self.name}: {key} is {number:g}; a whole number is needed.")
        return int(number)

    def beat_sign(self) -> int:
        """Read ``beat_sign``; -1, the paper's, where it is absent."""
        beat_sign = self.number("beat_sign", -1.0)
        if beat_sign not in (-1.0, 1.0):
            raise InputError(f"beat_sign is {beat_sign:g}; it must be -1 (the paper's) or +1.")
        return int(beat_sign)

    def text(self, key: str) -> str:
        """Read one text."""
        value = self.array(key, max_elements=1)
        if value.dtype.kind not in "US" or value.size != 1:
            raise InputError(f"{self.name}: {key} has type {value.dtype}; one text is needed.")
        item = value.reshape(()).item()
        return item.decode("utf-8", "replace") if isinstance(item, bytes) else str(item)


def source_name(source: Source, name: str | None) -> str:
    """Return what to call a source: its name, by default the path."""
    return name or (str(source) if isinstance(source, str | Path) else "the uploaded file")


def require_npz_name(path: str | Path, what: str) -> None:
    """Refuse to write an archive under another name than an ``.npz`` one."""
    if Path(path).suffix != ".npz":
        raise InputError(f"{path} is no name for {what}; it must end in .npz.")


def naming(name: str, error: InputError) -> InputError:
    """Put the file's name before a sentence that does not have it yet."""
    sentence = str(error)
    return error if sentence.startswith(name) else InputError(f"{name}: {sentence}")


def _require_short_directory(file: BinaryIO, num_bytes: int, name: str) -> None:
    """Judge the size of a zip archive's directory, which is read as a whole when it is opened.

    The end record is the last thing of an archive but for a comment; archives of over 65,534 files
    or 4 GiB have another one before it.
    """
    file.seek(max(0, num_bytes - 22 - 2**16))
    tail = file.read()
    file.seek(0)
    place = tail.rfind(b"PK\x05\x06")
    if place < 0 or place + 22 > len(tail):
        return  # no archive at all, which is told when it is opened
    (length,) = struct.unpack_from("<L", tail, place + 12)
    locator = place - 20
    if locator >= 0 and tail[locator : locator + 4] == b"PK\x06\x07":
        (start,) = struct.unpack_from("<Q", tail, locator + 8)
        file.seek(min(start, num_bytes))
        record = file.read(56)
        file.seek(0)
        (length,) = struct.unpack_from("<Q", record, 40)
    if length > _MAX_DIRECTORY:
        raise InputError(
            f"{name} lists its files in {length} bytes; at most {_MAX_DIRECTORY} are read."
        )


def read_array(
    stream: IO[bytes], where: str, num_bytes: int, *, max_elements: int = MAX_SAMPLES
) -> NDArray[Any]:
    """Read one array in NumPy's format; its header is judged before any data are read.

    Parameters
    ----------
    stream : binary file
        At the array's first byte.
    where : str
        What the sentences of an `InputError` call the array.
    num_bytes : int
        What the file holds of header and data together.
    max_elements : int
        Largest size accepted.

    Raises
    ------
    InputError
        If it is too large, pickled, cut off or damaged.
    """
    try:
        header = _read_header(stream)
        _judge(where, header, num_bytes - stream.tell(), max_elements)
        stream.seek(0)
        return np.lib.format.read_array(stream, allow_pickle=False)
    except InputError:
        raise
    except _UNREADABLE as error:
        raise _damaged(where) from error


def _damaged(where: str) -> InputError:
    return InputError(f"{where} is damaged or cut off; write the file again with numpy.savez.")


def _judge(where: str, header: _Header, num_bytes: int, max_elements: int) -> None:
    """Refuse what must not be read; `num_bytes` is what the file holds of the data."""
    if header.dtype.hasobject:
        raise InputError(f"{where} holds pickled objects; numbers are needed.")
    if header.num_elements > max_elements:
        raise InputError(
            f"{where} declares the shape {_shape_text(header.shape)}; at most {max_elements} "
            f"element{'s are' if max_elements > 1 else ' is'} allowed."
        )
    if header.dtype.kind in "US":
        if header.num_elements * header.dtype.itemsize > 4 * _MAX_TEXT:
            raise InputError(
                f"{where} is a text of over {_MAX_TEXT} characters, the longest allowed."
            )
    elif header.dtype.itemsize > _MAX_ITEM:
        raise InputError(
            f"{where} has elements of {header.dtype.itemsize} bytes; numbers are needed, at most "
            f"{_MAX_ITEM} bytes long."
        )
    if header.num_elements * header.dtype.itemsize != num_bytes:
        raise InputError(
            f"{where} declares the shape {_shape_text(header.shape)} of {header.dtype} but "
            f"holds {num_bytes} bytes; write the file again with numpy.savez."
        )


def _read_header(stream: IO[bytes]) -> _Header:
    """Read an array's header; `ValueError` for whatever is no header.

    Versions 2.0 and 3.0 of the format differ from 1.0 in the width of the header's length, which is
    judged before the header is read.
    """
    version = np.lib.format.read_magic(stream)
    if version not in ((1, 0), (2, 0), (3, 0)):
        raise ValueError(f"version {version} of the array format")
    try:
        if version == (1, 0):
            shape, _, dtype = np.lib.format.read_array_header_1_0(stream)
        else:
            length = stream.read(4)
            header = stream.read(_require_short_header(int.from_bytes(length, "little")))
            # Names of fields apart, version 3.0 says the same in UTF-8.
            shape, _, dtype = np.lib.format.read_array_header_2_0(io.BytesIO(length + header))
    except (SyntaxError, TypeError, MemoryError, OverflowError, tokenize.TokenError) as error:
        # NumPy evaluates the header as a Python literal, and passes on how that fails.
        raise ValueError("no array header") from error
    # A header is a Python literal: True is a length there, too.
    if any(type(length) is not int or length < 0 for length in shape):
        raise ValueError(f"length that is no count in shape {shape}")
    return _Header(shape=shape, dtype=dtype)


def _require_short_header(length: int) -> int:
    if length > _MAX_HEADER:
        raise ValueError(f"header of {length} bytes")
    return length


def _shape_text(shape: tuple[int, ...]) -> str:
    """Write a shape on one short line; a hostile one may have a thousand axes.

    Examples
    --------
    >>> _shape_text((16, 128)), _shape_text((8,)), _shape_text(())
    ('16 x 128', '8', 'of a single number')
    """
    if len(shape) > 4:
        return f"of {len(shape)} axes"
    return " x ".join(str(length) for length in shape) or "of a single number"
