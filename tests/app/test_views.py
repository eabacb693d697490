import re
from dataclasses import replace

import numpy as np
import pytest
from bokeh.models import Span
from vsep_app.jobs.tasks import compose
from vsep_app.model.text import LogLine, TableRow
from vsep_app.views.progress import ProgressView
from vsep_app.views.ramps import RampStrip
from vsep_app.views.range_doppler import MAX_MARK, MIN_MARK, RangeDopplerView, mark_sizes
from vsep_app.views.signals import DelayView, FastTimeView
from vsep_app.views.style import COLOURS, Axis
from vsep_app.views.tables import MISSING, log_html, table_html, times_html, value_text


@pytest.fixture
def picture(many_ramps):
    """The last picture of Simulation II b."""
    return compose(many_ramps.snapshot(), 2, "level")


@pytest.fixture
def linked():
    """Delay and range-Doppler views on one range axis."""
    axis, crosshair = Axis(), Span(dimension="height")
    return DelayView(axis, crosshair), RangeDopplerView(axis, crosshair)


def _luminance(colour):
    parts = [int(colour[i : i + 2], 16) / 255.0 for i in (1, 3, 5)]
    linear = [p / 12.92 if p <= 0.04045 else ((p + 0.055) / 1.055) ** 2.4 for p in parts]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]


@pytest.mark.parametrize("role", COLOURS)
@pytest.mark.parametrize("page", ["#FFFFFF", "#121212"])
def test_colours_keep_three_to_one_on_both_pages(role, page):
    # WCAG 2.1, 1.4.11: graphical objects need a contrast of 3:1.
    bright, dark = sorted((_luminance(COLOURS[role]), _luminance(page)), reverse=True)
    assert (bright + 0.05) / (dark + 0.05) >= 3.0


def test_range_axes_are_one_object(linked):
    delay, maps = linked
    assert delay.figure.x_range is maps.before.x_range is maps.after.x_range
    assert maps.before.y_range is maps.after.y_range


def test_views_name_their_units(linked):
    delay, maps = linked
    fast = FastTimeView()
    for plot in (delay.figure, fast.figure, maps.before):
        for axis in plot.axis:
            assert re.search(r"\[.+\]$", axis.axis_label)


def test_fast_time_has_the_samples_of_the_ramp(picture):
    view = FastTimeView()
    view.update(picture)
    assert view.source.data["received"] == pytest.approx(picture.fast_time.received, abs=1e-4)
    assert view.source.data["received"].dtype == np.float32
    assert view.figure.title.text == "Fast time, ramp 2"


def test_limits_do_not_change_during_a_run(many_ramps, linked):
    delay, maps = linked
    fast = FastTimeView()
    limits = []
    for shown in (0, 1, len(many_ramps.steps)):
        picture = compose(many_ramps.snapshot(shown), 0, "level")
        for view in (delay, maps, fast):
            view.update(picture)
        ranges = (
            delay.figure.x_range,
            delay.figure.y_range,
            fast.figure.y_range,
            maps.after.y_range,
        )
        limits.append([(item.start, item.end) for item in ranges])
    assert limits[0] == limits[1] == limits[2]


def test_zoom_survives_new_limits():
    axis = Axis()
    axis.set((0.0, 10.0))
    axis.range.update(start=2.0, end=3.0)
    axis.set((0.0, 20.0))
    assert (axis.range.start, axis.range.end) == (2.0, 3.0)
    assert (axis.range.reset_start, axis.range.reset_end) == (0.0, 20.0)


def test_an_untouched_axis_follows_the_scene():
    axis = Axis()
    axis.set((0.0, 10.0))
    axis.set((0.0, 20.0), full=(-5.0, 40.0))
    assert (axis.range.start, axis.range.end) == (0.0, 20.0)
    assert (axis.range.reset_start, axis.range.reset_end) == (-5.0, 40.0)


def test_a_growing_axis_never_shrinks_within_a_run():
    axis = Axis()
    axis.grow((0.0, 10.0), fresh=True)
    axis.grow((4.0, 12.0), fresh=False)
    assert (axis.range.start, axis.range.end) == (0.0, 12.0)
    axis.grow((4.0, 5.0), fresh=True)
    assert (axis.range.start, axis.range.end) == (4.0, 5.0)


def test_the_map_before_is_sent_once_a_scene(linked, many_ramps):
    _, maps = linked
    source = maps._images["before"]
    maps.update(compose(many_ramps.snapshot(1), 0, "level"))
    sent = source.data
    maps.update(compose(many_ramps.snapshot(2), 0, "level"))
    assert source.data is sent


def test_marks_grow_with_the_component_snr():
    sizes = mark_sizes(np.array([-10.0, 0.0, 25.0, 50.0, 90.0]))
    middle = (MIN_MARK + MAX_MARK) / 2.0
    expected = [MIN_MARK, MIN_MARK, middle, MAX_MARK, MAX_MARK]
    assert sizes == pytest.approx(expected)


def test_a_click_on_the_strip_selects_the_ramp(picture):
    from bokeh.events import Tap

    chosen = []
    strip = RampStrip(chosen.append)
    strip.update(picture)
    for x in (3.4, -7.0, 99.0):
        strip._tapped(Tap(model=None, x=x, y=0.0))
    assert chosen == [3, 0, 15]


def test_the_strip_marks_true_and_estimated_bursts(picture):
    strip = RampStrip()
    strip.update(picture)
    data = strip._source.data
    count = len(picture.true_ramps)
    assert (data["opacity"][:count] > 0).tolist() == picture.true_ramps.tolist()
    assert (data["opacity"][count:] > 0).tolist() == picture.true_ramps.tolist()


def test_progress_shows_every_iteration(picture):
    view = ProgressView()
    view.update(picture)
    assert len(view.figures) == 3
    assert view._source.data["elbo"] == pytest.approx(picture.progress.elbo)
    assert view.figures[0].x_range.end >= picture.num_iterations


def test_progress_survives_a_run_without_a_step(one_ramp):
    view = ProgressView()
    view.update(compose(one_ramp.snapshot(0), 0, "level"))
    assert len(view._source.data["elbo"]) == 0


def test_progress_of_a_new_run_forgets_the_limits_of_the_last(many_ramps, one_ramp):
    view = ProgressView()
    view.update(compose(many_ramps.snapshot(), 0, "level"))
    snapshot = replace(one_ramp.snapshot(), run_number=2)
    view.update(compose(replace(snapshot, steps=()), 0, "level"))
    last = compose(snapshot, 0, "level")
    view.update(last)
    shown = view.figures[0].y_range
    spread = np.ptp(last.progress.elbo)
    # The margin is 12 % of the spread on both sides, at least one nat.
    assert shown.end - shown.start == pytest.approx(spread + 2.0 * max(0.12 * spread, 1.0))


def test_one_ramp_can_be_drawn_as_a_map(one_ramp, linked):
    _, maps = linked
    maps.update(compose(one_ramp.snapshot(), 0, "level"))
    assert maps._images["after"].data["image"][0].shape[0] == 1


def test_the_table_escapes_nothing_away_and_marks_misses():
    rows = [
        TableRow(component_id=4, range_m=1.5, range_std_m=0.002, snr_db=20.0),
        TableRow(true_range_m=9.0, true_snr_db=12.0),
    ]
    html = table_html(rows, moving=False)
    assert html.count("<tr") == 3
    assert '<tr class="extra"><td>4</td><td>1.500<span class="std"> ± 2.0</span></td>' in html
    assert '<tr class="missed">' in html
    assert MISSING in html
    assert "velocity" not in html
    assert "velocity [m/s]" in table_html(rows, moving=True)


def test_no_number_is_minus_zero():
    assert value_text(-0.0004, 2) == "0.00"
    assert value_text(None, 2) == value_text(float("nan"), 2) == MISSING


def test_the_log_shows_the_newest_line_first_and_escapes():
    lines = [
        LogLine(iteration=1, text="first", kind="added"),
        LogLine(iteration=2, text="<b>last</b>", kind="end"),
    ]
    html = log_html(lines)
    assert html.index("&lt;b&gt;last") < html.index("first")
    assert "Nothing" in log_html([])


def test_the_time_of_an_iteration_is_told_by_part(picture, many_ramps):
    steps = many_ramps.steps
    assert sum(picture.step_ms.values()) == pytest.approx(
        1e3 * sum(step.seconds for step in steps) / len(steps)
    )
    assert times_html({"objects": 1.5, "the rest": 0.25}) == (
        '<p class="times"><b>1.8 ms</b>: objects 1.5, the rest 0.2</p>'
    )
    assert "No iteration" in times_html({})
