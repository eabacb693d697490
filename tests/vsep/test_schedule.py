"""When the ramps are searched, and the names of the schedules."""

import pytest

from vsep.errors import InputError
from vsep.inference.core.schedule import PAPER, ROBUST, schedule_by_name, schedule_for
from vsep.signal.filters import RaisedCosineFilter
from vsep.signal.template import SignalModel


def test_robust_schedule_searches_early_and_keeps_looking():
    due = [iteration for iteration in range(24) if ROBUST.search_due(iteration)]
    assert due == [0, 2, 4, 6, 8, 10, 12, 16, 20]


@pytest.mark.parametrize(
    ("num_samples", "due"), [(256, [0, 2, 4, 6, 8, 10, 12]), (512, [0, 2, 6, 12])]
)
def test_long_ramps_are_searched_less_often(num_samples, due):
    model = SignalModel(
        num_ramps=4,
        num_samples=num_samples,
        sample_rate_hz=1e7,
        anti_aliasing_filter=RaisedCosineFilter(cutoff_hz=2e6, rolloff=0.25),
    )
    schedule = schedule_for("robust", model)
    assert [iteration for iteration in range(13) if schedule.search_due(iteration)] == due


def test_paper_schedule_searches_once():
    assert [iteration for iteration in range(100) if PAPER.search_due(iteration)] == [0]


def test_schedules_have_names():
    assert schedule_by_name("robust") is ROBUST
    assert schedule_by_name("paper") is PAPER
    with pytest.raises(InputError, match="schedule is ''; it must be one of robust, paper"):
        schedule_by_name("")
