"""Worker processes: their threads, the cores there are, and what is done without them."""

import errno
import multiprocessing.synchronize
import os

from vsep._processes import available_cores, worker_pool


def test_workers_have_one_thread_each_and_the_parent_keeps_its_own(monkeypatch):
    monkeypatch.setenv("OMP_NUM_THREADS", "3")
    monkeypatch.delenv("MKL_NUM_THREADS", raising=False)
    with worker_pool(1) as pool:
        assert pool.submit(os.getenv, "OMP_NUM_THREADS").result() == "1"
    assert os.environ["OMP_NUM_THREADS"] == "3"
    assert "MKL_NUM_THREADS" not in os.environ


def test_there_is_a_core():
    assert 1 <= available_cores() <= os.cpu_count()


def _square(number):
    return number * number, os.getpid()


def test_without_shared_semaphores_this_process_does_the_work(monkeypatch, capsys):
    def refuse(*_, **__):
        raise OSError(errno.ENOSYS, os.strerror(errno.ENOSYS))

    monkeypatch.setattr(multiprocessing.synchronize.SemLock, "__init__", refuse)
    with worker_pool(3) as pool:
        done = list(pool.map(_square, range(4), chunksize=2))
    assert done == [(number * number, os.getpid()) for number in range(4)]
    (sentence,) = capsys.readouterr().err.splitlines()
    assert sentence.startswith("vsep: no worker processes ([Errno ")
    assert sentence.endswith("this one does the work.")
