"""The guide without a browser: what it shows, sets and keeps to itself."""

import asyncio
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import numpy as np
import pytest
from vsep_app.jobs.card_pictures import CardPictures, _smaller
from vsep_app.jobs.run_session import Phase
from vsep_app.model.score import Score
from vsep_app.pages.base import PageContext
from vsep_app.pages.compare.page import ComparePage
from vsep_app.pages.live import Dashboard
from vsep_app.teaching.experiment import LIVE, shipped_experiments
from vsep_app.teaching.guide import Guide, cards_html, texts_html
from vsep_app.teaching.staging import Staging

SIX_OF_TEN = Score(
    found=np.ones(6, dtype=np.bool_),
    missed=np.arange(6, 10),
    nearest=np.zeros(4, dtype=np.int64),
    num_true=10,
    partners={number: number for number in range(6)},
)


@pytest.fixture
def taken():
    return []


@pytest.fixture
def ran():
    return []


@pytest.fixture
def guide(taken, ran):
    return Guide(shipped_experiments(), here=LIVE, take=taken.append, run=lambda: ran.append(True))


@pytest.fixture
def context():
    with ThreadPoolExecutor(1) as pool:
        yield lambda **query: PageContext(
            pool=pool, query=query, post=lambda function: function(), watched=lambda: True
        )


def answer_of(name):
    return next(one.answer for one in shipped_experiments() if one.name == name)


def test_nothing_is_shown_before_a_choice(guide, taken):
    assert not guide.texts.visible
    assert not guide.answer.visible
    assert list(guide.choice.options)[1] == "A pedestrian lost and found"
    assert taken == []


def test_a_choice_sets_the_controls_and_asks_for_a_prediction_first(guide, taken, ran):
    guide.choice.value = "dip"
    assert [one.name for one in taken] == ["dip"]
    assert guide.awaits_prediction
    assert guide.texts.object.count('data-press="predict ') == 3
    assert "Question" not in guide.texts.object
    assert not guide._buttons.visible
    assert guide.press("predict 2")
    assert ran == [True]
    assert not guide.awaits_prediction
    assert "Question" in guide.texts.object
    assert guide.texts.object.count("disabled") == 3
    assert answer_of("dip")[:30] not in guide.texts.object + guide.answer.object


@pytest.mark.parametrize(("number", "verdict"), [(0, "Not so: 6 of 10 found"), (2, "Right: 6 of")])
def test_the_outcome_is_told_beside_the_prediction(guide, number, verdict):
    guide.choice.value = "dip"
    guide.press(f"predict {number}")
    guide.finished(SIX_OF_TEN)
    assert verdict in guide.texts.object
    (line,) = [line for line in guide.texts.object.split("<button") if "what happened" in line]
    assert "Some are lost" in line
    guide.press("predict 1")
    assert guide.texts.object.count("(your prediction)") == 1


def test_an_experiment_without_predictions_asks_at_once(taken):
    plain = replace(shipped_experiments()[0], staging=Staging())
    guide = Guide([plain], here=LIVE, take=taken.append, opened=plain)
    assert not guide.awaits_prediction
    assert "Question" in guide.texts.object


def test_only_the_controls_of_the_question_stand_in_the_experiment(context):
    page = Dashboard(context(experiment="pedestrian"))
    page.page()
    assert len(page.guide.controls) == 0
    page.guide.press("predict 1")
    assert list(page.guide.controls) == [page.controls.widgets["estimator"]]


def test_a_card_or_its_number_chooses_an_experiment(guide):
    for name, chosen in (("experiment filter", "filter"), ("experiment 3", "dip")):
        assert guide.press(name)
        assert guide.choice.value == chosen
    assert guide.press("experiment 99")
    assert guide.press("experiment none-such")
    assert guide.choice.value == "dip"
    assert not guide.press("toggle")
    html = cards_html(shipped_experiments(), {})
    here = [one for one in shipped_experiments() if one.page == LIVE]
    assert html.count("<button") == html.count("</button>") == len(here)
    assert '<a data-go class="experiment" href="compare?experiment=zeroing">' in html


def test_locked_controls_and_hidden_views_are_free_again_after_it(context):
    page = Dashboard(context(experiment="threshold"))
    page.page()
    assert page.controls.widgets["interference"].disabled
    hides = replace(shipped_experiments()[0], staging=Staging(hide=("delay",)))
    page.stage(hides)
    assert not page.controls.widgets["interference"].disabled
    assert not page.views._parts["delay"].visible
    page.stage(None)
    assert page.views._parts["delay"].visible


def test_an_experiment_waits_at_its_first_picture_for_a_prediction(context):
    page = Dashboard(context())
    page.guide.press("experiment dip")
    assert page.session.phase is Phase.PAUSED
    page.guide.press("predict 0")


def test_the_answer_comes_and_goes(guide):
    guide.choice.value = "dip"
    guide.ask.clicks += 1
    assert answer_of("dip")[:30] in guide.answer.object
    assert guide.ask.label == "Hide the answer"
    guide.ask.clicks += 1
    assert (guide.answer.object, guide.answer.visible) == ("", False)
    guide.ask.clicks += 1
    guide.choice.value = "filter"
    assert not guide.answer.visible


def test_start_again_sets_the_controls_again(guide, taken):
    guide.choice.value = "dip"
    guide.again.clicks += 1
    assert [one.name for one in taken] == ["dip", "dip"]


def test_an_experiment_of_another_page_is_a_link(guide, taken):
    guide.choice.value = "zeroing"
    assert 'href="compare?experiment=zeroing"' in guide.texts.object
    assert taken == []


def test_texts_cannot_bring_markup():
    bad = replace(
        shipped_experiments()[0], setting="<script>x</script>", question="<b>?", staging=Staging()
    )
    shown = Guide([bad], here=LIVE, take=lambda _: None, opened=bad)
    assert "<script>" not in shown.texts.object
    assert "<b>" not in shown.texts.object


def test_the_live_view_opens_an_experiment_and_begins_it_again(context):
    page = Dashboard(context(experiment="pedestrian", snr="50"))
    settings = page.settings
    assert (settings.preset, settings.sir_db, settings.seed) == ("simulation-2-b", 0.0, 33)
    assert (settings.estimator, settings.snr_db) == ("object-only", 50.0)
    settings.param.update(estimator="joint", filter_kind="none")
    number = page.session.run_number
    page.guide.again.clicks += 1
    assert (settings.estimator, settings.snr_db) == ("object-only", 60.0)
    assert settings.filter_kind == "raised_cosine"
    assert page.session.run_number == number + 1
    page.guide.again.clicks += 1
    assert page.session.run_number == number + 2


def test_the_compare_page_takes_methods_too(context):
    page = ComparePage(context())
    page.guide.choice.value = "zeroing"
    assert page.choice.methods == ["zeroing", "masked", "factorised"]
    assert (page.settings.seed, page.settings.max_iterations) == (3, 30)


def test_an_unknown_experiment_is_told(context):
    page = Dashboard(context(experiment="none"))
    assert page._errors[0].startswith("experiment is none; it must be one of")


def test_what_an_experiment_asks_for_is_read_as_a_whole():
    (experiment,) = [one for one in shipped_experiments() if one.ask is not None]
    assert f"<p>{experiment.ask.text}</p>" in texts_html(experiment, here=experiment.page)


def test_cards_have_pictures_of_what_the_experiments_show():
    pictures, experiments = CardPictures(), shipped_experiments()
    with ThreadPoolExecutor(1) as executor:
        asyncio.run(pictures.make(experiments, executor))
    assert [*pictures.addresses] == [one.name for one in experiments]
    assert len({*pictures.addresses.values()}) == len(experiments)
    html = cards_html(experiments, pictures.addresses)
    # All cards together cost a page less than one of its figures.
    assert html.count("<img") == len(experiments)
    assert len(html) < 40_000


def test_a_card_picture_keeps_the_lines_of_a_large_map():
    pixels = np.zeros((100, 300), np.uint8)
    pixels[50, 7] = 255
    small = _smaller(pixels)
    assert small.shape == (20, 60)
    assert (small == 255).sum() == 1
