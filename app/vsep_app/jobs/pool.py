"""Worker processes that all sessions share, with a queue that is fair to each of them.

A session has a `ClientQueue`. One job of a queue is at work at a time; whenever a worker is free,
it takes a job of the desk that has used the least time lately. So a run that has just been started
comes first, and a slow one waits for all others. Slow jobs never hold all workers at once. A job
whose result nobody wants any more is dropped from the queue; if a worker has been at it for long,
that worker is ended and another one takes its place.
"""

import logging
import multiprocessing
import os
import pickle
import signal
import threading
import time
from collections import deque
from collections.abc import Callable
from concurrent.futures import Executor, Future
from dataclasses import dataclass
from multiprocessing.connection import Connection
from typing import Any

from vsep._processes import available_cores, single_threaded
from vsep.errors import InputError
from vsep_app.jobs.object_cache import ObjectCache

_LOG = logging.getLogger(__name__)

# One more than cores: while some are at slow jobs, the system shares the cores with the others.
SPARE_WORKERS = 1
SLOW_JOB_S = 0.15
# What a desk has used counts half after this time.
HALF_LIFE_S = 2.0
# A job that nobody waits for may go on for so long before its worker is ended.
MAX_UNWANTED_S = 2.0
LOOK_EVERY_S = 0.25


class Job(Future[Any]):
    """A job and its future result."""

    def __init__(
        self, queue: "ClientQueue", function: Callable[..., Any], arguments: tuple[Any, ...]
    ):
        super().__init__()
        self.queue, self.function, self.arguments = queue, function, arguments
        self.unwanted_since: float | None = None

    @property
    def seems_slow(self) -> bool:
        """Whether the last job of this kind at the desk was slow."""
        return self.queue.last_s.get(self.function, 0.0) > SLOW_JOB_S

    def cancel(self) -> bool:
        """Drop the job; one that is at work goes on, but no longer holds up its desk."""
        dropped = super().cancel()
        if not dropped and not self.done() and self.unwanted_since is None:
            self.unwanted_since = time.monotonic()
            self.queue.leave(self)
        return dropped


class ClientQueue(Executor):
    """Where one session hands in its jobs."""

    def __init__(self, pool: "WorkerPool") -> None:
        self._pool = pool
        self.waiting: deque[Job] = deque()
        self.at_work: Job | None = None
        self.last_s: dict[Callable[..., Any], float] = {}
        self._used_s, self._used_at = 0.0, time.monotonic()

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Job:
        """Hand in a job: a function of a module, and arguments that can be sent."""
        if kwargs:
            raise TypeError("a job takes arguments by position only")
        return self._pool.enqueue(Job(self, fn, args))

    def leave(self, job: Job) -> None:
        """No longer wait for a job that is at work."""
        self._pool.abandon(job)

    def close(self) -> None:
        """Drop all jobs for good."""
        self._pool.close_queue(self)

    @property
    def used_s(self) -> float:
        """Time of workers that it has used lately."""
        age_s = time.monotonic() - self._used_at
        return float(self._used_s * 0.5 ** (age_s / HALF_LIFE_S))

    def charge(self, seconds: float) -> None:
        """Take note that a worker has worked for it."""
        self._used_s, self._used_at = self.used_s + seconds, time.monotonic()


@dataclass(frozen=True, kw_only=True)
class PoolFigures:
    """What the pool is doing."""

    #: Processes, jobs being done, jobs in the queue.
    workers: int
    at_work: int
    waiting: int
    done: int  #: Jobs done since the start.
    replaced: int  #: Workers that had to be replaced.
    process_ids: tuple[int, ...]  #: Of the workers.


class WorkerPool:
    """The processes and the queue.

    Parameters
    ----------
    kept : tuple of type
        Classes of records that are sent once, see `ObjectCache`.
    workers : int or None
        Number of processes; None: one more than there are cores.
    prepare : callable, optional
        What every process does before its first job.
    """

    def __init__(
        self,
        kept: tuple[type, ...],
        *,
        workers: int | None = None,
        prepare: Callable[[], object] | None = None,
    ) -> None:
        self.num_workers = workers or available_cores() + SPARE_WORKERS
        self._most_slow = max(1, self.num_workers - 1)
        self._changed = threading.Condition(threading.RLock())
        self._desks: list[ClientQueue] = []
        # Jobs that are being done, and whether each was expected to be slow.
        self._at_work: dict[Job, bool] = {}
        self._num_done = self._num_replaced = 0
        self._closed = False
        self._workers = [_Worker(kept, prepare) for _ in range(self.num_workers)]
        self._threads = [
            threading.Thread(target=self._serve, args=(worker,), daemon=True, name="vsep-pool")
            for worker in self._workers
        ]
        for thread in self._threads:
            thread.start()

    def queue(self) -> ClientQueue:
        """Return a new desk."""
        queue = ClientQueue(self)
        with self._changed:
            self._desks.append(queue)
        return queue

    def figures(self) -> PoolFigures:
        """Return what the pool is doing."""
        with self._changed:
            return PoolFigures(
                workers=self.num_workers,
                at_work=len(self._at_work),
                waiting=sum(len(queue.waiting) for queue in self._desks),
                done=self._num_done,
                replaced=self._num_replaced,
                process_ids=tuple(worker.process_id for worker in self._workers),
            )

    def close(self) -> None:
        """End all processes, whatever they are at."""
        with self._changed:
            self._closed = True
            for queue in tuple(self._desks):
                self.close_queue(queue)
            self._changed.notify_all()
        for worker in self._workers:
            worker.end()

    def enqueue(self, job: Job) -> Job:
        """Take a job of a desk."""
        with self._changed:
            if self._closed or job.queue not in self._desks:
                job.cancel()
                return job
            job.queue.waiting.append(job)
            self._changed.notify()
        return job

    def abandon(self, job: Job) -> None:
        """Let the desk of a job go on with its next one."""
        with self._changed:
            if job.queue.at_work is job:
                job.queue.at_work = None
                self._changed.notify()

    def close_queue(self, queue: ClientQueue) -> None:
        """Drop all jobs of a desk for good."""
        with self._changed:
            if queue in self._desks:
                self._desks.remove(queue)
            jobs = [*queue.waiting, *([queue.at_work] if queue.at_work is not None else [])]
            queue.waiting.clear()
        for job in jobs:
            job.cancel()

    def _serve(self, worker: "_Worker") -> None:
        """Hand jobs to one worker, one after the other; a thread's body."""
        while (job := self._next_job()) is not None:
            try:
                if not worker.alive:
                    # It ended while it had nothing to do: the job is not to blame.
                    self._restart(worker)
                self._settle(job, *worker.do(job))
            except _WorkerEndedError:
                self._replace(worker, job)
            finally:
                self._finished(job)
            # A job holds its arguments and its result; this thread must not.
            del job

    def _next_job(self) -> Job | None:
        """Wait for the job whose turn it is; None at the end."""
        with self._changed:
            while not self._closed:
                job = self._choose()
                if job is None:
                    self._changed.wait()
                    continue
                job.queue.waiting.popleft()
                if not job.set_running_or_notify_cancel():
                    continue
                job.queue.at_work = job
                self._at_work[job] = job.seems_slow
                return job
        return None

    def _choose(self) -> Job | None:
        """Return the first job of the desk that has used least, among those that may go on."""
        ready = [queue for queue in self._desks if queue.waiting and queue.at_work is None]
        if sum(self._at_work.values()) >= self._most_slow:
            ready = [queue for queue in ready if not queue.waiting[0].seems_slow]
        return min(ready, key=lambda queue: queue.used_s).waiting[0] if ready else None

    def _finished(self, job: Job) -> None:
        with self._changed:
            del self._at_work[job]
            self._num_done += 1
            if job.queue.at_work is job:
                job.queue.at_work = None
            # This worker looks for itself; another one is needed only for what it leaves.
            if sum(bool(queue.waiting) for queue in self._desks) > 1:
                self._changed.notify()

    def _settle(self, job: Job, seconds: float, good: bool, result: Any) -> None:
        with self._changed:
            job.queue.charge(seconds)
            job.queue.last_s[job.function] = seconds
            # The next job of the desk may be handed in by whoever hears of this one.
            if job.queue.at_work is job:
                job.queue.at_work = None
        if job.unwanted_since is not None:
            return
        if good:
            job.set_result(result)
        else:
            job.set_exception(result)

    def _restart(self, worker: "_Worker") -> None:
        with self._changed:
            if self._closed:
                return
            self._num_replaced += 1
        worker.start()

    def _replace(self, worker: "_Worker", job: Job) -> None:
        self._restart(worker)
        if job.unwanted_since is None and not self._closed:
            _LOG.warning("a worker process ended abruptly and was replaced")
            job.set_exception(
                InputError("A worker process ended abruptly, perhaps for lack of memory.")
            )


class _WorkerEndedError(Exception):
    """The process is gone."""


class _Worker:
    """One process, seen from the server."""

    def __init__(self, kept: tuple[type, ...], prepare: Callable[[], object] | None) -> None:
        self._kept, self._prepare = kept, prepare
        self.start()

    @property
    def process_id(self) -> int:
        """Of the process."""
        return self._process.pid or 0

    @property
    def alive(self) -> bool:
        """Whether the process is there."""
        return self._process.is_alive()

    def start(self) -> None:
        """Start the process, or another one after it has ended."""
        # Spawned, not forked: a fork of a process with threads (a server, BLAS) may lock up.
        context = multiprocessing.get_context("spawn")
        self._pipe, theirs = context.Pipe()
        self._object_cache = ObjectCache(self._kept, serving=True)
        self._process = context.Process(
            target=work, args=(theirs, self._kept, self._prepare), daemon=True, name="vsep-worker"
        )
        with single_threaded():
            self._process.start()
        theirs.close()

    def do(self, job: Job) -> tuple[float, bool, Any]:
        """Have a job done; return its seconds, whether it went well, and result or exception.

        Raises `_WorkerEndedError` if the process ended, or was ended because nobody wants the
        result any more.
        """
        try:
            parcel = self._object_cache.pack((job.function, job.arguments))
        except (pickle.PicklingError, AttributeError, TypeError) as error:
            return 0.0, False, error
        try:
            self._pipe.send_bytes(parcel)
            while not self._pipe.poll(LOOK_EVERY_S):
                since = job.unwanted_since
                if since is not None and time.monotonic() - since > MAX_UNWANTED_S:
                    self.end()
            answer: tuple[float, bool, Any] = self._object_cache.unpack(self._pipe.recv_bytes())
        except (EOFError, OSError) as error:
            self._process.join()
            raise _WorkerEndedError from error
        return answer

    def end(self) -> None:
        """End the process at once."""
        self._process.kill()
        self._process.join()


def work(pipe: Connection, kept: tuple[type, ...], prepare: Callable[[], object] | None) -> None:
    """Do jobs until the other end of the pipe is closed; the body of a worker process."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    if prepare is not None:
        try:
            prepare()
        except Exception as problem:  # the jobs may do all the same
            _LOG.error("a worker could not prepare", exc_info=problem)
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
