"""Estimators by name."""

import pytest

from vsep.errors import InputError
from vsep.inference.registry import ESTIMATORS, make_estimator
from vsep.signal.filters import NoFilter
from vsep.signal.template import SignalModel

MODEL = SignalModel(
    num_ramps=2, num_samples=64, sample_rate_hz=1e6, anti_aliasing_filter=NoFilter()
)


def test_every_name_gives_its_estimator():
    assert {name: type(make_estimator(name, MODEL)).__name__ for name in ESTIMATORS} == {
        "factorised": "FactorisedSeparator",
        "joint": "JointSeparator",
        "object-only": "ObjectOnlySeparator",
        "masked": "MaskedSeparator",
        "evidence": "EvidenceChosenSeparator",
    }


def test_an_unknown_name_is_refused_with_the_known_ones():
    with pytest.raises(InputError, match="'magic'; it must be one of factorised, joint, object"):
        make_estimator("magic", MODEL)


def test_settings_reach_the_estimators_that_have_them():
    settings = {"object_threshold_db": 9.0, "schedule": "paper", "max_iterations": 7}
    joint = make_estimator("joint", MODEL, **settings)
    assert (joint.threshold_db, joint.schedule, joint.max_iterations) == (9.0, "paper", 7)
    alone = make_estimator("object-only", MODEL, **ESTIMATORS["object-only"].accepted(**settings))
    assert (alone.threshold_db, alone.max_iterations) == (9.0, 7)
    with pytest.raises(InputError, match="schedule is 'quick'"):
        make_estimator("factorised", MODEL, schedule="quick")


@pytest.mark.parametrize(
    ("name", "setting", "sentence"),
    [
        (
            "object-only",
            {"schedule": "paper"},
            "schedule is 'paper'; object-only takes none; factorised, joint and evidence do.",
        ),
        (
            "masked",
            {"interference_threshold_db": 3.0},
            "interference_threshold_db is 3.0; masked takes none; factorised, joint and evidence "
            "do.",
        ),
        (
            "factorised",
            {"mask": MODEL.check([[1.0] * 64] * 2) > 0.0},
            "mask is an array of shape (2, 64); factorised takes none; masked does.",
        ),
        (
            "object-only",
            {"colour": "red"},
            "colour is 'red'; object-only takes none; its settings are false_alarm_rate, "
            "object_threshold_db, max_iterations, range_migration.",
        ),
    ],
)
def test_a_setting_that_an_estimator_does_not_have_is_refused(name, setting, sentence):
    with pytest.raises(InputError) as refusal:
        make_estimator(name, MODEL, **setting)
    assert str(refusal.value) == sentence


def test_a_setting_that_is_not_given_is_refused_by_nobody():
    estimator = make_estimator("object-only", MODEL, schedule=None, mask=None)
    assert estimator == make_estimator("object-only", MODEL)


def test_an_entry_says_which_settings_there_are_and_their_defaults():
    defaults = {
        "false_alarm_rate": 0.05,
        "object_threshold_db": None,
        "max_iterations": 100,
        "range_migration": "modelled",
    }
    assert ESTIMATORS["object-only"].defaults == defaults
    assert ESTIMATORS["masked"].defaults == {"mask": None, **defaults}


def test_those_that_take_several_antennas_and_those_that_need_a_mask_say_so():
    several = [name for name, entry in ESTIMATORS.items() if entry.several_antennas]
    assert several == ["factorised", "object-only", "evidence"]
    assert [name for name, entry in ESTIMATORS.items() if entry.needs_mask] == ["masked"]
