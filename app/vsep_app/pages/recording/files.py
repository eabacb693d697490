"""Uploaded files, kept on disk as long as their page is open."""

import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import panel_material_ui as pmu

from vsep.errors import InputError
from vsep_app.pages.recording.stored_file import StoredFile

MAX_FILE = 256 * 2**20
"""Bytes; a raw capture of many frames."""

_MEGABYTE = 2**20
_MOST_AT_ONCE = MAX_FILE + _MEGABYTE  # a recording and its settings


class DroppedFiles:
    """The folder of one page; workers read from it."""

    def __init__(self) -> None:
        self._folder: tempfile.TemporaryDirectory[str] | None = None
        self._number = 0

    def keep(self, name: str, content: bytes) -> StoredFile:
        """Write a file.

        Raises `InputError` if it is empty or too large.
        """
        require_size(name, len(content))
        if self._folder is None:
            self._folder = tempfile.TemporaryDirectory(prefix="vsep-")
        self._number += 1
        # Only the suffix counts; a name from outside must not choose a place on this disk.
        suffix = Path(name).suffix.lower()[:8]
        path = Path(self._folder.name) / f"{self._number}{suffix if suffix.isascii() else ''}"
        path.write_bytes(content)
        return StoredFile(path=str(path), name=name)

    def discard(self, file: StoredFile | None) -> None:
        """Remove a file, if there is one and it lies in this folder."""
        if file is not None and self._folder is not None:
            path = Path(file.path)
            if path.parent == Path(self._folder.name):
                path.unlink(missing_ok=True)

    def close(self) -> None:
        """Remove all files."""
        if self._folder is not None:
            self._folder.cleanup()
        self._folder = None


class DropZone(pmu.FileInput):
    """A field for files: a click chooses them, or they are dropped on it.

    What the browser refuses or cannot read becomes a sentence, too.
    """

    def __init__(
        self,
        *,
        take: Callable[[list[tuple[str, bytes]]], None],
        notify_error: Callable[[str], None],
        **look: Any,
    ) -> None:
        super().__init__(
            multiple=True,
            max_file_size=MAX_FILE,
            variant="outlined",
            size="small",
            sizing_mode="stretch_width",
            **look,
        )
        self._take, self._complain = take, notify_error
        self._arriving = 0
        self.param.watch(self._arrived, "value")

    def _handle_msg(self, msg: Any) -> None:
        """Turn what the library takes for a fault of the program into a sentence."""
        if msg["status"] == "upload_event":
            self._arriving += len(msg["data"])
        if msg["status"] == "error" or self._arriving > _MOST_AT_ONCE:
            # Who passes the browser's own limit is told at the end of what is sent.
            self._buffer.clear()
            self._file_buffer.clear()
            if msg["status"] != "upload_event":
                self._arriving = 0
                self._complain(
                    "The browser did not send the file; at most "
                    f"{MAX_FILE // _MEGABYTE} MB are taken."
                )
            return
        if msg["status"] == "finished":
            self._arriving = 0
        if msg["status"] == "finished" and not self._buffer:
            self._complain("The file is empty; a recording is needed.")
        super()._handle_msg(msg)

    def _arrived(self, event: Any) -> None:
        if not event.new:
            return
        files = list(zip(self.filename, event.new, strict=True))
        # The content is not kept twice, and the same file may be dropped again.
        self.param.update(value=None, filename=None, mime_type=None)
        self.param.update(uploaded_label="Uploaded {filename}", color="primary")
        self._take(files)

    def refuse(self) -> None:
        """Show that the last files are not used."""
        self.param.update(uploaded_label="Refused {filename}", color="error")


def require_size(name: str, num_bytes: int) -> None:
    """Raise `InputError` unless a file has a size that can be taken.

    Examples
    --------
    >>> require_size("adc.bin", 0)
    Traceback (most recent call last):
    vsep.errors.InputError: adc.bin is empty; a recording is needed.
    """
    if num_bytes == 0:
        raise InputError(f"{name} is empty; a recording is needed.")
    if num_bytes > MAX_FILE:
        raise InputError(
            f"{name} has {num_bytes / _MEGABYTE:.0f} MB; at most {MAX_FILE // _MEGABYTE} MB "
            "are taken."
        )
