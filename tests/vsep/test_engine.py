import multiprocessing
import os
import signal
import subprocess
import sys
import threading
import time
from dataclasses import replace
from pathlib import Path

import pytest

from vsep import InputError
from vsep.studies.catalogue import make_study
from vsep.studies.engine import finished_keys, pending_trials, record_study, run_on_processes
from vsep.studies.rows import read_rows, row_key, rows_text
from vsep.studies.trial import run_trial

QUICK = ("object-only", "no-interference")


def quick_study(realizations=3, selection="15,30"):
    return make_study("fig-3", realizations=realizations, methods=QUICK, selection=selection)


def comparable(rows):
    """Rows in one order, without the time they took."""
    stripped = [{key: value for key, value in row.items() if key != "seconds"} for row in rows]
    # Through repr, where NaN equals itself.
    return sorted(repr(row) for row in stripped)


def direct_rows(study):
    return [row for trial in pending_trials(study, ()) for row in run_trial(trial)]


def as_read(rows, tmp_path):
    path = tmp_path / "direct.jsonl"
    path.write_text(rows_text(rows))
    return read_rows(path)


@pytest.mark.parametrize("workers", [1, 2])
def test_rows_do_not_depend_on_the_workers(tmp_path, workers):
    study = quick_study()
    path = tmp_path / "rows.jsonl"
    yielded = [row for rows in record_study(study, path, workers=workers) for row in rows]
    expected = comparable(as_read(direct_rows(study), tmp_path))
    assert comparable(read_rows(path)) == expected
    assert len(yielded) == study.num_rows == len(expected)


def test_a_stopped_study_goes_on_with_nothing_lost_and_nothing_twice(tmp_path):
    study = quick_study()
    path = tmp_path / "rows.jsonl"
    running = record_study(study, path)
    next(running)
    running.close()
    text = path.read_text()
    # A whole trial is there; tear the second of its two rows.
    path.write_text(text[: len(text) // 2 + 50])
    assert len(finished_keys(study, path)) == 1
    resumed = [row for rows in record_study(study, path) for row in rows]
    assert len(resumed) == study.num_rows - 1
    assert len(path.read_text().splitlines()) == study.num_rows
    assert comparable(read_rows(path)) == comparable(as_read(direct_rows(study), tmp_path))
    assert list(record_study(study, path)) == []


def test_more_realizations_add_to_what_is_there(tmp_path):
    path = tmp_path / "rows.jsonl"
    list(record_study(quick_study(1, "15"), path))
    more = quick_study(2, "15,30")
    added = [row for rows in record_study(more, path) for row in rows]
    assert len(added) == 6
    assert comparable(read_rows(path)) == comparable(as_read(direct_rows(more), tmp_path))


def test_all_points_grow_together():
    order = [(t.realization, t.point_index) for t in pending_trials(quick_study(2), ())]
    assert order == [(0, 15), (0, 30), (1, 15), (1, 30)]


def test_only_missing_methods_are_run_again():
    study = quick_study(1, "15")
    finished = {("fig-3", 15, 0, "object-only")}
    (trial,) = pending_trials(study, finished)
    assert trial.methods == ("no-interference",)


def test_a_file_of_another_seed_is_refused_before_anything_runs(tmp_path):
    path = tmp_path / "rows.jsonl"
    study = quick_study(1, "15")
    list(record_study(study, path))
    other = replace(study, settings=replace(study.settings, seed=2))
    before = path.read_text()
    with pytest.raises(InputError, match="seed 1; it is 2 now"):
        list(record_study(other, path))
    assert path.read_text() == before


@pytest.mark.parametrize("workers", [0, 5000])
def test_a_senseless_number_of_workers_is_refused(tmp_path, workers):
    with pytest.raises(InputError, match="workers"):
        list(record_study(quick_study(), tmp_path / "rows.jsonl", workers=workers))


def test_setting_stop_ends_the_workers_amid_a_trial_and_nothing_is_lost(tmp_path):
    # A trial of Simulation II takes all methods seconds: the first row is far off.
    study = make_study("fig-5", realizations=1, selection="20-24")
    path, stop = tmp_path / "rows.jsonl", threading.Event()
    before = set(multiprocessing.active_children())
    running = record_study(study, path, workers=2, stop=stop)
    seen = []

    def stop_once_there_are_workers():
        wait_until(lambda: len(set(multiprocessing.active_children()) - before) == 2)
        seen.extend(set(multiprocessing.active_children()) - before)
        stop.set()

    helper = threading.Thread(target=stop_once_there_are_workers)
    helper.start()
    rows = list(running)
    helper.join()
    assert len(rows) < 5
    assert not any(process.is_alive() for process in seen)
    finished = finished_keys(study, path)
    # A study that was stopped before its first row leaves no file.
    lines = path.read_text().splitlines() if rows else []
    assert len(finished) == len(lines) == 4 * len(rows)
    assert path.exists() == bool(rows)


def test_workers_use_one_thread_and_the_environment_comes_back(monkeypatch):
    monkeypatch.setenv("OMP_NUM_THREADS", "7")
    monkeypatch.delenv("MKL_NUM_THREADS", raising=False)
    running = run_on_processes([quick_study().trial(15, 0)], workers=1)
    next(running)
    assert os.environ["OMP_NUM_THREADS"] == "1"
    assert list(running) == []
    assert os.environ["OMP_NUM_THREADS"] == "7"
    assert "MKL_NUM_THREADS" not in os.environ


@pytest.mark.scenario
def test_a_trial_that_takes_its_process_down_is_a_failed_row_and_the_others_finish():
    study = quick_study(2)
    trials = list(pending_trials(study, ()))
    others = set(multiprocessing.active_children())
    running = run_on_processes(trials, workers=2)
    stop = threading.Event()

    def kill_all():
        while not stop.is_set():
            for child in set(multiprocessing.active_children()) - others:
                child.kill()
            time.sleep(0.01)

    killer = threading.Thread(target=kill_all)
    killer.start()
    rows = next(running)
    stop.set()
    killer.join()
    rows += [row for more in running for row in more]
    assert {row_key(row) for row in rows} == {row_key(row) for row in direct_rows(study)}
    assert len(rows) == study.num_rows
    reasons = [row["reason"] for row in rows if row["status"] == "failed"]
    assert set(reasons) == {"the worker process ended abruptly"}
    assert len(reasons) == 2


def children_of(pid):
    listing = Path(f"/proc/{pid}/task/{pid}/children").read_text()
    return [int(child) for child in listing.split()]


def is_running(pid):
    try:
        state = Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()[0]
    except FileNotFoundError:
        return False
    return state != "Z"


def wait_until(condition, seconds=60.0):
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end, "waited too long"
        time.sleep(0.02)


@pytest.mark.scenario
@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="looks processes up in /proc")
def test_a_killed_study_leaves_no_process_behind_and_resumes(tmp_path, repository):
    path = tmp_path / "rows.jsonl"
    study = quick_study(60)
    code = "import sys\nfrom vsep_app.cli.main import main\nsys.exit(main(sys.argv[1:]))"
    arguments = ["study", "run", "fig-3", "--points", "15,30", "--realizations", "60"]
    arguments += ["--workers", "2", "--out", str(path)]
    for method in QUICK:
        arguments += ["--estimator", method]
    process = subprocess.Popen(
        [sys.executable, "-c", code, *arguments], cwd=repository, stderr=subprocess.DEVNULL
    )
    wait_until(lambda: path.exists() and path.read_bytes().count(b"\n") >= 20)
    workers = children_of(process.pid)
    process.send_signal(signal.SIGKILL)
    process.wait()
    wait_until(lambda: not any(is_running(pid) for pid in workers), seconds=20.0)
    done = len(read_rows(path))
    assert 20 <= done < study.num_rows
    resumed = [row for rows in record_study(study, path, workers=2) for row in rows]
    assert done + len(resumed) == study.num_rows
    assert len(path.read_text().splitlines()) == study.num_rows
    assert comparable(read_rows(path)) == comparable(as_read(direct_rows(study), tmp_path))
