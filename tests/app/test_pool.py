import os
import signal
import threading
import time
from concurrent.futures import wait

import pytest
from vsep_app.jobs import pool as pool_module
from vsep_app.jobs.pool import SLOW_JOB_S, WorkerPool

from tests.app.test_run_session import _state, _step
from vsep.errors import InputError
from vsep.inference.core.progress import Step
from vsep.inference.core.state import SeparationState

# Room for a busy machine: nothing waits for its end.
PATIENCE_S = 60.0


@pytest.fixture(scope="module")
def pool():
    """Two workers."""
    workers = WorkerPool((Step, SeparationState), workers=2)
    yield workers
    workers.close()


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
    monkeypatch.setattr(pool_module, "MAX_UNWANTED_S", 10 * PATIENCE_S)
    queue = pool.queue()
    long = queue.submit(_wait_for, tmp_path / "end")
    _until(lambda: pool.figures().at_work == 1)
    long.cancel()
    # The job that was given up goes on as long as there is no such file.
    assert queue.submit(_where).result(PATIENCE_S) in pool.figures().process_ids
    (tmp_path / "end").touch()
    _until(lambda: pool.figures().at_work == 0)


def test_a_worker_that_nobody_waits_for_is_ended_and_replaced(pool, monkeypatch):
    monkeypatch.setattr(pool_module, "MAX_UNWANTED_S", 0.1)
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
    for number in pool.figures().process_ids:
        os.kill(number, signal.SIGKILL)
    _until(lambda: not any(worker.alive for worker in pool._workers))
    desks = [pool.queue() for _ in range(4)]
    places = {job.result(PATIENCE_S) for job in [queue.submit(_where) for queue in desks]}
    assert places <= set(pool.figures().process_ids)
    assert caplog.text == ""


def test_a_closed_queue_takes_no_jobs(pool):
    queue = pool.queue()
    queue.close()
    assert queue.submit(_where).cancelled()


PREPARED = []


def _prepare():
    PREPARED.append(os.getpid())


def _prepare_in_vain():
    raise OSError("nothing is there")


def _prepared():
    return os.getpid(), list(PREPARED)


def test_every_worker_prepares_before_its_first_job():
    workers = WorkerPool((), workers=2, prepare=_prepare)
    for _ in range(4):
        process, prepared = workers.queue().submit(_prepared).result(PATIENCE_S)
        assert prepared == [process]
    workers.close()


def test_a_worker_that_cannot_prepare_does_its_jobs_all_the_same():
    workers = WorkerPool((), workers=1, prepare=_prepare_in_vain)
    assert workers.queue().submit(_same, 3).result(PATIENCE_S) == 3
    workers.close()
