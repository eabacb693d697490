import math

import pytest

from vsep.studies.groups import standardised_errors
from vsep.studies.study import Point
from vsep.studies.summary import summarise


def measured(rows, metric, method="factorised"):
    (measure,) = [m for m in summarise(rows, [metric]) if m.method == method]
    return measure.interval


def test_rmse_counts_only_what_was_detected(frame_row):
    far = 0.6 / 256  # cells
    rows = [
        frame_row(0, errors=(3e-4,)),
        frame_row(1, errors=(-4e-4,)),
        frame_row(2, errors=(far,)),
        frame_row(3, errors=()),
    ]
    interval = measured(rows, "rmse_detected")
    assert interval.value == pytest.approx(math.sqrt((9e-8 + 16e-8) / 2.0))
    assert interval.num_samples == 2
    relative = measured(rows, "rmse_detected_over_crlb")
    assert relative.value == pytest.approx(interval.value / 1e-4)
    share = measured(rows, "detection_rate")
    assert (share.value, share.num_samples, share.method) == (0.5, 4, "Clopper-Pearson")


def test_the_papers_rmse_asks_for_the_right_number_of_objects(frame_row):
    rows = [
        frame_row(0, errors=(3e-4,)),
        frame_row(1, errors=(5e-4,), num_objects=2, false_alarms=1),
    ]
    assert measured(rows, "rmse_exact").value == pytest.approx(3e-4)
    assert measured(rows, "exact_order_rate").value == 0.5


def test_paired_figures_compare_the_same_realization(frame_row):
    rows = [frame_row(number, errors=(1e-4 * number,)) for number in range(4)]
    rows += [frame_row(number, "no-interference", (1e-4 * number + 1e-5,)) for number in (3, 2, 1)]
    rows.append(frame_row(0, "no-interference", ()))
    interval = measured(rows, "paired_rmse_over_crlb")
    # Realisation 0 has no partner; the others differ by a tenth of the bound.
    assert interval.value == pytest.approx(0.1)
    assert interval.num_samples == 3
    assert measured(rows, "excess_misses").value == -0.25
    shown = {m.method for m in summarise(rows, ["paired_rmse_over_crlb", "excess_misses"])}
    assert shown == {"factorised"}


def test_rare_counts_have_an_exact_interval_and_frequent_ones_a_bootstrap(frame_row):
    rare = [frame_row(number) for number in range(50)]
    interval = measured(rare, "false_alarms")
    # No event in 50 frames: the upper end of 97.5 % is -ln 0.025 / 50.
    assert interval.method == "Garwood"
    assert interval.high == pytest.approx(-math.log(0.025) / 50)
    often = [frame_row(number, false_alarms=number % 3) for number in range(50)]
    assert measured(often, "false_alarms").method == "bootstrap percentile"
    assert measured(often, "many_false_alarms_rate").value == 0.0


def test_false_alarms_of_noise_are_compared_with_the_rate_that_was_asked_for(frame_row):
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
    rows = [frame_row(number, false_alarms=number % 2, **noise) for number in range(100)]
    interval = measured(rows, "false_alarm_ratio")
    assert interval.value == 1.0
    assert interval.method == "Garwood"
    assert summarise([frame_row()], ["false_alarm_ratio"]) == []


def test_standardised_errors_leave_out_what_has_no_deviation(frame_row):
    several = frame_row(
        errors=(1e-4, -2e-4),
        beat_stds=[1e-4, None],
        doppler_errors=[3e-3, 1e-3],
        doppler_stds=[1e-3, 1e-3],
    )
    assert standardised_errors(several) == pytest.approx([1.0, 3.0, 1.0])
    assert measured([several], "within_one_std").value == pytest.approx(2.0 / 3.0)


def test_differences_that_hardly_occur_have_an_interval_with_a_width(frame_row):
    rows = [frame_row(number, false_alarms=int(number == 0)) for number in range(40)]
    rows += [frame_row(number, "no-interference") for number in range(40)]
    interval = measured(rows, "excess_false_alarms")
    assert interval.value == 1.0 / 40.0
    assert interval.method == "Garwood"
    # Nothing was lost in 40 frames: at most -ln 0.025 / 40 a frame; one gained: at least 0.0253.
    assert interval.low == pytest.approx((0.025318 + math.log(0.025)) / 40.0, rel=1e-4)
    assert interval.high > interval.value
    often = [frame_row(number, false_alarms=number % 2) for number in range(40)]
    assert measured([*often, *rows[40:]], "excess_false_alarms").method == "bootstrap percentile"


def test_the_cost_over_the_masked_estimator_compares_the_same_realization(frame_row):
    rows = [frame_row(index, gospa=cost) for index, cost in enumerate((1.0, 2.0, 4.0))]
    rows += [frame_row(index, "masked", gospa=cost) for index, cost in enumerate((1.5, 1.0))]
    # -0.5 and 1; the third has no partner.
    assert measured(rows, "gospa_over_masked").value == pytest.approx(0.25)
    (shown,) = {m.method for m in summarise(rows, ["gospa_over_masked"])}
    assert shown == "factorised"
