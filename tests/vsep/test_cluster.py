import json
import signal
import subprocess
import sys
import time

import pytest

from vsep import InputError
from vsep.studies.catalogue import make_study
from vsep.studies.cluster import run_on_cluster
from vsep.studies.engine import record_study
from vsep.studies.rows import read_rows

STUDY = make_study(
    "fig-3", realizations=25, methods=("object-only", "no-interference"), selection="15,30"
)


def comparable(rows):
    """Rows in one order, without the time they took."""
    stripped = [{key: value for key, value in row.items() if key != "seconds"} for row in rows]
    return sorted(repr(row) for row in stripped)


@pytest.fixture
def cluster(tmp_path, repository):
    """A scheduler and two worker processes on the loopback interface: (address, workers)."""
    pytest.importorskip("distributed")
    description = tmp_path / "scheduler.json"
    processes = []

    def start(*arguments):
        process = subprocess.Popen(
            [sys.executable, "-m", "dask", *arguments, "--no-dashboard"],
            cwd=repository,
            env={"PATH": "", "PYTHONPATH": str(repository), "OMP_NUM_THREADS": "1"},
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        processes.append(process)
        return process

    start("scheduler", "--host", "127.0.0.1", "--port", "0", "--scheduler-file", str(description))
    end = time.monotonic() + 60.0
    while not description.exists():
        assert time.monotonic() < end, "no scheduler"
        time.sleep(0.05)
    workers = [
        start(
            *("worker", "--scheduler-file", str(description), "--host", "127.0.0.1"),
            *("--nthreads", "1", "--no-nanny", "--local-directory", str(tmp_path / str(number))),
        )
        for number in range(2)
    ]
    yield json.loads(description.read_text())["address"], workers
    for process in reversed(processes):
        process.kill()
        process.wait()


@pytest.mark.cluster
def test_a_cluster_that_loses_a_worker_gives_the_same_rows_as_one_machine(cluster, tmp_path):
    address, workers = cluster
    here, there = tmp_path / "here.jsonl", tmp_path / "there.jsonl"
    list(record_study(STUDY, here))
    running = record_study(STUDY, there, scheduler=address)
    num_rows = 0
    killed = False
    for rows in running:
        num_rows += len(rows)
        if not killed and num_rows >= STUDY.num_rows // 2:
            workers[0].send_signal(signal.SIGKILL)
            killed = True
    assert killed
    assert workers[0].wait(timeout=10.0) == -signal.SIGKILL
    assert num_rows == STUDY.num_rows
    assert len(there.read_text().splitlines()) == STUDY.num_rows
    assert {row["status"] for row in read_rows(there)} == {"done"}
    assert comparable(read_rows(there)) == comparable(read_rows(here))


def test_a_scheduler_that_does_not_answer_is_named(monkeypatch):
    pytest.importorskip("distributed")
    monkeypatch.setattr("vsep.studies.cluster._CONNECT_S", 0.5)
    # Port 9 of this machine, where nobody listens.
    with pytest.raises(InputError, match=r"tcp://127\.0\.0\.1:9"):
        list(run_on_cluster([STUDY.trial(15, 0)], "tcp://127.0.0.1:9"))


def test_without_dask_the_extra_is_named(monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(InputError, match=r"vsep\[cluster\]"):
        list(run_on_cluster([STUDY.trial(15, 0)], "tcp://127.0.0.1:9"))
