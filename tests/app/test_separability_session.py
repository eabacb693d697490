import threading
import time

import pytest
from vsep_app.pages.separability import session as separability_session
from vsep_app.pages.separability.session import Progress, SeparabilitySession

from vsep.separability import cells
from vsep.separability.axes import parse_axis
from vsep.separability.map_cache import MapCache
from vsep.separability.map_spec import MapSpec
from vsep.studies.trial import failed_rows


def spec(**changes):
    return MapSpec(x=parse_axis("sir_db=-40:40:9"), y=parse_axis("snr_db=20:60:9"), **changes)


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
    monkeypatch.setattr(separability_session, "SETTLE_S", 0.01)


def until(condition):
    deadline = time.monotonic() + 20.0
    while not condition():
        assert time.monotonic() < deadline, "waited in vain"
        time.sleep(0.005)


def test_the_trials_of_a_spec_run_to_their_end_and_are_known_afterwards():
    cache, maps = MapCache(), spec(trials=1)
    session = SeparabilitySession(maps, cache)
    assert session.snapshot().progress is Progress.IDLE
    session.ask(maps)
    session.wait()
    assert session.snapshot().progress is Progress.FINISHED
    assert len(session.snapshot().cell_results) == session.snapshot().num_cells == 81
    again = SeparabilitySession(maps, cache)
    assert len(again.snapshot().cell_results) == 81


def test_another_spec_gives_the_trials_up_and_coming_back_goes_on():
    cache = MapCache()
    first, second = spec(trials=2), spec(trials=0)
    session = SeparabilitySession(first, cache)
    session.ask(first)
    until(lambda: session.snapshot().cell_results)
    session.ask(second)
    session.wait()
    assert session.snapshot().progress is Progress.IDLE
    assert session.snapshot().cell_results == {}
    held = len(cache.of(first))
    assert 0 < held < 81
    session.ask(first)
    session.wait()
    assert len(session.snapshot().cell_results) == 81


def test_pages_wait_for_their_turn(monkeypatch):
    turn = threading.BoundedSemaphore(1)
    monkeypatch.setattr(separability_session, "turns", lambda: turn)
    first, second = (SeparabilitySession(spec(), MapCache()) for _ in range(2))
    first.ask(spec(trials=3))
    until(lambda: first.snapshot().progress is Progress.RUNNING)
    second.ask(spec(trials=1))
    time.sleep(0.05)
    assert second.snapshot().progress is Progress.WAITING
    first.stop()
    until(lambda: second.snapshot().progress is Progress.FINISHED)


def test_an_error_is_told_and_the_turn_is_given_back(monkeypatch, caplog):
    def bug(trials, *, workers, stop):
        del trials, workers, stop
        raise ZeroDivisionError("on purpose")

    monkeypatch.setattr(cells, "run_on_processes", bug)
    session = SeparabilitySession(spec(), MapCache())
    session.ask(spec(trials=1))
    session.wait()
    snapshot = session.snapshot()
    assert snapshot.progress is Progress.BROKEN
    assert snapshot.error == "The trials ended by an error (ZeroDivisionError: on purpose)."
    assert "the trials of a map failed" in caplog.text
    assert separability_session.turns().acquire(timeout=1.0)
    separability_session.turns().release()
