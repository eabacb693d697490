"""Worker processes that all sessions share, with a queue that is fair to each of them.

A session has a `ClientQueue`. One job of a queue is at work at a time; whenever a worker is free,
it takes a job of the desk that has used the least time lately. So a run that has just been started
comes first, and a slow one waits for all others. Slow jobs never hold all workers at once. A job
whose result nobody wants any more is dropped from the queue; if a worker has been at it for long,
that worker is ended and another one takes its place. Where the system has no room for another one,
it is tried again and again, and jobs wait for it.
"""

import logging
import threading
import time
from collections import deque
from collections.abc import Callable
from concurrent.futures import Executor, Future
from dataclasses import dataclass
from typing import Any

from vsep._processes import available_cores
from vsep.errors import InputError
from vsep_app.jobs.worker import Limited, TookTooLongError, Worker, WorkerEndedError

_LOG = logging.getLogger(__name__)

# One more than cores: while some are at slow jobs, the system shares the cores with the others.
SPARE_WORKERS = 1
SLOW_JOB_S = 0.15
# What a desk has used counts half after this time.
HALF_LIFE_S = 2.0
# A worker that has nothing to do is looked after so often.
IDLE_S = 1.0
# Until the next attempt to start a process; it doubles while they fail or end at once.
FIRST_RETRY_S, MAX_RETRY_S = 0.25, 2.0
_SHORT_LIFE_S = 2.0
# A job may have ended its worker, or the system has ended all of them for another reason: it is
# given up when it is at work in so many more than there are.
SPARE_ATTEMPTS = 2


class Job(Future[Any]):
    """A job and its future result."""

    def __init__(
        self, queue: "ClientQueue", function: Callable[..., Any], arguments: tuple[Any, ...]
    ):
        super().__init__()
        self.queue, self.function, self.arguments = queue, function, arguments
        self.unwanted_since: float | None = None
        self.attempts = 0

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

    #: Processes that live, and how many there are to be.
    workers: int
    wanted: int
    #: Jobs being done, jobs in the queue.
    at_work: int
    waiting: int
    done: int  #: Jobs done since the start.
    replaced: int  #: Workers that had to be replaced.
    process_ids: tuple[int, ...]  #: Of the workers that live.


class WorkerPool:
    """The processes and the queue.

    Parameters
    ----------
    kept : tuple of type
        Classes of records that are sent once, see `ObjectCache`.
    workers : int or None
        Number of processes; None: one more than there are cores.
    """

    def __init__(self, kept: tuple[type, ...], *, workers: int | None = None) -> None:
        self.num_workers = workers or available_cores() + SPARE_WORKERS
        self._most_slow = max(1, self.num_workers - 1)
        self._changed = threading.Condition(threading.RLock())
        self._desks: list[ClientQueue] = []
        # Jobs that are being done, and whether each was expected to be slow.
        self._at_work: dict[Job, bool] = {}
        self._num_done = self._num_replaced = 0
        self._closed, self._lacks_room = threading.Event(), False
        self._workers = [Worker(kept) for _ in range(self.num_workers)]
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
        living = tuple(worker.process_id for worker in self._workers if worker.alive)
        with self._changed:
            return PoolFigures(
                workers=len(living),
                wanted=self.num_workers,
                at_work=len(self._at_work),
                waiting=sum(len(queue.waiting) for queue in self._desks),
                done=self._num_done,
                replaced=self._num_replaced,
                process_ids=living,
            )

    def close(self) -> None:
        """End all processes, whatever they are at."""
        with self._changed:
            self._closed.set()
            for queue in tuple(self._desks):
                self.close_queue(queue)
            self._changed.notify_all()
        for worker in self._workers:
            worker.end()

    def enqueue(self, job: Job) -> Job:
        """Take a job of a desk."""
        with self._changed:
            if self._closed.is_set() or job.queue not in self._desks:
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

    def _serve(self, worker: Worker) -> None:
        """Hand jobs to one worker, one after the other; a thread's body."""
        delay_s = FIRST_RETRY_S
        while not self._closed.is_set():
            if not worker.alive:
                delay_s = self._replace(worker, delay_s)
                continue
            job = self._next_job(worker)
            if job is not None:
                is_settled = True
                try:
                    is_settled = self._do(worker, job)
                finally:
                    self._finished(job)
                if is_settled:
                    delay_s = FIRST_RETRY_S
                else:
                    self._give_back(job)
            # A job holds its arguments and its result; this thread must not.
            del job

    def _replace(self, worker: Worker, delay_s: float) -> float:
        """Start the first process, or another one; return what to wait before the next attempt."""
        too_soon = time.monotonic() - worker.started_at < _SHORT_LIFE_S
        if too_soon and self._closed.wait(delay_s):
            return delay_s
        is_another = worker.process_id > 0
        if self._start(worker) and is_another:
            with self._changed:
                self._num_replaced += 1
        return min(2.0 * delay_s, MAX_RETRY_S) if too_soon else delay_s

    def _start(self, worker: Worker) -> bool:
        """Start a process, and say so once where the system has no room for it."""
        try:
            worker.start()
        except (OSError, MemoryError) as error:
            if self._room_changes(lacks_room=True):
                _LOG.warning("a worker process cannot be started (%s); trying again", error)
            return False
        if self._room_changes(lacks_room=False):
            _LOG.warning("worker processes can be started again")
        if self._closed.is_set():
            worker.end()
        return True

    def _room_changes(self, *, lacks_room: bool) -> bool:
        """Note whether there is room for processes, and return whether that is new."""
        with self._changed:
            changes, self._lacks_room = self._lacks_room != lacks_room, lacks_room
        return changes

    def _next_job(self, worker: Worker) -> Job | None:
        """Wait for the job whose turn it is; None at the end, and if the worker's process ended."""
        with self._changed:
            while worker.alive and not self._closed.is_set():
                job = self._choose()
                if job is None:
                    self._changed.wait(IDLE_S)
                    continue
                job.queue.waiting.popleft()
                if job.unwanted_since is not None:
                    continue
                if not job.attempts and not job.set_running_or_notify_cancel():
                    continue
                job.attempts += 1
                job.queue.at_work = job
                self._at_work[job] = job.seems_slow
                return job
        return None

    def _do(self, worker: Worker, job: Job) -> bool:
        """Have a job done; False if its worker ended and another one is to try."""
        try:
            self._settle(job, *worker.do(job))
        except WorkerEndedError:
            if job.attempts < self.num_workers + SPARE_ATTEMPTS:
                return False
            self._fail(job, "A worker process ended abruptly, perhaps for lack of memory.")
        except TookTooLongError as error:
            self._fail(job, str(error))
        except Exception as error:  # whatever comes back is not to end this thread
            _LOG.error("a worker's answer cannot be read", exc_info=error)
            worker.end()
            self._fail(job, f"The answer of a worker cannot be read ({type(error).__name__}).")
        return True

    def _give_back(self, job: Job) -> None:
        """Let a job whose worker ended be the next one of its queue."""
        with self._changed:
            if job.unwanted_since is None and job.queue in self._desks:
                job.queue.waiting.appendleft(job)
                self._changed.notify()

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
        elif isinstance(result, MemoryError) and isinstance(job.function, Limited):
            job.set_exception(InputError(job.function.lack_of_memory))
        else:
            job.set_exception(result)

    def _fail(self, job: Job, sentence: str) -> None:
        if job.unwanted_since is None and not self._closed.is_set():
            _LOG.warning("a worker process was replaced: %s", sentence)
            job.set_exception(InputError(sentence))
