from dataclasses import fields

import pytest

from vsep.studies.catalogue import CATALOGUE
from vsep.studies.measures import METRICS
from vsep.studies.study import GapPoint

STATISTICAL = [name for name, study in CATALOGUE.items() if not study.example]


def test_an_example_has_no_panels_of_statistics():
    assert [name for name, study in CATALOGUE.items() if not study.panels] == [
        name for name in CATALOGUE if name not in STATISTICAL
    ]


@pytest.mark.parametrize("name", STATISTICAL)
def test_panels_show_points_metrics_and_parameters_that_exist(name):
    study = CATALOGUE[name]
    panels = {point.panel for point in study.points}
    parameters = {field.name for field in fields(GapPoint)}
    for spec in study.curves:
        assert spec.metric in METRICS
        assert spec.x in parameters
        assert spec.variant is None or spec.variant in parameters
    assert {spec.panel for spec in study.curves} == panels
    assert {spec.panel for spec in study.panels} == panels
