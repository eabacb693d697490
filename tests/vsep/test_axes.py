import math

import pytest

from vsep.studies.axes import X_LABELS, x_label, x_value
from vsep.studies.catalogue import CATALOGUE


def test_everything_that_is_drawn_over_has_a_label():
    assert {spec.x for study in CATALOGUE.values() for spec in study.curves} == set(X_LABELS)
    assert x_label("object_delay_s") == "object delay s"


@pytest.mark.parametrize(("slope", "difference"), [(9.4e12, 0.6), (1.05e13, 0.5)])
def test_a_slope_lies_at_its_distance_from_the_victims(slope, difference):
    point = {"scene": "simulation-2", "interferer_slope_hz_per_s": slope}
    assert x_value(point, "interferer_slope_hz_per_s") == pytest.approx(difference, rel=1e-12)


def test_what_a_point_leaves_open_is_no_number():
    assert math.isnan(x_value({"num_interfered_ramps": None}, "num_interfered_ramps"))
