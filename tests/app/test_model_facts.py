"""What models of Bokeh work out once a class: they are made and written as by Bokeh itself."""

import json
import re

import pytest
from bokeh.core.property.descriptors import PropertyDescriptor, UnsetValueError
from bokeh.document import Document
from bokeh.models import ColumnDataSource, GlyphRenderer, Slider
from bokeh.plotting import figure
from bokeh.themes import Theme
from vsep_app.pages.base import PageContext
from vsep_app.pages.tabs import Tabs
from vsep_app.server.model_facts import CHANGES, remember_defaults

AS_BOKEH_HAS_IT = [(owner, name, vars(owner)[name]) for owner, name, _ in CHANGES]


@pytest.fixture(autouse=True)
def as_bokeh_has_it(monkeypatch):
    """Bokeh's own models, whatever other tests have done; undone at the end."""
    for owner, name, own in AS_BOKEH_HAS_IT:
        monkeypatch.setattr(owner, name, own)


def opened(route):
    """The document of a page, as a visitor opens it."""
    context = PageContext(
        pool=None, query={}, post=lambda function: function(), watched=lambda: True
    )
    document = Document()
    document.add_root(Tabs(context, route).page().get_root(document))
    return document


def written(document):
    """A document as it is sent; what counts up from model to model counts from its beginning."""
    places = {}
    return re.sub(
        r"(?<![0-9a-zA-Z])p\d{4,}|(?<=[a-z])\d{5}(?!\d)|\b\d{12,}",
        lambda found: str(places.setdefault(found.group(), len(places))),
        json.dumps(document.to_json(deferred=False)["roots"]),
    )


@pytest.fixture
def plot():
    """Makes a figure in a document whose theme changes its defaults."""

    def make():
        shown = figure(width=300)
        shown.line("x", "y", source=ColumnDataSource({"x": [1.0, 2.0], "y": [3.0, 4.0]}))
        document = Document(theme=Theme(json={"attrs": {"Axis": {"axis_line_color": "red"}}}))
        document.add_root(shown)
        document.add_root(Slider(start=0, end=1, value=0.5, title="a"))
        return document

    return make


def test_a_page_is_written_as_by_bokeh():
    by_bokeh = written(opened("./"))
    remember_defaults()
    assert written(opened("./")) == by_bokeh
    assert len(by_bokeh) > 50_000


def test_a_theme_changes_defaults_as_by_bokeh(plot):
    by_bokeh = written(plot())
    assert '"red"' in by_bokeh
    remember_defaults()
    assert written(plot()) == by_bokeh
    assert written(plot()) == by_bokeh


@pytest.mark.parametrize("route", ["compare"])
def test_a_page_refers_to_the_models_that_bokeh_finds(monkeypatch, route):
    remember_defaults()
    root = opened(route).roots[0]
    found = root.references()
    for owner, name, own in AS_BOKEH_HAS_IT:
        monkeypatch.setattr(owner, name, own)
    assert found == root.references()
    assert len(found) > 100


def test_every_property_has_the_value_that_bokeh_gives_it(plot):
    by_bokeh = all_values_of(plot())
    remember_defaults()
    assert all_values_of(plot()) == by_bokeh


def all_values_of(document):
    """Classes and values of all models, in the order in which they were made."""
    models = sorted(document.models, key=lambda each: int(each.id.removeprefix("p")))
    return [(type(each), values_of(each)) for each in models]


def values_of(model):
    """Plain values of all properties of a model, set or not."""
    plain = str, int, float, bool, type(None), list, dict
    descriptors = [type(model).lookup(name) for name in type(model).properties()]
    values = {
        each.name: each._get(model) for each in descriptors if isinstance(each, PropertyDescriptor)
    }
    return {name: value for name, value in values.items() if type(value) in plain}


def test_a_default_that_is_made_anew_is_shared_by_no_two_models():
    remember_defaults()
    first, second = ColumnDataSource(), ColumnDataSource()
    first.data["x"] = [1.0]
    first.tags.append("a")
    assert "x" not in second.data
    assert second.tags == []
    assert first.selected is not second.selected


def test_an_empty_list_that_somebody_fills_is_written():
    remember_defaults()
    document = Document()
    model = Slider(start=0, end=1, value=0.5)
    model.tags.append("filled")
    document.add_root(model)
    assert "filled" in written(document)


def test_a_value_that_is_missing_is_still_an_error():
    remember_defaults()
    document = Document()
    document.add_root(GlyphRenderer())  # of what?
    with pytest.raises(UnsetValueError):
        document.to_json()


def test_bokeh_works_out_anew_for_every_model_what_is_unstable(monkeypatch):
    """The day it does no longer, `remember_defaults` is not needed."""
    asked = []
    told = ColumnDataSource.lookup("data").property

    def count(self):
        asked.append(self)
        return type(told)._may_have_unstable_default(self)

    monkeypatch.setattr(told, "_may_have_unstable_default", count.__get__(told), raising=False)
    ColumnDataSource(), ColumnDataSource()
    assert len(asked) >= 2
