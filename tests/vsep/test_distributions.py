from dataclasses import replace

import numpy as np
import pytest
from scipy import stats

from vsep.studies.distributions import box_panels, quantile_panels
from vsep.studies.groups import Group
from vsep.studies.panel_specs import BoxSpec, QuantileSpec

STRONG = BoxSpec(panel="5d-f", title="boxes", snr_db=60.0, sir_db=15.0)
POOLED = QuantileSpec(panel="3b", title="quantiles")


def group(point, **columns):
    count = len(next(iter(columns.values())))
    rows = [
        {"point": point, **{name: values[index] for name, values in columns.items()}}
        for index in range(count)
    ]
    nothing = (None,) * count
    return Group(rows=tuple(rows), references=nothing, masked=nothing, num_failed=0)


def test_boxes_have_quartiles_whiskers_and_outliers():
    values = [*np.arange(1.0, 10.0), 100.0]
    point = {"panel": "5d-f", "snr_db": 60.0, "sir_db": 15.0}
    frames = group(point, misses=values, false_alarms=values, errors=[[value] for value in values])
    grouped = {("fig-5", 0, "factorised"): frames}
    error, misses, _ = box_panels(grouped, STRONG)
    (box,) = misses.boxes
    first, middle, third = np.quantile(values, [0.25, 0.5, 0.75])
    assert (box.first, box.middle, box.third) == (first, middle, third)
    assert (box.low, box.high) == (1.0, 9.0)
    assert box.outliers == (100.0,)
    assert error.boxes[0].middle == middle
    assert box_panels(grouped, replace(STRONG, sir_db=-15.0)) == []


def test_a_method_that_assigned_nothing_has_an_empty_box():
    point = {"panel": "5d-f", "snr_db": 60.0, "sir_db": 15.0}
    frames = group(point, misses=[10, 10], false_alarms=[0, 0], errors=[[], []])
    error, misses, _ = box_panels({("fig-5", 0, "object-only"): frames}, STRONG)
    assert np.isnan(error.boxes[0].middle)
    assert misses.boxes[0].middle == 10.0


def test_honest_errors_lie_on_the_diagonal_and_inside_the_band():
    rng = np.random.default_rng(4)
    errors = [[value] for value in rng.normal(size=2000) * 1e-4]
    frames = group({"panel": "3b"}, beat_errors=errors, beat_stds=[[1e-4]] * 2000)
    (panel,) = quantile_panels({("fig-3", 0, "factorised"): frames}, POOLED)
    own, ideal = panel.series
    inside = (own.y >= ideal.low) & (own.y <= ideal.high)
    # Pointwise 95 %, neighbouring points correlated: a band that fits holds most of them.
    assert np.mean(inside) > 0.8
    assert ideal.x == pytest.approx(stats.norm.ppf(np.arange(1, 200) / 200.0))


def test_the_band_is_that_of_order_statistics():
    frames = group({"panel": "3b"}, beat_errors=[[0.1]] * 99, beat_stds=[[1.0]] * 99)
    (panel,) = quantile_panels({("fig-3", 0, "factorised"): frames}, POOLED)
    ideal = panel.series[-1]
    # The median of 99: the 50th of them, distributed as beta(50, 50).
    assert stats.norm.cdf(ideal.low[99]) == pytest.approx(stats.beta.ppf(0.025, 50, 50))
    assert stats.norm.cdf(ideal.high[99]) == pytest.approx(stats.beta.ppf(0.975, 50, 50))


def test_no_errors_no_panel():
    frames = group({"panel": "3b"}, beat_errors=[[]], beat_stds=[[]])
    assert quantile_panels({("fig-3", 0, "factorised"): frames}, POOLED) == []
    assert quantile_panels({("fig-3", 0, "factorised"): frames}, replace(POOLED, panel="3a")) == []
