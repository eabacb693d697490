import os
import signal
import socket
import subprocess
import sys

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


class Cluster:
    """A scheduler and two worker processes on the loopback interface."""

    def __init__(self, folder, repository):
        self._folder, self._repository = folder, repository
        with socket.socket() as free:
            free.bind(("127.0.0.1", 0))
            self.port = free.getsockname()[1]
        self.address = f"tcp://127.0.0.1:{self.port}"
        self._processes = []
        self.start()

    def start(self):
        """Start a scheduler and two workers."""
        self.scheduler = self._dask("scheduler", "--host", "127.0.0.1", "--port", str(self.port))
        self.workers = [
            self._dask(
                *("worker", self.address, "--host", "127.0.0.1", "--nthreads", "1", "--no-nanny"),
                *("--local-directory", str(self._folder / str(number))),
            )
            for number in range(2)
        ]

    def _dask(self, *arguments):
        process = subprocess.Popen(
            [sys.executable, "-m", "dask", *arguments, "--no-dashboard"],
            cwd=self._repository,
            # Of another kind of core the linear algebra rounds otherwise.
            env={name: value for name, value in os.environ.items() if "BLAS" in name}
            | {
                "PATH": "",
                "PYTHONPATH": os.pathsep.join([str(self._repository), f"{self._repository}/app"]),
                "OMP_NUM_THREADS": "1",
            },
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        self._processes.append(process)
        return process

    def kill(self):
        """End all of it."""
        for process in reversed(self._processes):
            process.kill()
            process.wait()


@pytest.fixture
def cluster(tmp_path, repository):
    pytest.importorskip("distributed")
    made = Cluster(tmp_path, repository)
    yield made
    made.kill()


@pytest.mark.cluster
def test_a_cluster_that_loses_a_worker_and_the_scheduler_gives_the_rows_of_one_machine(
    cluster, tmp_path
):
    here, there = tmp_path / "here.jsonl", tmp_path / "there.jsonl"
    list(record_study(STUDY, here))
    num_rows = 0
    for rows in record_study(STUDY, there, scheduler=cluster.address):
        num_rows += len(rows)
        if num_rows == STUDY.num_rows // 5:
            cluster.workers[0].kill()
            assert cluster.workers[0].wait(timeout=10.0) == -signal.SIGKILL
        if num_rows == STUDY.num_rows // 2:
            # All that the workers are at is lost, and so are they.
            cluster.kill()
            assert cluster.scheduler.returncode == -signal.SIGKILL
            cluster.start()
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
