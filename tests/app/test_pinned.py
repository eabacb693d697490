from dataclasses import replace

import numpy as np
import pytest
from bokeh.models import Span
from vsep_app.jobs.tasks import compose
from vsep_app.model.pinned import PinnedRun, differences
from vsep_app.model.settings import Settings
from vsep_app.views.pinned import PinnedMarks
from vsep_app.views.signals import DelayView, FastTimeView
from vsep_app.views.style import Axis
from vsep_app.views.swiped_map import SwipedMap
from vsep_app.widgets.headline import Headline


@pytest.fixture
def picture(many_ramps):
    """The last picture of Simulation II b, ramp 2."""
    return compose(many_ramps.snapshot(), 2, "level")


@pytest.fixture
def figures():
    """The three views that show a ghost."""
    axis, crosshair = Axis(), Span(dimension="height")
    views = FastTimeView(), DelayView(axis, crosshair), SwipedMap(axis, crosshair)
    return dict(
        zip(
            ("fast_time", "delay", "range_doppler"),
            (views[0].figure, views[1].figure, views[2].after),
            strict=True,
        )
    )


def columns(figure):
    """Columns of what a figure has drawn last."""
    return figure.renderers[-1].data_source.data


def test_a_ghost_marks_the_objects_where_they_were(figures, picture):
    before = {name: len(figure.renderers) for name, figure in figures.items()}
    marks = PinnedMarks(**figures)
    assert {name: len(figure.renderers) for name, figure in figures.items()} == before
    marks.pin(picture, picture)
    assert {name: len(figure.renderers) - 1 for name, figure in figures.items()} == before
    for name in ("delay", "range_doppler"):
        np.testing.assert_array_equal(columns(figures[name])["range"], picture.objects.ranges_m)
    drawn = columns(figures["fast_time"])["cleaned"]
    np.testing.assert_allclose(drawn, picture.fast_time.cleaned, rtol=1e-6)


def test_the_pinned_signal_is_shown_in_its_own_ramp_alone(figures, picture):
    marks = PinnedMarks(**figures)
    marks.pin(picture, picture)
    marks.follow(replace(picture, ramp=3))
    assert np.isnan(columns(figures["fast_time"])["cleaned"]).all()
    marks.follow(replace(picture, fast_time_mode="real"))
    assert np.isnan(columns(figures["fast_time"])["cleaned"]).all()
    marks.follow(picture)
    assert len(columns(figures["fast_time"])["cleaned"]) == len(picture.fast_time.cleaned)


def test_a_ghost_that_is_let_go_leaves_nothing(figures, picture):
    marks = PinnedMarks(**figures)
    marks.pin(picture, picture)
    marks.pin(None, picture)
    assert columns(figures["delay"])["range"] == []
    assert np.isnan(columns(figures["fast_time"])["cleaned"]).all()


def test_the_sentence_names_what_differs_and_the_score(picture):
    plan = Settings(sir_db=-20.0).plan()
    pinned = PinnedRun(plan=plan, picture=picture)
    other = Settings(sir_db=-30.0, interference=False).plan()
    told = pinned.told_beside(other)
    assert told.startswith("Pinned with SIR -20 dB, Interference on, iteration ")
    assert picture.score.text in told
    assert "with" not in pinned.told_beside(plan)


def test_of_many_differences_the_first_are_named():
    plan = Settings().plan()
    other = Settings(snr_db=12.0, sir_db=3.0, seed=99, interference=False, speed=3).plan()
    assert differences(plan, other).endswith("and 1 more")


def test_the_headline_offers_to_pin_or_to_let_go():
    headline = Headline()
    headline.tell_pinned("")
    assert 'data-press="pin"' in headline.text.object
    headline.tell_pinned("Pinned, <iteration 3>.")
    assert 'data-press="unpin"' in headline.text.object
    assert "&lt;iteration 3&gt;" in headline.text.object
    headline.tell_pinned(None)
    assert "data-press" not in headline.text.object
