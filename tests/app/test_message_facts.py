"""Messages that look up the models they name: written and read as by Bokeh itself."""

import pytest
from bokeh.core.serialization import Serialized
from bokeh.document import Document
from bokeh.document.events import ModelChangedEvent
from bokeh.model import Model
from bokeh.models import Column, ColumnDataSource, Div, Slider
from bokeh.protocol import Protocol
from vsep_app.server.message_facts import CHANGES, look_up_models

AS_BOKEH_HAS_IT = [(owner, name, vars(owner)[name]) for owner, name, _ in CHANGES]


@pytest.fixture(autouse=True)
def as_bokeh_has_it(monkeypatch):
    """Bokeh's own messages, whatever other tests have done; undone at the end."""
    for owner, name, own in AS_BOKEH_HAS_IT:
        monkeypatch.setattr(owner, name, own)


def lived_through():
    """Messages of a page that changes, and which models its browser does not know after each."""
    first, text, new = (Div(text=name) for name in ("first", "text", "new"))
    column, document = Column(first, text), Document()
    document.add_root(column)
    document.models.flush_synced()
    slider = Slider(start=0, end=1, value=0.5)
    names = {each.id: name for name, each in locals().items() if isinstance(each, Model)}
    sent = []

    def send(*changes):
        events = [ModelChangedEvent(document, model, name, value) for model, name, value in changes]
        told = Protocol().create("PATCH-DOC", events).content_json
        for number, name in names.items():
            told = told.replace(f'"{number}"', f'"{name}"')
        sent.append((told, [names[each.id] for each in document.models._new_models]))

    send((text, "text", "changed"))
    column.children = [text, new]
    send((column, "children", [text, new]), (column, "children", [new, text]))
    send((column, "children", [new]))
    column.children = [new]
    new.tags = [slider]
    send((new, "text", "known"))
    send((new, "tags", new.tags))
    return sent


def test_messages_are_written_as_by_bokeh():
    by_bokeh = lived_through()
    look_up_models()
    ours = lived_through()
    assert ours == by_bokeh
    # What is known is a reference, what is new is written out, once.
    assert [told.count('"attributes"') for told, _ in ours] == [0, 1, 0, 0, 1]
    assert [unknown for _, unknown in ours] == [[], [], [], ["slider"], []]


@pytest.mark.parametrize("prepare", [lambda: None, look_up_models])
def test_what_a_browser_says_is_read_as_by_bokeh(prepare):
    prepare()
    source, other = ColumnDataSource({"x": [1]}), ColumnDataSource({"x": [2]})
    text = Div(text="a", tags=[source])
    document = Document()
    document.add_root(Column(text, Div(tags=[other])))
    event = {"kind": "ModelChanged", "model": {"id": text.id}, "attr": "text", "new": "b"}
    tags = {**event, "attr": "tags", "new": [{"id": other.id}]}
    new = {"type": "object", "name": "Slider", "id": "new", "attributes": {"start": 0, "end": 3}}
    children = {**event, "model": {"id": document.roots[0].id}, "attr": "children"}
    children["new"] = [{"id": text.id}, new, {"id": "new"}]
    document.apply_json_patch(Serialized({"events": [event, tags, children]}, []))
    assert text.text == "b"
    assert text.tags == [other]
    assert [*document.roots[0].children] == [text, document.models["new"], document.models["new"]]
    assert source not in [*document.models]


def test_what_a_browser_says_of_a_model_that_has_gone_is_left():
    look_up_models()
    document, gone = Document(), Div(text="a")
    document.add_root(Column(gone))
    document.roots[0].children = []
    event = {"kind": "ModelChanged", "model": {"id": gone.id}, "attr": "text", "new": "b"}
    document.apply_json_patch(Serialized({"events": [event]}, []))
    assert gone.text == "a"


def test_bokeh_makes_a_table_of_all_models_for_each_message():
    """The day it does no longer, `look_up_models` is not needed."""
    document = Document()
    document.add_root(Column(*(Div() for _ in range(5))))
    document.models.flush_synced()
    assert len(document.models.synced_references) == 6
