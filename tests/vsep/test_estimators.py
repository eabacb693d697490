"""Estimators by name."""

import pytest

from vsep._arrays import InputError
from vsep.inference.estimators import ESTIMATORS, estimator_by_name


def test_every_name_gives_its_estimator():
    assert [estimator_by_name(name).__name__ for name in ESTIMATORS] == [
        "FactorisedSeparator",
        "JointSeparator",
        "ObjectOnlySeparator",
    ]


def test_an_unknown_name_is_refused_with_the_known_ones():
    with pytest.raises(InputError, match="'magic'; it must be one of factorised, joint, object"):
        estimator_by_name("magic")
