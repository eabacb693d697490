"""Words of an address that lock and hide, and what becomes of them on the page."""

import pytest
from vsep_app.model.settings import Settings
from vsep_app.pages import EMBED
from vsep_app.pages.base import PageContext
from vsep_app.pages.embed import VIEWS
from vsep_app.pages.live import Dashboard
from vsep_app.teaching.stage_words import with_words, words_of
from vsep_app.teaching.staging import Staging
from vsep_app.widgets.controls import Controls


def context(pool, **query):
    return PageContext(
        pool=pool, query=query, post=lambda function: function(), watched=lambda: True
    )


def test_words_add_to_what_the_experiment_says():
    staging, errors = with_words(Staging(lock=("seed",), hide=("delay",)), {"lock": "sir,seed"})
    assert staging.lock == ("seed", "sir_db", "seed")
    assert staging.hide == ("delay",)
    assert errors == []


@pytest.mark.parametrize("words", ["lock=everything", "hide=moon", "lock=delay"])
def test_a_word_that_names_nothing_is_told(words):
    key, word = words.split("=")
    staging, errors = with_words(Staging(), {key: word})
    assert staging == Staging()
    assert len(errors) == 1
    assert word in errors[0]


def test_only_these_words_stay_in_the_address():
    assert words_of({"lock": "sir", "hide": "seed", "seed": "3"}) == {"lock": "sir", "hide": "seed"}


def test_what_is_hidden_is_locked_and_comes_back():
    controls = Controls(Settings(), lambda *_: None)
    controls.lock(["sir_db"], ["seed"])
    assert (controls.widgets["sir_db"].disabled, controls.widgets["sir_db"].visible) == (True, True)
    assert (controls.widgets["seed"].disabled, controls.widgets["seed"].visible) == (True, False)
    controls.lock([])
    assert not controls.widgets["seed"].disabled
    assert controls.widgets["seed"].visible


def test_an_address_hides_the_toolbar_and_a_view(pool):
    page = Dashboard(context(pool, hide="toolbar,delay", lock="snr"))
    page.page()
    assert not page.toolbar.visible
    assert page.controls.widgets["snr_db"].disabled
    page.close()


@pytest.mark.parametrize("view", VIEWS)
def test_an_embedded_page_shows_one_view_and_one_button(pool, view):
    page = EMBED.load()(context(pool, view=view))
    shown = page.page()
    assert page.view == view
    models = shown.get_root().references()
    assert sum(type(model).__name__.lower() == "figure" for model in models) == 1
    assert page.play.label == "Play"
    page.close()


def test_an_embedded_page_tells_of_a_view_that_there_is_not(pool):
    page = EMBED.load()(context(pool, view="moon"))
    assert page.view == VIEWS[0]
    assert "view is 'moon'; it must be one of maps" in page._errors[0]
    page.close()
