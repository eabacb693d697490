"""Temporary folder of a page of studies."""

import tempfile
import threading
from collections.abc import Callable
from concurrent.futures import Future
from pathlib import Path
from typing import TypeVar

_Result = TypeVar("_Result")


class PageFolder:
    """A folder that is removed once its page is closed and nothing writes into it any more.

    What threads and workers have begun for a page goes on after it: a folder that is removed under
    their hands is not empty, or comes back.
    """

    def __init__(self) -> None:
        self._folder = tempfile.TemporaryDirectory(prefix="vsep-studies-")
        self._lock = threading.Lock()
        self._writers, self._closed = 0, False

    @property
    def path(self) -> Path:
        """Where it is."""
        return Path(self._folder.name)

    def write(self, function: Callable[..., _Result]) -> _Result:
        """Return what a function gives that writes into the folder.

        Raises `FileNotFoundError` if the page is closed.
        """
        self._enter()
        try:
            return function()
        finally:
            self._leave()

    def begin(self, submit: Callable[..., Future[_Result]]) -> Future[_Result]:
        """Hand in a job that writes into the folder, and return it.

        Raises `FileNotFoundError` if the page is closed.
        """
        self._enter()
        try:
            job = submit()
        except BaseException:
            self._leave()
            raise
        job.add_done_callback(lambda _: self._leave())
        return job

    def close(self) -> None:
        """Let nobody begin to write, and remove the folder after those who have."""
        with self._lock:
            last = not self._closed and not self._writers
            self._closed = True
        if last:
            self._folder.cleanup()

    def _enter(self) -> None:
        with self._lock:
            if self._closed:
                raise FileNotFoundError(f"{self.path}: the page of this folder is closed.")
            self._writers += 1

    def _leave(self) -> None:
        with self._lock:
            self._writers -= 1
            last = self._closed and not self._writers
        if last:
            self._folder.cleanup()
