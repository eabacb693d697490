"""Worker processes for many independent jobs: one thread each, ended with their parent."""

import multiprocessing
import multiprocessing.connection
import os
import signal
import sys
import threading
from collections.abc import Iterator
from concurrent.futures import Executor, ProcessPoolExecutor, ThreadPoolExecutor
from contextlib import contextmanager
from multiprocessing.connection import Connection

# One linear-algebra thread a worker: more would fight over the cores, and could round otherwise.
SINGLE_THREAD = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")


def available_cores() -> int:
    """Return the number of cores this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


@contextmanager
def worker_pool(workers: int) -> Iterator[Executor]:
    """Open a pool of processes that end when the block is left, whatever they are at.

    Where the system has no semaphores for them, as without ``/dev/shm``, a thread of this process
    does the work, and a sentence on standard error says so.
    """
    # Spawned, not forked: a fork of a process with threads (a server, BLAS) may lock up.
    context = multiprocessing.get_context("spawn")
    lifeline, held = context.Pipe(duplex=False)
    pool: Executor
    try:
        pool = ProcessPoolExecutor(
            workers, mp_context=context, initializer=_start_worker, initargs=(lifeline,)
        )
    except (ImportError, NotImplementedError, OSError) as error:
        sys.stderr.write(f"vsep: no worker processes ({error}); this one does the work.\n")
        pool = ThreadPoolExecutor(1)
    with single_threaded():
        try:
            yield pool
        finally:
            held.close()
            pool.shutdown(wait=True, cancel_futures=True)
            lifeline.close()


def _start_worker(lifeline: Connection) -> None:
    """Leave Ctrl-C to the parent, and end once it lets go of the lifeline, even if it is killed."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with_parent, args=(lifeline,), daemon=True).start()


def _end_with_parent(lifeline: Connection) -> None:
    multiprocessing.connection.wait([lifeline])
    os._exit(1)


@contextmanager
def single_threaded() -> Iterator[None]:
    """Have processes that start meanwhile load their libraries with one thread."""
    before = {name: os.environ.get(name) for name in SINGLE_THREAD}
    os.environ.update(dict.fromkeys(SINGLE_THREAD, "1"))
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value
