"""A worker process, seen from the server, and what goes on in it."""

import gc
import logging
import math
import multiprocessing
import os
import pickle
import select
import signal
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass
from importlib import import_module
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any, Protocol

from vsep._processes import single_threaded
from vsep_app.jobs.object_cache import ObjectCache

try:
    import resource
except ImportError:  # not on Windows
    resource = None  # type: ignore[assignment]

_LOG = logging.getLogger(__name__)

# A job that nobody waits for may go on for so long before its worker is ended.
MAX_UNWANTED_S = 2.0
LOOK_EVERY_S = 0.25
_MEGABYTE = 2**20
# Workers are forks of one process that has done this once: they share its memory, and another one
# is there within milliseconds. A fork of the server itself, which has threads, may lock up.
_PRELOADED = "vsep_app.server.preloaded"
# Starting a process takes seven. What it is to be a fork of ends when it is asked by halves.
_NUM_DESCRIPTORS = 8
# The environment is changed while a process starts.
_STARTING = threading.Lock()


@dataclass(frozen=True, kw_only=True)
class Limited:
    """A function whose job is given up when it takes too much time or memory.

    Parameters
    ----------
    function : callable
        Of a module.
    what : str
        What a sentence calls its subject.
    seconds : float
        Time that it may take.
    megabytes : int
        Memory that it may take beside what its worker has already.

    Examples
    --------
    >>> Limited(function=len, what="The text", seconds=1.0, megabytes=64)("four")
    4
    """

    function: Callable[..., Any]
    what: str
    seconds: float
    megabytes: int

    def __call__(self, *arguments: Any) -> Any:
        """Call the function; who watches time and memory is the pool."""
        with _memory_limit(self.megabytes * _MEGABYTE):
            return self.function(*arguments)

    @property
    def lack_of_memory(self) -> str:
        """Sentence for the user."""
        return f"{self.what} needs more than {self.megabytes} MB of memory; give a smaller one."

    @property
    def lack_of_time(self) -> str:
        """Sentence for the user."""
        return f"{self.what} takes more than {self.seconds:g} s; give a smaller one."


class AnyJob(Protocol):
    """What a worker needs to know of a job."""

    function: Callable[..., Any]
    arguments: tuple[Any, ...]
    unwanted_since: float | None


class WorkerEndedError(Exception):
    """The process is gone."""


class TookTooLongError(Exception):
    """The process was ended; the message is for the user."""


class Worker:
    """One process, seen from the server; it is yet to be started."""

    def __init__(self, kept: tuple[type, ...]) -> None:
        self._kept = kept
        self._process: Any = None
        self.started_at = -math.inf  #: Last attempt, by the monotonic clock.
        self._pipe: Connection[Any, Any] | None = None

    @property
    def process_id(self) -> int:
        """Of the process."""
        return 0 if self._process is None else self._process.pid or 0

    @property
    def alive(self) -> bool:
        """Whether the process is there.

        Where it is a fork, what it is a fork of would tell of its end, but may have ended before;
        so its end of the pipe is looked at, where the system can.
        """
        if self._process is None or self._pipe is None:
            return False
        if not hasattr(select, "poll"):
            return bool(self._process.is_alive())
        return not self._hangs_up(0.0)

    def start(self) -> None:
        """Start the process, or another one after it has ended.

        Raises `OSError` where the system has no room for another process or pipe.
        """
        context = _context()
        self.started_at = time.monotonic()
        if self._pipe is not None:
            self._pipe.close()
        _require_descriptors(_NUM_DESCRIPTORS)
        ours, theirs = context.Pipe()
        process = context.Process(
            target=work, args=(theirs, self._kept), daemon=True, name="vsep-worker"
        )
        try:
            with _STARTING, single_threaded():
                process.start()
        except BaseException as error:
            ours.close()
            if isinstance(error, EOFError):
                raise OSError("the process that workers are forks of has ended") from error
            raise
        finally:
            theirs.close()
        self._object_cache = ObjectCache(self._kept, serving=True)
        self._process, self._pipe = process, ours

    def do(self, job: AnyJob) -> tuple[float, bool, Any]:
        """Have a job done; return its seconds, whether it went well, and result or exception.

        Raises `WorkerEndedError` if the process ended, or was ended because nobody wants the result
        any more, and `TookTooLongError` if it was ended at the time limit of the job.
        """
        assert self._pipe is not None
        try:
            parcel = self._object_cache.pack((job.function, job.arguments))
        except (pickle.PicklingError, AttributeError, TypeError) as error:
            return 0.0, False, error
        started = time.monotonic()
        try:
            self._pipe.send_bytes(parcel)
            while not self._pipe.poll(LOOK_EVERY_S):
                self._give_up_if_due(job, time.monotonic(), started)
            answer: tuple[float, bool, Any] = self._object_cache.unpack(self._pipe.recv_bytes())
        except (EOFError, OSError) as error:
            self.end()
            raise WorkerEndedError from error
        if isinstance(answer[2], MemoryError):
            # What it has not given back would be missing in the next job.
            self.end()
        return answer

    def end(self) -> None:
        """End the process at once."""
        if self._process is not None:
            self._process.kill()
            self._process.join()
        if self.alive:  # and what it is a fork of has ended
            with suppress(ProcessLookupError):
                os.kill(self.process_id, signal.SIGKILL)
            self._hangs_up(MAX_UNWANTED_S)

    def _hangs_up(self, seconds: float) -> bool:
        """Whether the other end of the pipe is closed, or will be within some time."""
        assert self._pipe is not None
        pipe = select.poll()
        try:
            pipe.register(self._pipe, 0)
        except (OSError, ValueError):  # closed here by another thread
            return True
        return bool(pipe.poll(1000.0 * seconds))

    def _give_up_if_due(self, job: AnyJob, now: float, started: float) -> None:
        if job.unwanted_since is not None and now - job.unwanted_since > MAX_UNWANTED_S:
            self.end()
        if isinstance(job.function, Limited) and now - started > job.function.seconds:
            self.end()
            raise TookTooLongError(job.function.lack_of_time)


def _context() -> Any:
    """Return how processes are started here; a process that is forked listens in a folder."""
    try:
        tempfile.gettempdir()
    except OSError:
        return multiprocessing.get_context("spawn")
    if sys.platform != "linux":
        return multiprocessing.get_context("spawn")
    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload([_PRELOADED])
    return context


def _require_descriptors(number: int) -> None:
    """Raise `OSError` where this process can open no more so many files."""
    with ExitStack() as opened:
        for _ in range(number):
            opened.callback(os.close, os.open(os.devnull, os.O_RDONLY))


def work(pipe: Connection, kept: tuple[type, ...]) -> None:
    """Do jobs until the other end of the pipe is closed; the body of a worker process."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    import_module(_PRELOADED)
    # What is shared stays so: looking for garbage would write to it.
    gc.freeze()
    object_cache = ObjectCache(kept, serving=False)
    while True:
        try:
            parcel = pipe.recv_bytes()
            pipe.send_bytes(_answer(object_cache, parcel))
        except (EOFError, OSError):
            os._exit(0)


def _answer(object_cache: ObjectCache, parcel: bytes) -> bytes:
    start = time.perf_counter()
    try:
        function, arguments = object_cache.unpack(parcel)
        good, result = True, function(*arguments)
    except Exception as error:
        good, result = False, error
    seconds = time.perf_counter() - start
    try:
        return object_cache.pack((seconds, good, result))
    except Exception as error:
        return object_cache.pack((seconds, False, RuntimeError(f"{type(error).__name__}: {error}")))


@contextmanager
def _memory_limit(num_bytes: int) -> Iterator[None]:
    """Let memory be refused to a worker beyond what it has and so much more.

    Only where the system tells what it has, which is Linux.
    """
    status = Path("/proc/self/status")
    if resource is None or not status.exists() or multiprocessing.parent_process() is None:
        yield
        return
    lines = dict(line.partition(":")[::2] for line in status.read_text().splitlines())
    soft, hard = resource.getrlimit(resource.RLIMIT_DATA)
    most = int(lines["VmData"].split()[0]) * 1024 + num_bytes
    allowed = [each for each in (most, soft, hard) if each != resource.RLIM_INFINITY]
    resource.setrlimit(resource.RLIMIT_DATA, (min(allowed), hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_DATA, (soft, hard))
