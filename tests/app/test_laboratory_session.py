import threading
import time

import pytest

from app.laboratory import session as laboratory_session
from app.laboratory.session import LaboratorySession, Progress
from vsep.laboratory import cells
from vsep.laboratory.answers import Answers
from vsep.laboratory.axes import parse_axis
from vsep.laboratory.question import Question
from vsep.studies.trial import failed_rows


def question(**changes):
    return Question(x=parse_axis("sir_db=-40:40:9"), y=parse_axis("snr_db=20:60:9"), **changes)


@pytest.fixture(autouse=True)
def slow_engine(monkeypatch):
    """An engine that takes five milliseconds a trial, needs no processes, and starts at once."""

    def run(trials, *, workers, stop):
        assert workers == 1
        for trial in trials:
            if stop.is_set():
                return
            time.sleep(0.005)
            yield failed_rows(trial, "not computed")

    monkeypatch.setattr(cells, "run_on_processes", run)
    monkeypatch.setattr(laboratory_session, "SETTLE_S", 0.01)


def until(condition):
    deadline = time.monotonic() + 20.0
    while not condition():
        assert time.monotonic() < deadline, "waited in vain"
        time.sleep(0.005)


def test_the_trials_of_a_question_run_to_their_end_and_are_known_afterwards():
    answers, maps = Answers(), question(trials=1)
    session = LaboratorySession(maps, answers)
    assert session.snapshot().progress is Progress.IDLE
    session.ask(maps)
    session.wait()
    assert session.snapshot().progress is Progress.FINISHED
    assert len(session.snapshot().findings) == session.snapshot().num_cells == 81
    again = LaboratorySession(maps, answers)
    assert len(again.snapshot().findings) == 81


def test_another_question_gives_the_trials_up_and_coming_back_goes_on():
    answers = Answers()
    first, second = question(trials=2), question(trials=0)
    session = LaboratorySession(first, answers)
    session.ask(first)
    until(lambda: session.snapshot().findings)
    session.ask(second)
    session.wait()
    assert session.snapshot().progress is Progress.IDLE
    assert session.snapshot().findings == {}
    held = len(answers.of(first))
    assert 0 < held < 81
    session.ask(first)
    session.wait()
    assert len(session.snapshot().findings) == 81


def test_pages_wait_for_their_turn(monkeypatch):
    turn = threading.BoundedSemaphore(1)
    monkeypatch.setattr(laboratory_session, "turns", lambda: turn)
    first, second = (LaboratorySession(question(), Answers()) for _ in range(2))
    first.ask(question(trials=3))
    until(lambda: first.snapshot().progress is Progress.RUNNING)
    second.ask(question(trials=1))
    time.sleep(0.05)
    assert second.snapshot().progress is Progress.WAITING
    first.stop()
    until(lambda: second.snapshot().progress is Progress.FINISHED)


def test_an_error_is_told_and_the_turn_is_given_back(monkeypatch, caplog):
    def bug(trials, *, workers, stop):
        del trials, workers, stop
        raise ZeroDivisionError("on purpose")

    monkeypatch.setattr(cells, "run_on_processes", bug)
    session = LaboratorySession(question(), Answers())
    session.ask(question(trials=1))
    session.wait()
    snapshot = session.snapshot()
    assert snapshot.progress is Progress.BROKEN
    assert snapshot.error == "The trials ended by an error (ZeroDivisionError: on purpose)."
    assert "the trials of a map failed" in caplog.text
    assert laboratory_session.turns().acquire(timeout=1.0)
    laboratory_session.turns().release()
