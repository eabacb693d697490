"""The guide without a browser: what it shows, sets and keeps to itself."""

from concurrent.futures import ThreadPoolExecutor

import pytest
from vsep_app.pages.base import PageContext
from vsep_app.pages.compare.page import ComparePage
from vsep_app.pages.live import Dashboard
from vsep_app.teaching.experiment import LIVE, shipped_experiments
from vsep_app.teaching.guide import Guide


@pytest.fixture
def taken():
    return []


@pytest.fixture
def guide(taken):
    return Guide(shipped_experiments(), here=LIVE, take=taken.append)


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


def test_a_choice_sets_the_controls_and_shows_the_question_only(guide, taken):
    guide.choice.value = "dip"
    assert [one.name for one in taken] == ["dip"]
    assert "Question" in guide.texts.object
    assert answer_of("dip")[:30] not in guide.texts.object + guide.answer.object


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
    from dataclasses import replace

    bad = replace(shipped_experiments()[0], setting="<script>x</script>", question="<b>?")
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
