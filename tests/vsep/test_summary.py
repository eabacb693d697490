import math

import numpy as np
import pytest

from vsep import InputError
from vsep.studies.study import Point
from vsep.studies.summary import METRICS, groups, standardised_errors, summarise

ROOT_CRLB = 1e-4


def row(realization=0, method="factorised", errors=(1e-4,), **changes):
    """A finished frame of Simulation I with one object."""
    point = Point(panel="3b", scene="simulation-1", snr_db=30.0, sir_db=0.0)
    values = {
        "study": "fig-3",
        "point_index": 13,
        "point": point.parameters(),
        "realization": realization,
        "method": method,
        "status": "done",
        "num_ramps": 1,
        "num_samples": 256,
        "num_objects_true": 1,
        "num_objects": len(errors),
        "misses": 1 - len(errors),
        "false_alarms": 0,
        "errors": [abs(error) for error in errors],
        "beat_errors": list(errors),
        "beat_stds": [ROOT_CRLB] * len(errors),
        "root_crlb": ROOT_CRLB,
        "gospa": 0.0,
        "sinr_db": None,
        "evm": 0.1,
        "separability_db": -3.0,
        "separability_weakest_db": -3.0,
        "iterations": 5,
        "termination": "converged",
        "seconds": 0.01,
    }
    return values | changes


def measured(rows, metric, method="factorised"):
    (measure,) = [m for m in summarise(rows, [metric]) if m.method == method]
    return measure.interval


def test_rmse_counts_only_what_was_detected():
    far = 0.6 / 256  # cells
    rows = [
        row(0, errors=(3e-4,)),
        row(1, errors=(-4e-4,)),
        row(2, errors=(far,)),
        row(3, errors=()),
    ]
    interval = measured(rows, "rmse_detected")
    assert interval.value == pytest.approx(math.sqrt((9e-8 + 16e-8) / 2.0))
    assert interval.num_samples == 2
    relative = measured(rows, "rmse_detected_over_crlb")
    assert relative.value == pytest.approx(interval.value / ROOT_CRLB)
    share = measured(rows, "detection_rate")
    assert (share.value, share.num_samples, share.method) == (0.5, 4, "Clopper-Pearson")


def test_the_papers_rmse_asks_for_the_right_number_of_objects():
    rows = [row(0, errors=(3e-4,)), row(1, errors=(5e-4,), num_objects=2, false_alarms=1)]
    assert measured(rows, "rmse_exact").value == pytest.approx(3e-4)
    assert measured(rows, "exact_order_rate").value == 0.5


def test_paired_figures_compare_the_same_realization():
    rows = [row(number, errors=(1e-4 * number,)) for number in range(4)]
    rows += [row(number, "no-interference", (1e-4 * number + 1e-5,)) for number in (3, 2, 1)]
    rows.append(row(0, "no-interference", ()))
    interval = measured(rows, "paired_rmse_over_crlb")
    # Realisation 0 has no partner; the others differ by a tenth of the bound.
    assert interval.value == pytest.approx(0.1)
    assert interval.num_samples == 3
    assert measured(rows, "excess_misses").value == -0.25


def test_rare_counts_have_an_exact_interval_and_frequent_ones_a_bootstrap():
    rare = [row(number) for number in range(50)]
    interval = measured(rare, "false_alarms")
    # No event in 50 frames: the upper end of 97.5 % is -ln 0.025 / 50.
    assert interval.method == "Garwood"
    assert interval.high == pytest.approx(-math.log(0.025) / 50)
    often = [row(number, false_alarms=number % 3) for number in range(50)]
    assert measured(often, "false_alarms").method == "bootstrap percentile"
    assert measured(often, "many_false_alarms_rate").value == 0.0


def test_false_alarms_of_noise_are_compared_with_the_rate_that_was_asked_for():
    point = Point(
        panel="noise-1", scene="noise-1", snr_db=0.0, sir_db=0.0, false_alarm_rate=0.5
    ).parameters()
    noise = {
        "num_objects_true": 0,
        "errors": [],
        "beat_errors": [],
        "beat_stds": [],
        "point": point,
    }
    rows = [row(number, false_alarms=number % 2, **noise) for number in range(100)]
    interval = measured(rows, "false_alarm_ratio")
    assert interval.value == 1.0
    assert interval.method == "Garwood"
    assert summarise([row()], ["false_alarm_ratio"]) == []


def test_failed_rows_are_left_out_and_counted():
    rows = [row(0), {**row(1), "status": "failed", "reason": "on purpose"}]
    (group,) = groups(rows).values()
    assert (len(group.rows), group.num_failed) == (1, 1)
    assert measured(rows, "detection_rate").num_samples == 1
    only_failed = [rows[1]]
    assert summarise(only_failed) == []


def test_the_order_of_the_rows_does_not_matter():
    rng = np.random.default_rng(1)
    rows = [
        row(number, method, (rng.normal() * 1e-4,))
        for number in range(20)
        for method in ("factorised", "no-interference")
    ]
    shuffled = [rows[index] for index in rng.permutation(len(rows))]
    one = {(m.method, m.metric): repr(m.interval) for m in summarise(rows)}
    assert one == {(m.method, m.metric): repr(m.interval) for m in summarise(shuffled)}
    assert set(dict(one)) <= {
        (method, name) for method in ("factorised", "no-interference") for name in METRICS
    }


def test_every_measure_states_its_interval():
    rows = [row(number, errors=(1e-4 * (number + 1),)) for number in range(3)]
    for measure in summarise(rows):
        flat = measure.as_row()
        assert flat["interval"] in {"bootstrap percentile", "Clopper-Pearson", "Garwood"}
        assert flat["low"] <= flat["value"] <= flat["high"]
        assert (flat["level"], flat["realizations"]) == (0.95, 3)
        assert flat["sir_db"] == 0.0


def test_standardised_errors_leave_out_what_has_no_deviation():
    several = row(
        errors=(1e-4, -2e-4),
        beat_stds=[1e-4, None],
        doppler_errors=[3e-3, 1e-3],
        doppler_stds=[1e-3, 1e-3],
    )
    assert standardised_errors(several) == pytest.approx([1.0, 3.0, 1.0])
    assert measured([several], "within_one_std").value == pytest.approx(2.0 / 3.0)


def test_an_unknown_metric_is_named():
    with pytest.raises(InputError, match="'beauty'"):
        summarise([row()], ["beauty"])
