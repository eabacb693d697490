import sys

import pytest

from vsep.studies.catalogue import make_study
from vsep.studies.engine import finished_keys, record_study
from vsep.studies.retries import ATTEMPTS, with_retries
from vsep.studies.rows import read_rows, row_key, rows_text
from vsep.studies.trial import ABRUPT_END, failed_rows, is_missing, reason_of, run_trial

METHODS = ("object-only", "no-interference")
STUDY = make_study("fig-3", realizations=2, methods=METHODS, selection="15")
TRIALS = [STUDY.trial(15, 0), STUDY.trial(15, 1)]


@pytest.mark.parametrize(
    ("reason", "missing"),
    [
        (ABRUPT_END, True),
        (reason_of(MemoryError("Unable to allocate 2 GiB")), True),
        (reason_of(OSError(28, "No space left on device")), True),
        (reason_of(ConnectionResetError("by peer")), True),
        ("KilledWorker: run_trial", True),
        (reason_of(ValueError("snr_db is 1e9")), False),
        ("on purpose", False),
    ],
)
def test_what_memory_disk_network_and_processes_did_not_give_is_missing(reason, missing):
    assert {is_missing(row) for row in failed_rows(TRIALS[0], reason)} == {missing}


def done(trial):
    return [{**row, "status": "done", "reason": None} for row in failed_rows(trial, "none")]


class Failing:
    """Runs trials; one method of the first has no memory for a number of times."""

    def __init__(self, times):
        self.times, self.ran = times, []

    def __call__(self, trials, attempts):
        for trial in trials:
            self.ran.append((attempts, trial.realization, trial.methods))
            rows = done(trial)
            if trial.realization == 0 and attempts < self.times:
                rows[0] = failed_rows(trial, "MemoryError: none left")[0]
            yield trial, rows


def test_a_row_without_memory_is_made_again_when_the_others_are_done():
    run, retried = Failing(1), []
    rows = [row for some in with_retries(run, TRIALS, retried.append) for row in some]
    assert [row["status"] for row in rows] == ["done"] * 4
    assert {row_key(row) for row in rows} == {row_key(row) for t in TRIALS for row in done(t)}
    assert run.ran == [(0, 0, METHODS), (0, 1, METHODS), (1, 0, METHODS[:1])]
    assert [row["method"] for row in retried] == [METHODS[0]]


def test_a_row_that_never_has_memory_is_failed_after_a_few_attempts():
    run = Failing(99)
    rows = [row for some in with_retries(run, TRIALS) for row in some]
    assert len(run.ran) == 2 + ATTEMPTS - 1
    assert [row["reason"] for row in rows if row["status"] == "failed"] == [
        "MemoryError: none left"
    ]
    assert len(rows) == 4


def test_rows_of_killed_workers_are_made_again_by_the_next_run(tmp_path):
    path = tmp_path / "rows.jsonl"
    whole = run_trial(TRIALS[0])
    path.write_text(rows_text([*whole, *failed_rows(TRIALS[1], ABRUPT_END)]))
    assert finished_keys(STUDY, path) == {row_key(row) for row in whole}
    made = [row for rows in record_study(STUDY, path) for row in rows]
    assert {row["realization"] for row in made} == {1}
    assert [row["status"] for row in read_rows(path)] == ["done"] * 4
    assert list(record_study(STUDY, path)) == []


def test_rows_that_failed_for_a_reason_of_their_own_are_not_made_again(tmp_path):
    path = tmp_path / "rows.jsonl"
    path.write_text(rows_text([row for t in TRIALS for row in failed_rows(t, "on purpose")]))
    assert list(record_study(STUDY, path)) == []


def test_a_second_run_on_the_rows_of_a_first_is_refused_and_tears_nothing(tmp_path, monkeypatch):
    def slow(trials, **_):
        for trial in trials:
            yield failed_rows(trial, "on purpose")

    monkeypatch.setattr("vsep.studies.engine.run_on_processes", slow)
    path = tmp_path / "rows.jsonl"
    first = record_study(STUDY, path)
    next(first)
    with pytest.raises(ValueError, match="Another run writes into"):
        next(record_study(STUDY, path))
    assert len(list(first)) == 1
    assert len(read_rows(path)) == 4


def test_without_dask_no_empty_file_is_left(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(ValueError, match=r"vsep\[cluster\]"):
        list(record_study(STUDY, tmp_path / "rows.jsonl", scheduler="tcp://127.0.0.1:9"))
    assert list(tmp_path.iterdir()) == []


def test_the_tail_that_a_lost_machine_left_is_cut_off_before_rows_are_written(tmp_path):
    path = tmp_path / "rows.jsonl"
    whole = rows_text(run_trial(TRIALS[0]))
    path.write_bytes(whole.encode() + b'{"study": "fig-3", "poi' + bytes(1000))
    list(record_study(STUDY, path))
    content = path.read_bytes()
    assert content.startswith(whole.encode())
    assert b"\0" not in content
    assert len(content.splitlines()) == len(read_rows(path)) == 4
