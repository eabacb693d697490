"""Opening files that nobody vouches for: regular files only, of a bounded size."""

import os
import stat
from pathlib import Path
from typing import BinaryIO, Final

from vsep.errors import InputError

MAX_TEXT_BYTES: Final = 2**30
"""Largest file of text lines that is read, rows of studies and result lines."""


def open_regular(path: str | Path, name: str, what: str) -> BinaryIO:
    """Open a file for reading; pipes, devices and folders are refused before a byte is read.

    A pipe would wait for its writer for ever, a device such as ``/dev/zero`` never ends.

    Parameters
    ----------
    path : str or Path
        The file.
    name : str
        What the sentence of an `InputError` calls it.
    what : str
        What is needed instead, for example "a frame file".

    Raises
    ------
    InputError
        If there is no such file, or none that can be read.

    Examples
    --------
    >>> open_regular("no-such-file.npz", "no-such-file.npz", "a frame file")
    Traceback (most recent call last):
    vsep.errors.InputError: no-such-file.npz does not exist; a frame file is needed.
    """
    try:
        # Without waiting for the writer of a pipe, and judged as opened, not as named.
        number = os.open(
            path, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0)
        )
    except FileNotFoundError as error:
        raise InputError(f"{name} does not exist; {what} is needed.") from error
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or "the path is not usable"
        raise InputError(f"{name} cannot be read: {reason}; {what} is needed.") from error
    mode = os.fstat(number).st_mode
    if not stat.S_ISREG(mode):
        os.close(number)
        kind = "a directory" if stat.S_ISDIR(mode) else "a pipe or a device"
        raise InputError(f"{name} is {kind}; {what} is needed.")
    return os.fdopen(number, "rb")


def read_bounded(path: str | Path, name: str, what: str, max_bytes: int = MAX_TEXT_BYTES) -> bytes:
    """Return what a regular file holds.

    Raises `InputError` if it cannot be read or holds more than `max_bytes`.
    """
    with open_regular(path, name, what) as file:
        size = os.fstat(file.fileno()).st_size
        if size > max_bytes:
            raise InputError(f"{name} is larger than {max_bytes} bytes; {what} is needed.")
        return file.read(max_bytes)
