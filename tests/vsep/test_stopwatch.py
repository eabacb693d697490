"""The stopwatch of a step's parts."""

import pytest

from vsep.inference.core import stopwatch
from vsep.inference.core.stopwatch import part


@pytest.fixture
def clock(monkeypatch):
    """A clock that moves by a second whenever it is read."""
    ticks = iter(range(100))
    monkeypatch.setattr(stopwatch, "computing_s", lambda: float(next(ticks)))


@pytest.mark.usefixtures("clock")
def test_parts_of_one_name_add_up():
    with stopwatch.stopwatch() as seconds:
        for name in ("objects", "burst search", "objects"):
            with part(name):
                pass
    assert seconds == {"objects": 2.0, "burst search": 1.0}


@pytest.mark.usefixtures("clock")
def test_a_part_that_fails_is_counted_all_the_same():
    with (
        stopwatch.stopwatch() as seconds,
        pytest.raises(ValueError, match="broken"),
        part("objects"),
    ):
        raise ValueError("broken")
    assert seconds == {"objects": 1.0}


def test_without_a_stopwatch_nothing_is_kept():
    with part("objects"):
        pass
    with stopwatch.stopwatch() as seconds:
        pass
    assert seconds == {}
