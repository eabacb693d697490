import dataclasses
import json

import pytest

from tests.vsep.conftest import small_trial
from vsep._version import __version__
from vsep.files.results import as_json
from vsep.inference.core.estimator import EstimatorEntry
from vsep.studies import trial as trials
from vsep.studies.study import TrialSettings
from vsep.studies.trial import failed_rows, run_trial
from vsep.studies.trial_scenario import simulate_trial

REQUIRED = (
    "study",
    "point",
    "realization",
    "method",
    "num_objects_true",
    "num_objects",
    "misses",
    "false_alarms",
    "errors",
    "iterations",
    "termination",
    "seconds",
    "version",
)
METHODS = ("factorised", "object-only", "no-interference")


def trial(realization=0, methods=METHODS, **changes):
    return small_trial(1, methods, realization, **changes)


def without_seconds(rows):
    return [{key: value for key, value in row.items() if key != "seconds"} for row in rows]


def test_a_row_has_every_promised_key_and_survives_json():
    rows = run_trial(trial(object_threshold_db=11.0))
    assert [row["method"] for row in rows] == list(METHODS)
    for row in rows:
        assert row["status"] == "done"
        assert set(REQUIRED) <= set(row)
        assert row["point"]["snr_db"] == 30.0
        assert row["point"]["sir_db"] == -20.0
        assert row["version"] == __version__
        assert json.loads(as_json(row))["errors"] == row["errors"]
    separated, _, reference = rows
    assert separated["errors"] == [abs(error) for error in separated["beat_errors"]]
    assert (separated["misses"], separated["num_objects_true"]) == (0, 1)
    # The paired difference is a small share of the bound, 0.1 of it at most in a good trial.
    difference = separated["beat_errors"][0] - reference["beat_errors"][0]
    assert abs(difference) < 0.3 * separated["root_crlb"]


def test_a_trial_alone_gives_what_it_gave_among_others():
    one = trial(realization=1)
    expected = without_seconds(run_trial(one))
    assert without_seconds(run_trial(one)) == expected
    alone = dataclasses.replace(one, methods=("object-only",))
    assert without_seconds(run_trial(alone)) == [expected[1]]


def test_several_ramps_report_doppler_too():
    (row,) = run_trial(trial(scene="simulation-2", snr_db=60.0, methods=("no-interference",)))
    count = row["num_objects_true"] - row["misses"]
    for name in ("errors", "beat_errors", "beat_stds", "doppler_errors", "doppler_stds"):
        assert len(row[name]) == count
    assert sorted(row["assigned"]) == row["assigned"]
    assert row["separability_weakest_db"] < row["separability_db"]


def test_noise_alone_has_no_truth_to_miss():
    (row,) = run_trial(trial(scene="noise-1", false_alarm_rate=5.0, methods=("object-only",)))
    assert (row["num_objects_true"], row["misses"]) == (0, 0)
    assert row["false_alarms"] == row["num_objects"]
    assert json.loads(as_json(row))["sinr_db"] is None


def test_a_scene_that_cannot_be_made_is_a_row_with_its_reason():
    # Both radars of one slope: there is no burst to multiply with.
    rows = run_trial(trial(interferer_slope_hz_per_s=1e13))
    assert [row["status"] for row in rows] == ["failed"] * 3
    assert [row["method"] for row in rows] == list(METHODS)
    assert "slope" in rows[0]["reason"]


def test_a_method_that_breaks_leaves_the_others_alone():
    class Broken:
        def __init__(self, **_):
            raise ZeroDivisionError("on purpose")

    broken = EstimatorEntry(name="broken", factory=Broken)
    one = dataclasses.replace(trial(methods=("broken", "no-interference")), handed=(broken,))
    rows = run_trial(one)
    assert [row["status"] for row in rows] == ["failed", "done"]
    assert rows[0]["reason"] == "ZeroDivisionError: on purpose"


def test_failed_rows_name_the_trial():
    (row,) = failed_rows(trial(methods=("joint",)), "lost")
    assert (row["study"], row["point_index"], row["realization"]) == ("test", 1, 0)
    assert (row["status"], row["reason"]) == ("failed", "lost")


@pytest.mark.parametrize("cutoff", [0.01, 1.0])
def test_the_cutoff_of_gospa_decides_what_is_a_miss(cutoff):
    one = dataclasses.replace(
        trial(snr_db=15.0, methods=("no-interference",)),
        settings=TrialSettings(gospa_cutoff=cutoff),
    )
    (row,) = run_trial(one)
    # At 15 dB the bound is 2.7e-4 cycles per sample, 0.07 cells.
    assert row["misses"] == (1 if cutoff == 0.01 else 0)


def test_mitigation_methods_clean_the_frame_for_the_object_only_estimator():
    names = ("object-only", "zeroing", "masked", "no-interference")
    rows = {row["method"]: row for row in run_trial(trial(methods=names, sir_db=-30.0))}
    assert all(row["status"] == "done" for row in rows.values())
    assert rows["object-only"]["sinr_db"] < 0.0 < rows["zeroing"]["sinr_db"]
    assert rows["zeroing"]["sinr_db"] < rows["masked"]["sinr_db"]
    # Without the samples of the burst the masked estimator finds the object all the same.
    assert (rows["masked"]["misses"], rows["masked"]["false_alarms"]) == (0, 0)


def test_the_masked_methods_differ_by_their_mask_alone(monkeypatch):
    masked, found = run_trial(trial(snr_db=60.0, methods=("masked", "masked-autoregressive")))
    assert (masked["misses"], found["misses"]) == (0, 0)
    assert masked["beat_errors"] != found["beat_errors"]
    truth = simulate_trial(trial(snr_db=60.0)).truth
    monkeypatch.setattr(trials, "detect_interference", lambda *_: truth.perfect_mask())
    (same,) = run_trial(trial(snr_db=60.0, methods=("masked-autoregressive",)))
    assert same["beat_errors"] == masked["beat_errors"]
