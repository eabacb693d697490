"""True objects that are dragged, added and taken away in the map."""

import numpy as np
import pytest
from bokeh.events import DoubleTap, Tap
from vsep_app.jobs.tasks import preview
from vsep_app.model.crossing import ALL_RAMPS
from vsep_app.model.settings import Settings
from vsep_app.model.url import parse_query
from vsep_app.views.pointer import END, MOVE, START, Drag
from vsep_app.views.style import Axis, crosshair
from vsep_app.views.swiped_map import SwipedMap
from vsep_app.widgets.controls import Controls
from vsep_app.widgets.object_drag import ObjectDrag, places_of

PIXEL = 0.05, 0.1


class Stage:
    """A map with its objects."""

    def __init__(self) -> None:
        self.settings, self.moves = Settings(), 0
        self.settings.choose_preset("simulation-2-b")
        controls = Controls(self.settings, lambda *_: None)
        self.objects = ObjectDrag(self.settings, controls.widgets["placed"], self.moved)
        range_axis = Axis()
        range_axis.set((-6.0, 30.0))
        self.view = SwipedMap(range_axis, crosshair(), self.objects)
        self.show()

    def moved(self) -> None:
        self.moves += 1

    def show(self) -> None:
        picture = preview(self.settings.plan(), None, 0, 0, "level", 0, ALL_RAMPS)
        self.view.update(picture)
        true = picture.true_objects
        self.places = np.stack([true.ranges_m, true.velocities_mps], axis=1)
        self.levels_db = true.levels_db

    def drag(self, phase: int, x: float, y: float) -> None:
        columns = {**Drag(phase, x, y, *PIXEL)._asdict(), "number": 0}
        self.view.pointer.source.data = {key: [value] for key, value in columns.items()}


@pytest.fixture
def stage() -> Stage:
    return Stage()


def test_an_object_is_where_it_was_dragged_and_all_others_stay(stage: Stage) -> None:
    before, levels_db = stage.places, stage.levels_db
    x, y = before[3]
    stage.drag(START, x + 0.3, y)
    stage.drag(MOVE, 18.0, 2.0)
    assert stage.objects.moving is not None
    assert stage.moves == 1
    assert stage.settings.placed == ""
    stage.drag(END, 19.0, -3.0)
    assert stage.objects.moving is None
    stage.show()
    assert stage.places[3] == pytest.approx((19.0, -3.0), abs=0.01)
    others = np.arange(10) != 3
    np.testing.assert_allclose(stage.places[others], before[others], atol=0.01)
    relative = levels_db - levels_db.max()
    np.testing.assert_allclose(stage.levels_db - stage.levels_db.max(), relative, atol=0.1)


def test_the_axes_stay_while_an_object_is_dragged(stage: Stage) -> None:
    ends = stage.view._y.range.start, stage.view._y.range.end
    for frozen in (True, False):
        stage.view.freeze(frozen)
        stage.settings.placed = "12,1.5,0;20,18,0"
        stage.show()
        assert ((stage.view._y.range.start, stage.view._y.range.end) == ends) is frozen


def test_a_drag_beside_all_objects_moves_none(stage: Stage) -> None:
    stage.drag(START, 29.0, 19.0)
    stage.drag(MOVE, 18.0, 2.0)
    stage.drag(END, 18.0, 2.0)
    assert (stage.settings.placed, stage.moves) == ("", 0)


def test_a_double_click_adds_an_object_and_delete_takes_it_away(stage: Stage) -> None:
    before = stage.places
    stage.view._tapped_twice(DoubleTap(stage.view.after, x=21.0, y=4.0))
    stage.show()
    assert stage.places[-1] == pytest.approx((21.0, 4.0), abs=0.01)
    assert len(stage.places) == 11
    stage.objects.delete()
    stage.show()
    np.testing.assert_allclose(stage.places, before, atol=0.01)
    stage.view._tapped_twice(DoubleTap(stage.view.after, x=21.0, y=4.0))
    stage.show()
    stage.view._tapped(Tap(stage.view.after, x=21.1, y=4.0))
    stage.objects.delete()
    stage.show()
    np.testing.assert_allclose(stage.places, before, atol=0.01)
    # Nothing is chosen any more.
    stage.objects.delete()
    stage.show()
    assert len(stage.places) == 10


def test_the_only_object_stays(stage: Stage) -> None:
    stage.settings.placed = "12,1,0"
    stage.show()
    stage.view._tapped(Tap(stage.view.after, x=12.0, y=1.0))
    stage.objects.delete()
    assert stage.settings.placed == "12,1,0"


def test_a_recorded_scene_has_no_objects_to_move(stage: Stage) -> None:
    stage.settings.choose_preset("real-frame")
    stage.drag(START, *stage.places[0])
    stage.drag(END, 18.0, 2.0)
    assert stage.settings.placed == ""


def test_objects_live_in_the_address_and_go_with_the_preset(stage: Stage) -> None:
    text = "12,1.5,0;20,0,-6"
    values, errors = parse_query({"preset": "simulation-2-b", "placed": text})
    assert (values["placed"], errors) == (text, [])
    told = parse_query({"preset": "simulation-2-b", "placed": "12,x"})[1]
    assert told == ["placed is 12,x; it must be a text as 12,1.5,0; 20,0,-6."]
    stage.settings.placed = text
    stage.settings.choose_preset("simulation-2-a")
    assert stage.settings.placed == ""


def test_a_double_click_on_this_map_is_no_reset(stage: Stage) -> None:
    assert "doubletap" not in stage.view.after.js_event_callbacks
    assert places_of(stage.view._true)[0].level_db <= 0.0
