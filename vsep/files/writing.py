"""Writing files so that an interrupted or failed write leaves the old one as it was.

A file is written beside its place under a hidden name, handed to the disk, and renamed: at every
moment its own name holds either all of the old content or all of the new.
"""

import contextlib
import csv
import errno
import io
import os
import secrets
import stat
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np


@contextlib.contextmanager
def written_beside(path: str | Path) -> Iterator[Path]:
    """Give a name to write to; what stands there at the end of the block takes the file's place.

    After an error in the block the file is what it was before. A symbolic link keeps pointing to
    its file, and that keeps its permissions. What is no regular file, such as ``/dev/stdout``, is
    written to directly.

    Parameters
    ----------
    path : str or Path
        The file.

    Yields
    ------
    Path
        A new name in the same folder, with the same suffix.

    Raises
    ------
    OSError
        If the file cannot be written, a full disk for instance; it names the file.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     with written_beside(f"{folder}/a.txt") as beside:
    ...         _ = beside.write_text("whole")
    ...     Path(folder, "a.txt").read_text()
    'whole'
    """
    with _naming(path):
        if is_special(path):
            yield Path(path)
            return
        place = Path(os.path.realpath(path))
        beside = place.with_name(f".vsep-{secrets.token_hex(6)}{place.suffix[:16]}")
        try:
            yield beside
            if place.exists():
                beside.chmod(stat.S_IMODE(place.stat().st_mode))
            # Windows hands on only what is open for writing.
            _hand_to_disk(beside, os.O_RDWR)
            os.replace(beside, place)
        except BaseException:
            beside.unlink(missing_ok=True)
            raise
        # Not every system can do that to a folder; the file is safe without.
        with contextlib.suppress(OSError):
            _hand_to_disk(place.parent, os.O_RDONLY)


def write_bytes(path: str | Path, content: bytes) -> None:
    """Write a file as a whole; raises `OSError`, see `written_beside`."""
    with written_beside(path) as beside:
        beside.write_bytes(content)


def write_text(path: str | Path, text: str) -> None:
    """Write a text in UTF-8 as a whole, with the line ends it has.

    A file name in it that is no UTF-8 is made `printable`. Raises `OSError`, see `written_beside`.
    """
    write_bytes(path, printable(text).encode())


def printable(text: str) -> str:
    r"""Return a text with the bytes of file names that are no UTF-8 as backslash escapes.

    Examples
    --------
    >>> print(printable("a\udcff.npz"))
    a\udcff.npz
    """
    return text.encode("utf-8", "backslashreplace").decode()


def write_table(path: str | Path, head: Sequence[str], rows: Iterable[Sequence[Any]]) -> None:
    """Write a table as CSV, its head first; raises `OSError`, see `written_beside`."""
    text = io.StringIO()
    table = csv.writer(text)
    table.writerow(head)
    table.writerows(rows)
    write_text(path, text.getvalue())


def write_npz(path: str | Path, /, **arrays: Any) -> None:
    """Write an ``.npz`` archive as a whole; raises `OSError`, see `written_beside`."""
    with written_beside(path) as beside, beside.open("wb") as file:
        np.savez(file, **arrays)


def is_special(path: str | Path) -> bool:
    """Whether a path leads to something that is there and no regular file: a device, a pipe."""
    try:
        return not stat.S_ISREG(os.stat(path).st_mode)
    except (OSError, ValueError):
        return False


@contextlib.contextmanager
def _naming(path: str | Path) -> Iterator[None]:
    """Have an error of the operating system name the file that the caller named."""
    try:
        yield
    except OSError as error:
        raise _named(error, path) from error
    except ValueError as error:
        # A zip archive on a full disk complains of an open handle before it tells why.
        cause = error.__context__
        if isinstance(cause, OSError):
            raise _named(cause, path) from error
        raise


def _named(error: OSError, path: str | Path) -> OSError:
    return OSError(error.errno or errno.EIO, error.strerror or str(error), str(path))


def _hand_to_disk(path: Path, flags: int) -> None:
    """Have the system write to the disk what it keeps in memory of a file or a folder."""
    number = os.open(path, flags)
    try:
        os.fsync(number)
    finally:
        os.close(number)
