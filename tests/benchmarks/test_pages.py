"""Time of the server for one opened page: its models made and written, as every visitor costs."""

import pytest
from vsep_app.server.model_facts import remember_defaults

from tests.app.test_model_facts import as_bokeh_has_it, opened  # noqa: F401


@pytest.mark.benchmark(group="page")
@pytest.mark.parametrize("way", ["fast", "reference"])
@pytest.mark.parametrize("route", ["./", "studies"])
def test_page(timed, route, way):
    """Against Bokeh as it is."""
    if way == "fast":
        remember_defaults()
    part = f"page: {route}"
    written = timed(lambda: opened(route).to_json().content, part=part, way=way, rounds=5)
    assert len(written["roots"]) == 1
