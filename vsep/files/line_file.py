"""Files that grow by whole lines: results and rows that are kept as they are made.

A line is written as a whole or not at all, also where the disk is full, and handed to the disk
every few seconds, so that a machine that loses its power loses little.
"""

import contextlib
import os
import stat
import time
from collections.abc import Iterator
from pathlib import Path
from types import TracebackType
from typing import Final, Self

from vsep.errors import InputError
from vsep.files.writing import written_beside

try:
    import fcntl
except ImportError:  # Windows has none; there the size tells of another run
    fcntl = None  # type: ignore[assignment]

SYNC_S: Final = 5.0
"""Longest time for which a line that was written is not handed to the disk yet."""


class LineFile:
    """A file of lines, open for appending; made if need be. Use it in a ``with`` statement.

    A file that is new and empty at the end is removed again.

    Parameters
    ----------
    path : str or Path
        The file; what is no regular file, such as ``/dev/stdout``, is written to as well.
    alone : bool
        Refuse to write while another run does.

    Raises
    ------
    InputError
        If another run writes into the file.
    OSError
        If it cannot be opened.
    """

    def __init__(self, path: str | Path, *, alone: bool = False) -> None:
        self._path = str(path)
        self._is_new = not os.path.exists(path)
        flags = os.O_RDWR if os.path.isfile(path) or self._is_new else os.O_WRONLY
        flags |= os.O_CREAT | os.O_APPEND | getattr(os, "O_BINARY", 0)
        self._number = os.open(path, flags, 0o666)
        status = os.fstat(self._number)
        self._is_regular = stat.S_ISREG(status.st_mode)
        self._size, self._synced_s = status.st_size, time.monotonic()
        if alone:
            self._lock()

    def __enter__(self) -> Self:
        """Return the file itself."""
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        """Hand the lines to the disk and close the file."""
        try:
            if self._is_regular:
                self._sync()
                if self._is_new and os.fstat(self._number).st_size == 0:
                    os.unlink(self._path)
        finally:
            os.close(self._number)

    def cut(self, size: int) -> None:
        """Shorten the file to a number of bytes."""
        os.ftruncate(self._number, size)
        self._size = size

    def write(self, lines: str) -> None:
        """Append whole lines.

        Raises `InputError` if another run has written, `OSError` if there is no room; then none of
        the lines is there.
        """
        if self._is_regular and os.fstat(self._number).st_size != self._size:
            raise self._is_shared()
        content = memoryview(lines.encode())
        try:
            left = content
            while left:
                left = left[os.write(self._number, left) :]
            if self._is_regular and time.monotonic() - self._synced_s > SYNC_S:
                self._sync()
        except OSError as error:
            if self._is_regular:
                with contextlib.suppress(OSError):
                    os.ftruncate(self._number, self._size)
            raise OSError(error.errno, error.strerror, self._path) from error
        self._size += len(content)

    def _sync(self) -> None:
        os.fsync(self._number)
        self._synced_s = time.monotonic()

    def _lock(self) -> None:
        if fcntl is None:
            return
        try:
            fcntl.flock(self._number, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            os.close(self._number)
            raise self._is_shared() from None
        except OSError:
            pass  # a file system without locks: the size tells of another run

    def _is_shared(self) -> InputError:
        return InputError(
            f"Another run writes into {self._path}; wait for it or give another file."
        )


@contextlib.contextmanager
def lines_of_a_run(path: str | Path) -> Iterator[LineFile]:
    """Give a file for the lines of one run, in the place of those of an earlier one.

    A new file has every line at once, and an interrupted run leaves those that it has. Where there
    is a file already, it stays what it is until the run has ended.
    """
    holds_lines = os.path.isfile(path) and os.path.getsize(path) > 0
    with contextlib.ExitStack() as stack:
        place = stack.enter_context(written_beside(path)) if holds_lines else path
        yield stack.enter_context(LineFile(place))
