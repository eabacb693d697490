"""Estimators by name."""

import pytest

from vsep.errors import InputError
from vsep.inference.registry import ESTIMATORS, estimator_by_name, make_estimator
from vsep.signal.filters import NoFilter
from vsep.signal.template import SignalModel

MODEL = SignalModel(
    num_ramps=2, num_samples=64, sample_rate_hz=1e6, anti_aliasing_filter=NoFilter()
)


def test_every_name_gives_its_estimator():
    assert [estimator_by_name(name).__name__ for name in ESTIMATORS] == [
        "FactorisedSeparator",
        "JointSeparator",
        "ObjectOnlySeparator",
        "MaskedSeparator",
    ]


def test_an_unknown_name_is_refused_with_the_known_ones():
    with pytest.raises(InputError, match="'magic'; it must be one of factorised, joint, object"):
        estimator_by_name("magic")


def test_settings_reach_the_estimators_that_have_them():
    settings = {"object_threshold_db": 9.0, "schedule": "paper", "max_iterations": 7}
    joint = make_estimator("joint", MODEL, **settings)
    assert (joint.threshold_db, joint.schedule, joint.max_iterations) == (9.0, "paper", 7)
    alone = make_estimator("object-only", MODEL, **settings)
    assert (alone.threshold_db, alone.max_iterations) == (9.0, 7)
    with pytest.raises(InputError, match="schedule is 'quick'"):
        make_estimator("factorised", MODEL, schedule="quick")
