"""Commands that the system ends: nothing of them stays, and the code says so."""

import os
import signal
import time
import urllib.request
from pathlib import Path

from tests.app.cli.helpers import COMMAND, start_process
from tests.load.chaos import workers_of
from tests.load.classroom import serving

PATIENCE_S = 60.0


def _until(condition):
    deadline = time.monotonic() + PATIENCE_S
    while not condition():
        assert time.monotonic() < deadline, "waited in vain"
        time.sleep(0.05)


def _gone(process):
    return not Path(f"/proc/{process}").exists() or "Z" in _state(process)


def _state(process):
    try:
        return Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[0]
    except OSError:
        return "Z"


def test_a_study_that_is_terminated_keeps_its_rows_and_leaves_nothing(tmp_path, monkeypatch):
    temporary, rows = tmp_path / "temporary", tmp_path / "rows.jsonl"
    temporary.mkdir()
    monkeypatch.setenv("TMPDIR", str(temporary))
    options = ("study", "run", "fig-3", "--realizations", "500", "--workers", "2")
    process = start_process(COMMAND, *options, "--out", str(rows))
    _until(lambda: rows.exists() and rows.stat().st_size)
    workers = workers_of(process.pid)
    assert len(workers) == 2
    process.send_signal(signal.SIGTERM)
    _, said = process.communicate(timeout=PATIENCE_S)
    assert (process.returncode, said.splitlines()[-1]) == (143, "vsep: terminated.")
    assert "Traceback" not in said
    _until(lambda: all(_gone(worker) for worker in workers))
    assert list(temporary.iterdir()) == []


def test_a_server_that_is_terminated_removes_the_files_of_its_pages(tmp_path, monkeypatch):
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    with serving() as (process, url):
        with urllib.request.urlopen(url + "studies", timeout=PATIENCE_S) as page:
            page.read()
        _until(lambda: list(tmp_path.glob("vsep-studies-*")))
        workers = workers_of(process.pid)
        os.kill(process.pid, signal.SIGTERM)
        assert process.wait(PATIENCE_S) == 143
    assert workers
    _until(lambda: all(_gone(worker) for worker in workers))
    assert list(tmp_path.iterdir()) == []
