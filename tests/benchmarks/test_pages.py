"""Time of the server for one opened page: its models made and written, as every visitor costs."""

import pytest
from bokeh.core.has_props import HasProps
from bokeh.core.property.descriptors import PropertyDescriptor
from bokeh.document import Document

from app.main import PAGES
from app.model_defaults import has_unstable_default, overridden_defaults, remember_defaults
from app.visit import Visit


def written_page(route):
    visit = Visit(pool=None, query={}, post=lambda function: function(), watched=lambda: True)
    document = Document()
    document.add_root(PAGES[route][0](visit).page().get_root(document))
    return document.to_json().content


@pytest.mark.benchmark(group="page")
@pytest.mark.parametrize("way", ["fast", "literal"])
@pytest.mark.parametrize("route", ["/", "/studies"])
def test_page(timed, monkeypatch, route, way):
    """Against Bokeh as it is."""
    monkeypatch.setattr(HasProps, "_overridden_defaults", classmethod(overridden_defaults))
    monkeypatch.setattr(PropertyDescriptor, "has_unstable_default", has_unstable_default)
    if way == "fast":
        remember_defaults()
    written = timed(lambda: written_page(route), part=f"page: {route}", way=way, rounds=5)
    assert len(written["roots"]) == 1
