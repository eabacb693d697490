import time

import pytest
from vsep_app.pages.studies.session import StudyPhase, StudySession, time_left_s

from vsep import InputError
from vsep.studies.catalogue import make_study
from vsep.studies.engine import record_study
from vsep.studies.retries import unnoticed
from vsep.studies.rows import rows_text
from vsep.studies.trial import ABRUPT_END, failed_rows


def quick_study(realizations=3):
    methods = ("object-only", "no-interference")
    return make_study("fig-3", realizations=realizations, methods=methods, selection="15,30")


@pytest.fixture
def slow_engine(monkeypatch):
    """An engine that takes a hundredth of a second a trial and needs no processes."""

    def run(trials, *, workers, stop, retried):
        assert (workers, retried) == (1, unnoticed)
        for trial in trials:
            if stop is not None and stop.is_set():
                return
            time.sleep(0.01)
            yield failed_rows(trial, "not computed")

    monkeypatch.setattr("vsep.studies.engine.run_on_processes", run)


def test_a_study_runs_to_its_end(tmp_path):
    session = StudySession(quick_study(1), tmp_path / "rows.jsonl")
    assert session.snapshot().phase is StudyPhase.STOPPED
    session.start()
    session.wait()
    snapshot = session.snapshot()
    assert snapshot.phase is StudyPhase.FINISHED
    assert len(snapshot.rows) == snapshot.num_rows == 4
    assert snapshot.num_failed == 0


@pytest.mark.usefixtures("slow_engine")
def test_a_stopped_study_goes_on_where_it_was(tmp_path):
    path = tmp_path / "rows.jsonl"
    session = StudySession(quick_study(40), path)
    session.start()
    while not session.snapshot().rows:
        time.sleep(0.005)
    session.stop()
    session.wait()
    stopped = session.snapshot()
    assert stopped.phase is StudyPhase.STOPPED
    assert 0 < len(stopped.rows) < stopped.num_rows
    session.start()
    session.start()
    session.wait()
    snapshot = session.snapshot()
    assert snapshot.phase is StudyPhase.FINISHED
    assert snapshot.rows[: len(stopped.rows)] == stopped.rows
    assert len(snapshot.rows) == snapshot.num_rows == len(path.read_text().splitlines())
    assert snapshot.num_failed == snapshot.num_rows


@pytest.mark.usefixtures("slow_engine")
def test_what_the_command_line_has_begun_is_there(tmp_path):
    path = tmp_path / "rows.jsonl"
    list(record_study(quick_study(5), path))
    part = StudySession(quick_study(2), path)
    assert part.snapshot().phase is StudyPhase.FINISHED
    assert len(part.snapshot().rows) == 8
    more = StudySession(quick_study(6), path)
    assert more.snapshot().phase is StudyPhase.STOPPED
    assert len(more.snapshot().rows) == 20


def test_rows_of_killed_workers_are_made_again_by_a_start(tmp_path):
    path, study = tmp_path / "rows.jsonl", quick_study(1)
    list(record_study(quick_study(1), path))
    killed = failed_rows(study.trial(30, 0), ABRUPT_END)
    path.write_text(path.read_text() + rows_text(killed))
    session = StudySession(study, path)
    assert session.snapshot().phase is StudyPhase.STOPPED
    assert session.snapshot().num_failed == 2
    session.start()
    session.wait()
    snapshot = session.snapshot()
    assert snapshot.phase is StudyPhase.FINISHED
    assert (len(snapshot.rows), snapshot.num_failed) == (4, 0)


def test_a_file_of_something_else_is_refused(tmp_path):
    path = tmp_path / "notes.txt"
    path.write_text("my notes\n")
    with pytest.raises(InputError, match=r"notes\.txt"):
        StudySession(quick_study(), path)


def test_an_error_of_the_engine_is_told_and_can_be_tried_again(tmp_path):
    folder = tmp_path / "gone"
    session = StudySession(quick_study(1), folder / "rows.jsonl")
    session.start()
    session.wait()
    snapshot = session.snapshot()
    assert snapshot.phase is StudyPhase.BROKEN
    assert "rows.jsonl" in snapshot.error
    folder.mkdir()
    session.start()
    session.wait()
    assert session.snapshot().phase is StudyPhase.FINISHED
    assert session.snapshot().error == ""


def test_stopping_what_does_not_run_changes_nothing(tmp_path):
    session = StudySession(quick_study(1), tmp_path / "rows.jsonl")
    session.stop()
    session.wait()
    assert session.snapshot().phase is StudyPhase.STOPPED


def test_whatever_ends_the_engine_is_one_sentence_and_the_session_goes_on(
    tmp_path, monkeypatch, caplog
):
    def bug(trials, *, workers, stop, retried):
        del workers, stop, retried
        yield failed_rows(next(iter(trials)), "not computed")
        raise ZeroDivisionError("nobody foresaw this")

    session = StudySession(quick_study(1), tmp_path / "rows.jsonl")
    with monkeypatch.context() as patched:
        patched.setattr("vsep.studies.engine.run_on_processes", bug)
        session.start()
        session.wait()
    snapshot = session.snapshot()
    assert snapshot.phase is StudyPhase.BROKEN
    assert snapshot.error == "The study ended by an error (ZeroDivisionError: nobody foresaw this)."
    assert "a study failed" in caplog.text
    assert len(snapshot.rows) == 2
    session.start()
    session.wait()
    assert session.snapshot().phase is StudyPhase.FINISHED
    assert len(session.snapshot().rows) == session.snapshot().num_rows


@pytest.mark.usefixtures("slow_engine")
def test_time_left_counts_only_the_rows_of_this_run(tmp_path):
    path = tmp_path / "rows.jsonl"
    list(record_study(quick_study(20), path))
    session = StudySession(quick_study(400), path)
    assert session.snapshot().left_s is None
    session.start()
    assert session.snapshot().left_s is None  # too few to tell
    while (snapshot := session.snapshot()).left_s is None:
        time.sleep(0.005)
    session.stop()
    session.wait()
    # A trial of two rows takes 10 ms at least, so what is missing takes this long at least; at the
    # pace of all rows that are there it would be a twentieth of it.
    assert snapshot.left_s >= 0.005 * (snapshot.num_rows - len(snapshot.rows))
    assert session.snapshot().left_s is None
    assert time_left_s(10.0, 20, 60) == 30.0
