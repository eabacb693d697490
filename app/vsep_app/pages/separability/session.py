"""Trials of the map on the page, in the background; another map cancels them.

A thread follows the engine, whose trials run in a process of their own. Of all pages together only
as many are at work as the machine has cores to spare; the others wait for their turn.
"""

import enum
import logging
import threading
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache

from vsep._processes import available_cores
from vsep.separability.cells import CellResult, compute_map
from vsep.separability.map_cache import MapCache
from vsep.separability.map_spec import Cell, MapSpec

_LOG = logging.getLogger(__name__)
# A slider that moves on does not start processes for where it was.
SETTLE_S = 0.7
_TURN_CHECK_S = 0.2


class Progress(enum.Enum):
    """What the trials are doing; the value is what a user reads."""

    IDLE = "ready"
    WAITING = "waiting for a free processor"
    RUNNING = "running"
    FINISHED = "finished"
    BROKEN = "ended by an error"


@dataclass(frozen=True, kw_only=True)
class Snapshot:
    """How far the trials of a map are."""

    spec: MapSpec  #: Which one.
    cell_results: Mapping[Cell, CellResult]  #: By cell.
    progress: Progress  #: What they are doing.
    error: str = ""  #: Why they ended, if they are broken.

    @property
    def num_cells(self) -> int:
        """How many cells there will be."""
        return self.spec.x.count * self.spec.y.count


@cache
def shared_map_cache() -> MapCache:
    """Return what all pages of this server have found."""
    return MapCache()


@cache
def turns() -> threading.BoundedSemaphore:
    """Return the turns that all pages share; one core is left to the server."""
    return threading.BoundedSemaphore(max(1, available_cores() - 1))


class SeparabilitySession:
    """The trials behind one page.

    `ask` starts those of the first spec; `cache` holds what is known already, and cell results go
    there.
    """

    def __init__(self, spec: MapSpec, cache: MapCache) -> None:
        self._spec, self._cache = spec, cache
        self._lock = threading.Lock()
        self._stop = threading.Event()
        self._progress, self._error = Progress.IDLE, ""
        self._thread: threading.Thread | None = None

    def ask(self, spec: MapSpec) -> None:
        """Cancel the running trials and begin with those of another map."""
        self.stop()
        with self._lock:
            self._spec, self._stop = spec, threading.Event()
            tried = spec.trials > 0
            self._progress, self._error = (Progress.WAITING if tried else Progress.IDLE), ""
            if tried:
                self._thread = threading.Thread(
                    target=self._follow, args=(spec, self._stop), daemon=True
                )
                self._thread.start()

    def stop(self) -> None:
        """End the trials; what is at work is lost, what is finished stays known."""
        with self._lock:
            self._stop.set()
            if self._progress in (Progress.WAITING, Progress.RUNNING):
                self._progress = Progress.IDLE

    def wait(self, timeout_s: float | None = None) -> None:
        """Wait until the trials end."""
        if self._thread is not None:
            self._thread.join(timeout_s)

    def snapshot(self) -> Snapshot:
        """Return how far the trials are now."""
        with self._lock:
            spec, progress, error = self._spec, self._progress, self._error
        known = self._cache.of(spec) if spec.trials else {}
        return Snapshot(spec=spec, cell_results=known, progress=progress, error=error)

    def _follow(self, spec: MapSpec, stop: threading.Event) -> None:
        """Take cell results from the engine; the thread's body."""
        if stop.wait(SETTLE_S):
            return
        while not turns().acquire(timeout=_TURN_CHECK_S):
            if stop.is_set():
                return
        try:
            self._enter(stop, Progress.RUNNING)
            for cell_result in compute_map(spec, stop=stop, known=self._cache.of(spec)):
                self._cache.add(spec, cell_result)
            self._enter(stop, Progress.FINISHED)
        except Exception as problem:
            _LOG.error("the trials of a map failed", exc_info=problem)
            sentence = f"The trials ended by an error ({type(problem).__name__}: {problem})."
            self._enter(stop, Progress.BROKEN, sentence)
        finally:
            turns().release()

    def _enter(self, stop: threading.Event, progress: Progress, error: str = "") -> None:
        """Say what the trials do, unless they are of a cancelled map."""
        with self._lock:
            if not stop.is_set():
                self._progress, self._error = progress, error
