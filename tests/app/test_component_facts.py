"""What components of Panel share: pages and components stay what they are without it."""

import json

import panel as pn
import panel_material_ui as pmu
import pytest
from panel.links import Callback
from vsep_app.server.component_facts import ALIKE, CHANGES, spare_components

from tests.app.test_model_facts import as_bokeh_has_it, opened, written  # noqa: F401

AS_PANEL_HAS_IT = [(owner, name, vars(owner).get(name)) for owner, name, _ in CHANGES]


@pytest.fixture(autouse=True)
def as_panel_has_it():
    """Panel's own components, whatever other tests have done, and again at the end."""
    before = [(owner, name, vars(owner).get(name)) for owner, name, _ in CHANGES]
    spared = [kind._param__private.disable_instance_params for kind in ALIKE]
    _let(AS_PANEL_HAS_IT, [False] * len(ALIKE))
    yield
    _let(before, spared)


def _let(own, spared):
    for owner, name, value in own:
        if value is not None:
            setattr(owner, name, value)
        elif name in vars(owner):
            delattr(owner, name)
    for kind, wanted in zip(ALIKE, spared, strict=True):
        kind._param__private.disable_instance_params = wanted


def test_a_page_is_written_as_by_panel_but_for_the_modules_of_its_bundle():
    by_panel = written(opened("./"))
    spare_components()
    ours = written(opened("./"))
    assert without_modules(json.loads(ours)) == without_modules(json.loads(by_panel))
    assert len(ours) < len(by_panel) - 40_000


def without_modules(value):
    """What is written, but for where a browser would find modules."""
    if isinstance(value, dict):
        return {key: without_modules(each) for key, each in value.items() if key != "importmap"}
    return [without_modules(each) for each in value] if isinstance(value, list) else value


def test_no_page_changes_a_parameter_for_all_components_of_a_class():
    def declared():
        return {
            (kind.__name__, name): (
                parameter.constant,
                parameter.readonly,
                str(parameter.default),
                getattr(parameter, "bounds", None),
                str(getattr(parameter, "objects", None)),
            )
            for kind in ALIKE
            for name, parameter in kind.param.objects(instance=False).items()
        }

    spare_components()
    before = declared()
    for route in ("./", "street"):
        opened(route)
    assert declared() == before


def test_a_pane_that_stands_alone_has_a_row_around_it_that_follows_its_size():
    spare_components()
    pane = pn.pane.HTML("<p>alone</p>", width=120)
    assert "layout" not in vars(pane)
    assert list(pane.layout) == [pane]
    assert pane.layout is pane.layout
    pane.height = 70
    assert pane.layout.width >= 120
    assert pane.layout.height >= 70
    assert "alone" in pane.get_root().text
    with pytest.raises(ValueError, match="HTML pane does not support"):
        pn.pane.HTML(3.0)


def test_a_text_that_changes_is_written_as_by_panel():
    def shown():
        pane = pn.pane.HTML("<p>a & b</p>", width=120, stylesheets=["p { color: red }"])
        root = pn.Column(pane).get_root()
        pane.object = "<p>c & d</p>"
        pane.width, pane.visible = 60, False
        pane.object = None
        model = root.children[0]
        return {name: str(value) for name, value in model.properties_with_values().items()}

    by_panel = shown()
    spare_components()
    ours = shown()
    changing = {"stylesheets"}  # whose numbers count up
    assert {name: ours[name] for name in ours.keys() - changing} == {
        name: by_panel[name] for name in by_panel.keys() - changing
    }
    assert len(ours["stylesheets"].split("ImportedStyleSheet")) == len(
        by_panel["stylesheets"].split("ImportedStyleSheet")
    )


def test_panel_makes_a_row_for_every_pane_and_copies_every_parameter():
    """The day it does no longer, `spare_components` is not needed."""
    assert "layout" in vars(pn.pane.HTML(""))
    assert pmu.Button(label="a").param["label"] is not pmu.Button.param["label"]
    assert len(pmu.Button._process_importmap()["imports"]) > 1


def test_components_of_a_class_have_their_own_values():
    spare_components()
    first, second = pmu.FloatSlider(start=0, end=1), pmu.FloatSlider(start=0, end=1)
    first.param.update(end=5.0, value=4.0)
    assert (second.end, second.value) == (1, 0.0)
    told = []
    second.param.watch(told.append, "value")
    first.value = 2.0
    assert not told
    second.value = 0.5
    assert len(told) == 1


def test_links_are_looked_through_while_another_page_adds_some():
    kept = [linked()]

    def look():
        for _ in zip(Callback.registry.values(), range(3), strict=False):
            kept.append(linked())

    with pytest.raises(RuntimeError, match="changed size during iteration"):
        look()
    spare_components()
    kept.append(linked())
    look()
    assert [*Callback.registry.values()]


@pytest.mark.parametrize("change", [lambda: None, spare_components])
def test_a_link_of_what_comes_later_is_made_and_no_other_again(change):
    change()
    first, second = linked(), linked()
    place = pn.Column()
    root = pn.Column(first, place).get_root()
    place[:] = [pn.Row(second)]
    place.append(pn.pane.HTML("nothing to link"))
    (held,) = first._models[root.ref["id"]][0].js_event_callbacks.values()
    (later,) = second._models[root.ref["id"]][0].js_event_callbacks.values()
    assert len(held) == len(later) == 1


def test_the_whole_page_is_looked_through_where_no_link_begins():
    """The day it is no longer, `_process_links` is not needed."""
    looked = []

    class Watched(pn.Column):
        def select(self, selector=None):
            looked.append(selector)
            return super().select(selector)

    def looks():
        place = pn.Column()
        page = Watched(linked(), place)
        page.get_root()
        looked.clear()
        place[:] = [pn.pane.HTML("nothing to link")]
        return len(looked)

    before = looks()
    spare_components()
    assert looks() < before


def linked():
    """A button with a link."""
    button = pn.widgets.Button()
    button.js_on_click(code="")
    return button
