import re
from dataclasses import replace

import numpy as np
import pytest
from vsep_app.figures.study_style import MARKERS, colour, marker
from vsep_app.pages.studies.curves import sample

from vsep.studies.methods import method_names
from vsep.studies.panels import reference


def test_every_method_has_a_colour_and_a_marker_of_its_own():
    methods = method_names()
    assert len(methods) > 20
    for look in (colour, marker):
        assert len({look(method) for method in methods}) == len(methods)


@pytest.mark.parametrize("method", method_names())
def test_a_method_has_its_marker_in_print_and_in_the_key(method):
    assert marker(method) in MARKERS
    curve = replace(reference(method, method, np.arange(2.0), np.arange(2.0)), kind="curve")
    assert re.search(r"<g fill=.{9}>(<g fill=.none.>)?<(path|circle) ", sample(curve))
