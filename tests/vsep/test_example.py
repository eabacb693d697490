import numpy as np
import pytest

from vsep.studies.catalogue import make_study
from vsep.studies.example import example_panels
from vsep.studies.rows import trial_of_row
from vsep.studies.trial import failed_rows, run_trial


@pytest.fixture(scope="module")
def example_rows():
    study = make_study("fig-2", methods=("factorised", "object-only"))
    return run_trial(study.trial(0, 0))


def test_a_row_names_the_trial_that_made_it(example_rows):
    trial = trial_of_row(example_rows[1])
    (again,) = run_trial(trial)
    changing = {"seconds"}
    assert {k: v for k, v in again.items() if k not in changing} == {
        k: v for k, v in example_rows[1].items() if k not in changing
    }


def test_an_example_shows_both_domains_once(example_rows):
    fast_time, delay = example_panels(example_rows)
    assert fast_time.title == delay.title == "Fig. 2: factorised, SNR 30 dB, SIR -15 dB"
    (received,) = [series for series in fast_time.series if series.label == "received"]
    assert len(received.x) == 256
    (truth,) = [series for series in delay.series if series.label == "true object"]
    (found,) = [series for series in delay.series if series.label == "estimated object"]
    # 80.06 ns are 12.0007 m; a standard deviation is 3.6 mm.
    assert truth.x == pytest.approx([12.0], abs=1e-3)
    assert np.min(np.abs(found.x - 12.0)) < 0.02
    assert truth.y == pytest.approx([0.0], abs=1e-9)
    for series in (*fast_time.series, *delay.series):
        assert np.all(np.diff(series.x) >= 0.0)
        assert np.all(series.y >= series.low)


def test_statistics_and_failures_are_passed_over(example_rows):
    failed = failed_rows(make_study("fig-4").trial(0, 0), "on purpose")
    other = [{**row, "study": "fig-3"} for row in example_rows]
    assert example_panels([*failed, *other]) == []
