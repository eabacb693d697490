import numpy as np
import pytest

from vsep import InputError, ObjectOnlySeparator, RaisedCosineFilter, SignalModel
from vsep.inference.objects.masked import MaskedSeparator
from vsep.inference.registry import ESTIMATORS
from vsep.mitigation.masks.detectors import DETECTORS
from vsep.mitigation.registry import MITIGATIONS
from vsep.studies.methods import (
    ITERATIONS_AFTER_REPAIR,
    MASKED_BY_DETECTOR,
    NO_INTERFERENCE,
    estimator_names,
    method_names,
    require_methods,
    trial_estimator,
)
from vsep.studies.study import Point, TrialSettings

MODEL = SignalModel(
    num_ramps=1,
    num_samples=64,
    sample_rate_hz=1e6,
    anti_aliasing_filter=RaisedCosineFilter(cutoff_hz=2.5e5),
)


def point(**changes):
    return Point(panel="a", scene="simulation-1", snr_db=30.0, sir_db=0.0, **changes)


def test_all_estimators_and_mitigations_are_methods_and_the_reference_comes_last():
    assert method_names() == (*ESTIMATORS, *MASKED_BY_DETECTOR, *MITIGATIONS, NO_INTERFERENCE)
    assert len(set(method_names())) == len(method_names())
    usual = [name for name in ESTIMATORS if name != "evidence"]
    assert estimator_names() == (*usual, NO_INTERFERENCE)


@pytest.mark.parametrize("method", method_names())
def test_thresholds_and_schedule_reach_every_estimator_that_has_them(method):
    settings = TrialSettings(schedule="paper")
    by_level = trial_estimator(method, MODEL, point(object_threshold_db=9.5), settings)
    assert by_level.threshold_db == 9.5
    rare = trial_estimator(method, MODEL, point(false_alarm_rate=1e-4), settings)
    often = trial_estimator(method, MODEL, point(false_alarm_rate=1.0), settings)
    assert rare.threshold_db > often.threshold_db
    assert getattr(by_level, "schedule", "paper") == "paper"


def test_the_reference_is_the_object_only_estimator():
    estimator = trial_estimator(NO_INTERFERENCE, MODEL, point(), TrialSettings())
    assert isinstance(estimator, ObjectOnlySeparator)
    received = np.exp(-2j * np.pi * 0.1 * np.arange(64))[None, :]
    assert estimator.init(received).iteration == 0


def test_a_masked_method_ignores_the_mask_it_is_given():
    mask = np.zeros(MODEL.shape, dtype=np.bool_)
    mask[0, 10:20] = True
    assert set(MASKED_BY_DETECTOR.values()) <= set(DETECTORS)
    for method in ("masked", *MASKED_BY_DETECTOR):
        estimator = trial_estimator(method, MODEL, point(), TrialSettings(), mask)
        assert isinstance(estimator, MaskedSeparator)
        assert np.array_equal(estimator.used, ~mask)


def test_only_repaired_frames_have_fewer_iterations():
    limits = {
        method: trial_estimator(method, MODEL, point(), TrialSettings()).max_iterations
        for method in method_names()
    }
    assert {name for name in limits if limits[name] == ITERATIONS_AFTER_REPAIR} == set(MITIGATIONS)
    assert set(limits.values()) == {ITERATIONS_AFTER_REPAIR, 100}


@pytest.mark.parametrize(
    ("names", "message"), [(("magic",), "magic"), ((), "none"), (("joint", "joint"), "once")]
)
def test_unknown_missing_and_repeated_methods_are_refused(names, message):
    with pytest.raises(InputError, match=message):
        require_methods(names)
