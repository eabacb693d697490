import pytest
from vsep_app.jobs.tasks import prepare, preview
from vsep_app.model.picture import make_picture
from vsep_app.model.settings import LOADED_FRAME
from vsep_app.pages.base import PageContext
from vsep_app.pages.live import Dashboard

from vsep.separability.axes import parse_axis
from vsep.separability.map_spec import MapSpec
from vsep.separability.trial_word import trial_word


@pytest.fixture
def opened(pool):
    """Return the live page of an address."""

    def make(**query):
        return Dashboard(
            PageContext(pool=pool, query=query, post=lambda call: call(), watched=lambda: True)
        )

    return make


@pytest.fixture
def cell():
    """The word of a trial of SNR 55 dB and SIR -10 dB."""
    spec = MapSpec(x=parse_axis("sir_db=-10:0:2"), y=parse_axis("snr_db=55:60:2"))
    return trial_word(spec.trial((0, 0)))


@pytest.mark.parametrize(
    ("query", "preset", "stop_at"),
    [
        ({}, "simulation-2-b", 0),
        ({"theme": "dark"}, "simulation-2-b", 0),
        ({"snr": "12"}, "simulation-1", None),
        ({"iteration": "3"}, "simulation-1", 3),
    ],
)
def test_an_address_that_names_nothing_opens_the_start_scene(opened, query, preset, stop_at):
    page = opened(**query)
    assert (page.settings.preset, page._stop_at) == (preset, stop_at)


def test_a_trial_has_its_true_settings_and_its_controls_are_free(opened, cell):
    page = opened(trial=cell, snr="30", sir="-20")
    assert page.settings.preset == LOADED_FRAME
    assert (page.settings.snr_db, page.settings.sir_db) == (55.0, -10.0)
    assert page.controls.widgets["snr_db"].value == 55.0
    assert not page.controls.widgets["snr_db"].disabled
    assert "separability-map" in page.headline.text.object


def test_a_control_of_the_scene_goes_on_from_a_trial(opened, cell):
    page = opened(trial=cell)
    page.settings.estimator = "joint"
    assert page.settings.preset == LOADED_FRAME
    page.settings.snr_db = 50.0
    assert page.settings.preset == "simulation-1"
    assert (page.settings.snr_db, page.settings.sir_db) == (50.0, -10.0)
    assert "separability-map" not in page.headline.text.object
    job = page.session.next_job()
    assert (job.plan.preset, job.plan.snr_db, job.plan.sir_db) == ("simulation-1", 50.0, -10.0)


@pytest.mark.parametrize("model", ["multiplicative", "convolution"])
def test_equal_slopes_take_the_convolution_and_say_so(opened, model):
    page = opened(slope="10.0", model=model)
    assert page.settings.interference_model == "convolution"
    assert "steady tone" in page.controls._scene.slope_note.object
    page.settings.interferer_slope = 9.2
    assert page.controls._scene.slope_note.object == ""


def test_what_cannot_be_shown_stays_on_the_page_until_another_run_is_shown(opened):
    page = opened(preset="simulation-1")
    page.page()
    (body,) = page.fault._views
    page._failed("No frame is loaded.")
    assert page.fault.pane.visible
    assert "No frame is loaded." in page.fault.pane.object
    assert body.styles["opacity"] == "0.25"
    page.fault.clear(shown=page._shown())
    assert page.fault.pane.visible
    page._restart()
    page.fault.clear(shown=page._shown())
    assert not page.fault.pane.visible
    assert "opacity" not in body.styles


def test_a_refused_file_is_shown_as_refused(opened):
    page = opened()
    page._refused("notes.npz holds no array 'received'.")
    upload = page.controls.upload
    assert (upload.uploaded_label, upload.color) == ("Refused {filename}", "error")
    assert "holds no array" in page.controls.refused.object


def test_the_first_iterations_that_are_played_are_slow(opened):
    page = opened()
    assert page._speed() == page.settings.speed
    page.session.restart(page.settings.plan())
    page.transport._command("run")
    assert page._speed() == 0.25 * page.settings.speed
    page.session.cursor = 5
    assert page._speed() == page.settings.speed


@pytest.mark.parametrize(
    ("preset", "named"), [("simulation-1", "true objects"), ("real-frame", "without bursts")]
)
def test_the_keys_name_a_truth_where_one_is_known(opened, preset, named):
    page = opened(preset=preset)
    page.page()
    prepared = prepare(page.settings.plan())
    page.views._show_keys(make_picture(prepared.static_picture, prepared.initial_state, ()))
    fast_time, delay = (pane.object for pane in page.views._keys)
    assert named in fast_time
    assert ("true object" in delay) == (preset == "simulation-1")


def test_keys_change_the_ramp_within_the_frame(opened):
    page = opened()
    page.press("ramp_next")
    assert page.settings.ramp == 0
    page.session._prepared_run = prepare(page.settings.plan())
    for name, ramp in (("ramp_back", 0), ("ramp_next", 1), ("ramp_next", 2), ("ramp_back", 1)):
        page.press(name)
        assert page.settings.ramp == ramp
    page._ramp_selected(16)
    assert page.settings.ramp == 1


def test_a_click_on_a_bead_shows_its_iteration(opened):
    page = opened()
    page.session.restart(page.settings.plan())
    page.session._steps = [object()] * 9
    page.session._ended = lambda: False
    page.press("iteration 4")
    assert page.session.cursor == 4
    page.press("iteration 999999")
    assert page.session.cursor == 9


def test_settings_that_move_are_shown_until_they_stand(opened):
    page = opened()
    wanted = []
    page.preview._background.call = lambda _: wanted.append(page.preview._wanted)
    page.session._prepared_run = prepare(page.settings.plan())
    slider = page.controls.widgets["sir_db"]
    slider.value = -30.0
    assert page.preview.is_active
    assert wanted[-1][0].sir_db == -30.0
    assert page.settings.sir_db == -20.0
    slider.value = -20.0
    assert not page.preview.is_active
    slider.value = -25.0
    page.settings.sir_db = -25.0
    assert not page.preview.is_active


def test_pictures_of_the_run_wait_while_settings_move(opened, many_ramps):
    page = opened()
    page.page()
    page.preview._background.call = lambda _: None
    page.session._prepared_run = many_ramps.prepared
    picture = make_picture(many_ramps.prepared.static_picture, many_ramps.steps[-1].state, ())
    page.controls.widgets["sir_db"].value = -30.0
    page.show(picture)
    assert page.headline.text.object == ""
    page.controls.widgets["sir_db"].value = page.settings.sir_db
    page.show(picture)
    assert "headline" in page.headline.text.object


def test_the_start_stage_has_cards_until_the_run_begins(opened, many_ramps):
    page = opened()
    page.page()
    page.session._prepared_run = many_ramps.prepared
    first = make_picture(many_ramps.prepared.static_picture, many_ramps.prepared.initial_state, ())
    page.show(first)
    assert (page.views._cards.visible, page.views._tables.visible) == (True, False)
    later = make_picture(
        many_ramps.prepared.static_picture, many_ramps.prepared.initial_state, many_ramps.steps[:2]
    )
    page.show(later)
    assert (page.views._cards.visible, page.views._tables.visible) == (False, True)


def test_a_preview_is_called_one_and_keeps_nothing_of_the_run(opened, many_ramps):
    page = opened()
    page.page()
    page.session._prepared_run = many_ramps.prepared
    page.show(make_picture(many_ramps.prepared.static_picture, many_ramps.steps[-1].state, ()))
    page._show_preview(preview(page.settings.plan(), None, 0, 0, "level", 0, "ramps"))
    assert ">preview<" in page.transport.status.object
    assert "Let go" in page.headline.text.object
    assert page.views.map._marks["objects"].data["range"] == []
