"""When the ramps are searched, and the names of the schedules."""

import pytest

from vsep.errors import InputError
from vsep.inference.core.schedule import PAPER, ROBUST, schedule_by_name


def test_robust_schedule_searches_early_and_keeps_looking():
    due = [iteration for iteration in range(24) if ROBUST.search_due(iteration)]
    assert due == [0, 2, 4, 6, 8, 10, 12, 16, 20]


def test_paper_schedule_searches_once():
    assert [iteration for iteration in range(100) if PAPER.search_due(iteration)] == [0]


def test_schedules_have_names():
    assert schedule_by_name("robust") is ROBUST
    assert schedule_by_name("paper") is PAPER
    with pytest.raises(InputError, match="schedule is ''; it must be one of robust, paper"):
        schedule_by_name("")
