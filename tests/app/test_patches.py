"""What is remembered of a class is what Bokeh says of each of its models."""

import pytest
from bokeh.core.has_props import HasProps
from bokeh.core.property.descriptors import PropertyDescriptor
from bokeh.document import Document
from bokeh.models import ColumnDataSource, Slider
from bokeh.plotting import figure
from vsep_app.pages.base import PageContext
from vsep_app.server.main import PAGES
from vsep_app.server.model_defaults import (
    has_unstable_default,
    overridden_defaults,
    remember_defaults,
)


@pytest.fixture(autouse=True)
def as_bokeh_has_it(monkeypatch):
    """Bokeh's own answers, whatever other tests have done; undone at the end."""
    monkeypatch.setattr(HasProps, "_overridden_defaults", classmethod(overridden_defaults))
    monkeypatch.setattr(PropertyDescriptor, "has_unstable_default", has_unstable_default)


def opened(route):
    """The document of a page, as a visitor opens it."""
    context = PageContext(
        pool=None, query={}, post=lambda function: function(), watched=lambda: True
    )
    document = Document()
    document.add_root(PAGES[route][0](context).page().get_root(document))
    return document


@pytest.mark.parametrize("route", ["/", "/recording"])
def test_every_model_of_a_page_has_the_defaults_that_bokeh_gives_it(route):
    document = opened(route)
    classes = {type(model) for model in document.models}
    assert len(classes) > 10
    remember_defaults()
    for model_class in classes:
        assert model_class._overridden_defaults() == overridden_defaults(model_class)
        model = next(each for each in document.models if type(each) is model_class)
        for name in model_class.properties():
            descriptor = model_class.lookup(name)
            if isinstance(descriptor, PropertyDescriptor):
                assert descriptor.has_unstable_default(model) == has_unstable_default(
                    descriptor, model
                )


def test_models_made_afterwards_are_written_as_before():
    def written():
        plot = figure(width=300)
        plot.line("x", "y", source=ColumnDataSource({"x": [1.0, 2.0], "y": [3.0, 4.0]}))
        document = Document()
        document.add_root(plot)
        document.add_root(Slider(start=0, end=1, value=0.5, title="a"))
        return without_ids(document.to_json().content)

    before = written()
    remember_defaults()
    assert written() == before
    assert written() == before


def test_a_default_that_is_made_anew_is_shared_by_no_two_models():
    remember_defaults()
    first, second = ColumnDataSource(), ColumnDataSource()
    first.data["x"] = [1.0]
    assert "x" not in second.data
    assert first.selected is not second.selected


def without_ids(value):
    """What is written, but for the running numbers of the models."""
    if isinstance(value, dict):
        return {key: without_ids(each) for key, each in value.items() if key != "id"}
    return [without_ids(each) for each in value] if isinstance(value, list) else value
