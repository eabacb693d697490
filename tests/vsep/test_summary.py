import numpy as np
import pytest

from vsep import InputError
from vsep.studies.measures import METRICS
from vsep.studies.summary import summarise


def test_the_order_of_the_rows_does_not_matter(frame_row):
    rng = np.random.default_rng(1)
    rows = [
        frame_row(number, method, (rng.normal() * 1e-4,))
        for number in range(20)
        for method in ("factorised", "no-interference")
    ]
    shuffled = [rows[index] for index in rng.permutation(len(rows))]
    one = {(m.method, m.metric): repr(m.interval) for m in summarise(rows)}
    assert one == {(m.method, m.metric): repr(m.interval) for m in summarise(shuffled)}
    assert set(dict(one)) <= {
        (method, name) for method in ("factorised", "no-interference") for name in METRICS
    }


def test_every_measure_states_its_interval(frame_row):
    rows = [frame_row(number, errors=(1e-4 * (number + 1),)) for number in range(3)]
    for measure in summarise(rows):
        flat = measure.as_row()
        assert flat["interval"] in {"bootstrap percentile", "Clopper-Pearson", "Garwood"}
        assert flat["low"] <= flat["value"] <= flat["high"]
        assert (flat["level"], flat["realizations"]) == (0.95, 3)
        assert flat["sir_db"] == 0.0


def test_an_unknown_metric_is_named(frame_row):
    with pytest.raises(InputError, match="'beauty'"):
        summarise([frame_row()], ["beauty"])


def test_a_point_without_results_has_no_measures(frame_row):
    failed = [{**frame_row(0), "status": "failed", "reason": "on purpose"}]
    assert summarise(failed) == []
    assert summarise([]) == []
