from dataclasses import fields

import pytest

from vsep.studies.catalogue import CATALOGUE
from vsep.studies.measures import METRICS
from vsep.studies.plans import PLANS
from vsep.studies.study import Point


def test_every_study_with_statistics_has_plans():
    assert set(PLANS) == {name for name, entry in CATALOGUE.items() if not entry.example}


@pytest.mark.parametrize("name", PLANS)
def test_plans_speak_of_panels_metrics_and_parameters_that_exist(name):
    panels = {point.panel for point in CATALOGUE[name].points()}
    parameters = {field.name for field in fields(Point)}
    for plan in PLANS[name]:
        assert plan.panel in panels
        assert plan.metric in METRICS
        assert plan.x in parameters
        assert plan.variant is None or plan.variant in parameters
    assert {plan.panel for plan in PLANS[name]} == panels
