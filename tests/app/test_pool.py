import contextlib
import errno
import importlib
import os
import signal
import subprocess
import sys
import threading
import time
from concurrent.futures import wait
from pathlib import Path

import pytest
from vsep_app.jobs import pool as pool_module
from vsep_app.jobs import worker as worker_module
from vsep_app.jobs.pool import SLOW_JOB_S, WorkerPool
from vsep_app.jobs.worker import Limited, Worker
from vsep_app.server.process_figures import all_memory_mb, memory_mb

from tests.app.test_run_session import _state, _step
from vsep.errors import InputError
from vsep.inference.core.progress import Step
from vsep.inference.core.state import SeparationState

# Room for a busy machine: nothing waits for its end.
PATIENCE_S = 60.0


@pytest.fixture(scope="module")
def pool():
    """Two workers."""
    workers = started(WorkerPool((Step, SeparationState), workers=2))
    yield workers
    workers.close()


def started(workers):
    """Return a pool whose processes are there."""
    _until(lambda: workers.figures().workers == workers.num_workers)
    return workers


def _where(_argument=None):
    return os.getpid()


def _sleep(seconds):
    time.sleep(seconds)
    return time.monotonic()


def _held(seconds):
    time.sleep(seconds)
    return os.getpid()


def _wait_for(path):
    while not path.exists():
        time.sleep(0.01)


def _refuse():
    raise InputError("The value is 3; it must be 4.")


def _end():
    os._exit(3)


def _until(condition, seconds=PATIENCE_S):
    deadline = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < deadline, "waited in vain"
        time.sleep(0.01)


def test_jobs_are_done_in_other_processes(pool):
    places = {pool.queue().submit(_where).result(PATIENCE_S) for _ in range(4)}
    assert places <= set(pool.figures().process_ids)
    assert os.getpid() not in places


def test_a_state_that_was_sent_comes_back_as_the_same_object(pool):
    step = _step(_state(0))
    assert pool.queue().submit(_same, step).result(PATIENCE_S) is step


def _same(argument):
    return argument


def test_an_error_is_the_caller_s(pool):
    with pytest.raises(InputError, match="it must be 4"):
        pool.queue().submit(_refuse).result(PATIENCE_S)


def test_what_cannot_be_sent_is_an_error_of_the_job(pool):
    with pytest.raises((AttributeError, TypeError)):
        pool.queue().submit(_where, threading.Lock()).result(PATIENCE_S)


def test_a_queue_has_one_job_at_work(pool):
    queue = pool.queue()
    first, second = queue.submit(_sleep, 0.2), queue.submit(_sleep, 0.2)
    # Both workers are free; the second job ends a whole job later than the first.
    assert second.result(PATIENCE_S) - first.result(PATIENCE_S) >= 0.2


def test_who_has_used_least_comes_first(pool):
    busy, fresh = pool.queue(), pool.queue()
    busy.charge(10.0)
    holding = [pool.queue().submit(_sleep, 0.3) for _ in range(2)]
    _until(lambda: pool.figures().at_work == 2)
    late = busy.submit(_sleep, 0.15)
    early = [fresh.submit(_sleep, 0.15), pool.queue().submit(_sleep, 0.15)]
    wait([*holding, late, *early], PATIENCE_S)
    assert late.result() > max(job.result() for job in early)


def test_slow_jobs_leave_a_worker_to_the_others(pool):
    desks = [pool.queue() for _ in range(3)]
    for queue in desks:
        queue.last_s[_sleep] = 2.0 * SLOW_JOB_S
    slow = [queue.submit(_sleep, 0.6) for queue in desks]
    begun = time.monotonic()
    pool.queue().submit(_where).result(PATIENCE_S)
    # All three would take 1.2 s on two workers if they could hold both.
    assert not any(job.done() for job in slow[1:])
    wait(slow, PATIENCE_S)
    assert time.monotonic() - begun > 1.5


def test_a_dropped_job_is_never_done(pool):
    queue = pool.queue()
    held = queue.submit(_sleep, 0.2)
    dropped = queue.submit(_sleep, 0.2)
    assert dropped.cancel()
    held.result(PATIENCE_S)
    done = pool.figures().done
    queue.submit(_where).result(PATIENCE_S)
    assert pool.figures().done <= done + 2


def test_a_job_that_was_given_up_does_not_hold_up_its_queue(pool, monkeypatch, tmp_path):
    monkeypatch.setattr(worker_module, "MAX_UNWANTED_S", 10 * PATIENCE_S)
    queue = pool.queue()
    long = queue.submit(_wait_for, tmp_path / "end")
    _until(lambda: pool.figures().at_work == 1)
    long.cancel()
    # The job that was given up goes on as long as there is no such file.
    assert queue.submit(_where).result(PATIENCE_S) in pool.figures().process_ids
    (tmp_path / "end").touch()
    _until(lambda: pool.figures().at_work == 0)


def test_a_worker_that_nobody_waits_for_is_ended_and_replaced(pool, monkeypatch):
    monkeypatch.setattr(worker_module, "MAX_UNWANTED_S", 0.1)
    before = set(pool.figures().process_ids)
    queue = pool.queue()
    queue.submit(_sleep, 600.0)
    _until(lambda: pool.figures().at_work == 1)
    queue.close()
    _until(lambda: set(pool.figures().process_ids) != before)
    _until(lambda: pool.figures().at_work == 0)
    # Two jobs at once need both workers: the one that was there before, and the new one.
    places = {job.result(PATIENCE_S) for job in [pool.queue().submit(_held, 0.3) for _ in range(2)]}
    assert places == set(pool.figures().process_ids)
    assert len(places & before) == len(places - before) == 1
    assert pool.figures().replaced == 1


def test_a_worker_that_breaks_is_told_and_replaced(pool, caplog):
    with pytest.raises(InputError, match="ended abruptly"):
        pool.queue().submit(_end).result(PATIENCE_S)
    assert "was replaced" in caplog.text
    assert pool.queue().submit(_where).result(PATIENCE_S) in pool.figures().process_ids


def test_a_worker_that_ended_while_it_had_nothing_to_do_fails_no_job(pool, caplog):
    before = set(pool.figures().process_ids)
    for number in before:
        os.kill(number, signal.SIGKILL)
    _until(lambda: before.isdisjoint(pool.figures().process_ids))
    desks = [pool.queue() for _ in range(4)]
    places = {job.result(PATIENCE_S) for job in [queue.submit(_where) for queue in desks]}
    assert places <= set(pool.figures().process_ids)
    assert caplog.text == ""


def test_a_job_whose_worker_is_killed_is_done_by_another(pool, tmp_path):
    _until(lambda: len(pool.figures().process_ids) == 2)  # one may still be replaced
    before = set(pool.figures().process_ids)
    job = pool.queue().submit(_wait_for, tmp_path / "end")
    _until(lambda: pool.figures().at_work == 1)
    for number in before:
        os.kill(number, signal.SIGKILL)
    _until(lambda: len(before.symmetric_difference(pool.figures().process_ids)) == 4)
    (tmp_path / "end").touch()
    assert job.result(PATIENCE_S) is None


def test_a_closed_queue_takes_no_jobs(pool):
    queue = pool.queue()
    queue.close()
    assert queue.submit(_where).cancelled()


def _grow(num_bytes):
    return len(bytearray(num_bytes))


def _within(function, *, seconds=PATIENCE_S, megabytes=64):
    return Limited(function=function, what="The file", seconds=seconds, megabytes=megabytes)


def test_a_job_over_its_time_is_a_sentence_and_its_worker_is_replaced(pool):
    replaced = pool.figures().replaced
    begun = time.monotonic()
    with pytest.raises(InputError, match=r"^The file takes more than 0.2 s; give a smaller one"):
        pool.queue().submit(_within(_sleep, seconds=0.2), 600.0).result(PATIENCE_S)
    assert time.monotonic() - begun < 5.0
    _until(lambda: pool.figures().replaced == replaced + 1)
    _until(lambda: pool.figures().workers == 2)


@pytest.mark.skipif(not Path("/proc/self/status").exists(), reason="memory limits are Linux's")
def test_a_job_over_its_memory_is_a_sentence_and_the_next_has_all_of_it(pool):
    queue = pool.queue()
    with pytest.raises(InputError, match=r"^The file needs more than 64 MB of memory"):
        queue.submit(_within(_grow), 2**28).result(PATIENCE_S)
    assert queue.submit(_within(_grow), 2**24).result(PATIENCE_S) == 2**24
    # The limit is that of one job: others have none.
    assert queue.submit(_grow, 2**28).result(PATIENCE_S) == 2**28


@pytest.mark.parametrize("number", [errno.EMFILE, errno.ENOMEM, errno.EAGAIN])
def test_a_pool_without_room_for_workers_goes_on_when_there_is_room(number, monkeypatch, caplog):
    monkeypatch.setattr(pool_module, "FIRST_RETRY_S", 0.01)
    start, attempts, has_room = Worker.start, [], threading.Event()

    def start_if_room(worker):
        if worker not in workers._workers:
            start(worker)  # another pool's, which goes on after the test before
            return
        attempts.append(time.monotonic())
        worker.started_at = attempts[-1]
        if not has_room.is_set():
            raise OSError(number, os.strerror(number))
        start(worker)

    workers = started(WorkerPool((), workers=2))
    monkeypatch.setattr(Worker, "start", start_if_room)
    for process in workers.figures().process_ids:
        os.kill(process, signal.SIGKILL)
    _until(lambda: workers.figures().workers == 0)
    waiting = [workers.queue().submit(_where) for _ in range(3)]
    _until(lambda: len(attempts) >= 6)
    figures = workers.figures()
    assert (figures.workers, figures.wanted, figures.waiting) == (0, 2, 3)
    # Each waits twice as long as before: no busy loop.
    assert len(attempts) < 30
    assert [record.message.count("cannot be started") for record in caplog.records] == [1]
    has_room.set()
    places = {job.result(PATIENCE_S) for job in waiting}
    assert places <= set(workers.figures().process_ids)
    assert caplog.records[-1].message == "worker processes can be started again"
    workers.close()


def test_a_pool_without_descriptors_goes_on_when_there_are_some():
    """In a process of its own, whose limit holds for all that it opens."""
    subprocess.run([sys.executable, "-c", STARVED], check=True, timeout=PATIENCE_S)


STARVED = """
import os, resource, signal, time
from pathlib import Path
from vsep_app.jobs.pool import WorkerPool

def parent(process):
    return Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[1]

if __name__ == "__main__":
    pool = WorkerPool((), workers=2)
    while pool.figures().workers < 2:
        time.sleep(0.01)
    workers = pool.figures().process_ids
    origin = parent(workers[0])
    used = {int(each.name) for each in Path("/proc/self/fd").iterdir()}
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    # One, and what the killed workers leave, which is not enough for another one.
    few = [number for number in range(100) if number not in used][1]
    resource.setrlimit(resource.RLIMIT_NOFILE, (few, hard))
    for number in workers:
        os.kill(number, signal.SIGKILL)
    until = time.monotonic() + 20.0
    while pool.figures().workers and time.monotonic() < until:
        time.sleep(0.01)
    job = pool.queue().submit(os.getpid)
    time.sleep(1.0)
    assert (pool.figures().workers, pool.figures().waiting) == (0, 1), pool.figures()
    resource.setrlimit(resource.RLIMIT_NOFILE, (soft, hard))
    process = job.result(20.0)
    assert process in pool.figures().process_ids
    assert parent(process) == origin
    pool.close()
"""


def _end_at_once(*_):
    os._exit(3)


def test_a_worker_that_ends_at_once_is_not_started_over_and_over(monkeypatch):
    monkeypatch.setattr(worker_module, "work", _end_at_once)
    monkeypatch.setattr(pool_module, "FIRST_RETRY_S", 0.1)
    begun = time.monotonic()
    workers = WorkerPool((), workers=1)
    _until(lambda: workers.figures().replaced == 3)
    # Each waits twice as long as the one before.
    assert time.monotonic() - begun > 0.1 + 0.2 + 0.4
    workers.close()


def _loaded():
    return "numba" in sys.modules, "panel" in sys.modules


def test_workers_have_kernels_before_their_first_job_and_nothing_that_draws_pages(pool):
    assert pool.queue().submit(_loaded).result(PATIENCE_S) == (True, False)


def test_a_process_that_cannot_prepare_does_its_jobs_all_the_same(monkeypatch, caplog):
    def refuse():
        raise OSError("nothing is there")

    from vsep_app.jobs import warmup
    from vsep_app.server import preloaded

    monkeypatch.setattr(warmup, "separate_one_frame", refuse)
    importlib.reload(preloaded)
    assert "could not prepare" in caplog.text


LINUX = pytest.mark.skipif(sys.platform != "linux", reason="workers are forks on Linux")


@LINUX
def test_a_worker_in_the_place_of_a_killed_one_has_nothing_to_load(pool):
    started(pool)
    before = set(pool.figures().process_ids)
    for number in before:
        os.kill(number, signal.SIGKILL)
    _until(lambda: before.isdisjoint(pool.figures().process_ids))
    # Loading the kernels alone takes a second and a half of it.
    assert pool.queue().submit(time.process_time).result(PATIENCE_S) < 0.5


@LINUX
def test_workers_share_what_they_have_loaded(pool):
    from tests.load.chaos import origins_of

    (origin,) = origins_of(os.getpid())
    started(pool)
    assert all_memory_mb(origin) < 1.3 * memory_mb(origin)


@LINUX
def test_workers_outlive_the_process_that_they_are_forks_of_and_another_is_made(pool):
    from tests.load.chaos import origins_of

    (origin,) = origins_of(os.getpid())
    before = set(started(pool).figures().process_ids)
    os.kill(origin, signal.SIGKILL)
    _until(lambda: origins_of(os.getpid()) == [])
    assert pool.queue().submit(_where).result(PATIENCE_S) in before
    # What takes too long is ended all the same.
    with pytest.raises(InputError, match="takes more than"):
        pool.queue().submit(_within(_sleep, seconds=0.1), 600.0).result(PATIENCE_S)
    _until(lambda: len(before.symmetric_difference(pool.figures().process_ids)) == 2)
    for number in before:
        with contextlib.suppress(ProcessLookupError):
            os.kill(number, signal.SIGKILL)
    assert pool.queue().submit(_where).result(PATIENCE_S) not in before
    assert len(origins_of(os.getpid())) == 1
