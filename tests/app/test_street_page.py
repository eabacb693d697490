"""The page of the street, without a browser."""

import numpy as np
import pytest
from vsep_app.jobs.stream_loop import Punctuality
from vsep_app.pages.base import PageContext
from vsep_app.pages.street.page import StreetPage
from vsep_app.pages.street.tasks import RANGES_M, VELOCITIES_MPS, play_street
from vsep_app.pages.street.views import sentence_of, tracks_html

from vsep.presets.street_settings import STREET_SETTINGS
from vsep.presets.street_traffic import RADAR
from vsep.tracking.tracks import resolution_cells

INTERFERED = 7  # the last of the frames played: a car's radar sends


@pytest.fixture
def opened(pool):
    """Return the page of an address."""

    def make(**query):
        return StreetPage(
            PageContext(pool=pool, query=query, post=lambda call: call(), watched=lambda: True)
        )

    return make


@pytest.fixture(scope="module")
def pictures():
    """Pictures of the first frames, as usual."""
    with pytest.MonkeyPatch.context():
        page = StreetPage(
            PageContext(pool=None, query={}, post=lambda call: call(), watched=lambda: True)
        )
        plan, state, made = page._plan(), None, []
        for number in range(INTERFERED + 1):
            played = play_street(plan, state, number, 1)
            state = played.state
            made.append(played.picture)
        return made


def test_the_page_begins_with_the_usual_street(opened):
    page = opened()
    assert all(getattr(page.settings, name) == value for name, value in STREET_SETTINGS.items())


def test_an_address_names_what_is_not_as_usual(opened):
    page = opened(street="sir=-25.0&slope=8.5", preset="simulation-2-b", snr="12")
    assert (page.settings.sir_db, page.settings.interferer_slope) == (-25.0, 8.5)
    # Levels of another page's scene mean something else.
    assert page.settings.snr_db == STREET_SETTINGS["snr_db"]
    assert opened(street="sir=loud")._errors


def test_a_control_acts_on_the_next_frame(opened):
    page = opened()
    before = page._plan()
    page.settings.sir_db = -30.0
    assert page._plan().values["sir_db"] == -30.0
    assert before.values["sir_db"] == STREET_SETTINGS["sir_db"]


def test_another_seed_is_another_street_from_its_first_frame(opened):
    page = opened()
    page.loop.number = 30
    page.settings.seed = 5
    assert page.loop.number == 0


def test_without_interference_its_controls_have_no_meaning(opened):
    page = opened()
    page.settings.interference = False
    assert page.widgets["sir_db"].disabled
    assert page.widgets["interferer_slope"].disabled
    assert not page.widgets["snr_db"].disabled


def test_bursts_are_in_the_first_map_and_not_in_the_second(pictures):
    picture = pictures[INTERFERED]
    assert picture.start == "warm"
    assert picture.num_bursts > 0
    # The noise between the objects, on the scale of the picture.
    assert np.median(picture.map_before) > np.median(picture.map_after) + 40
    clean = pictures[2]
    assert clean.num_bursts == 0
    np.testing.assert_array_equal(clean.map_before, clean.map_after)


def test_tracks_have_the_names_of_the_true_objects(pictures):
    picture = pictures[-1]
    metres, speed = resolution_cells(RADAR)
    true = dict(
        zip(
            picture.true_names,
            zip(picture.true_ranges_m, picture.true_velocities_mps, strict=True),
            strict=True,
        )
    )
    assert "cyclist 1" in {row.name for row in picture.tracks}
    for row in picture.tracks:
        distance, velocity = true[row.name]
        assert abs(row.range_m - distance) < metres
        assert abs(row.velocity_mps - velocity) < speed


def test_the_maps_show_the_road_ahead(pictures):
    picture = pictures[0]
    assert picture.map_after.shape == (len(picture.velocities_mps), len(picture.ranges_m))
    assert RANGES_M[0] <= picture.ranges_m[0] < picture.ranges_m[-1] <= RANGES_M[1]
    assert VELOCITIES_MPS[0] <= picture.velocities_mps[0]


def test_a_picture_is_told_in_words(opened, pictures):
    page = opened()
    page.page()
    page.loop.is_playing = True
    page.show(pictures[4], Punctuality(frames=4, in_time=4))
    assert "no interference" in page.headline.text.object
    assert "100.0 % of 4 frames in time" in page._count.object
    assert "playing" in page.status.object
    assert "cyclist 1" in page.table.object
    assert "bursts cancelled" in sentence_of(pictures[INTERFERED])


def test_names_are_text_in_the_table(pictures):
    row = pictures[-1].tracks[0]
    assert "&lt;b&gt;" in tracks_html((type(row)(**{**vars(row), "name": "<b>"}),))


def test_frames_that_were_lost_are_predicted_over(opened):
    page = opened()
    plan = page._plan()
    state = None
    for number, cycles in ((0, 1), (1, 1), (2, 1), (6, 4)):
        played = play_street(plan, state, number, cycles)
        state = played.state
    assert played.picture.start != "cold"
    assert len(played.picture.tracks) >= 8


def test_the_button_pauses_and_goes_on(opened):
    page = opened()
    page.loop.is_playing = True
    page._toggle()
    assert (page.loop.is_playing, page.play.label) == (False, "Play")


def test_what_cannot_be_made_is_told_above_the_views(opened):
    page = opened()
    page.page()
    page._failed("The interferer's slope is 1e+13 Hz/s.")
    assert page.fault.pane.visible
    assert "slope" in page.fault.pane.object
