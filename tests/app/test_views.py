import re
from dataclasses import replace

import numpy as np
import pytest
from bokeh.models import Span
from vsep_app.jobs.tasks import compose
from vsep_app.model.markers import Markers
from vsep_app.model.score import Score
from vsep_app.model.text import LogLine, TableRow
from vsep_app.views.progress import ProgressView
from vsep_app.views.ramps import RampStrip
from vsep_app.views.range_doppler import (
    MAX_MARK,
    MIN_MARK,
    RangeDopplerView,
    mark_sizes,
    miss_columns,
)
from vsep_app.views.signals import DelayView, FastTimeView
from vsep_app.views.style import COLOURS, EDGE_SHARE, Axis, plain_figure
from vsep_app.views.swiped_map import SwipedMap
from vsep_app.views.tables import MISSING, log_html, table_html, value_text


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


def test_an_untouched_axis_follows_the_scene_and_a_reset_shows_the_same():
    axis = Axis()
    axis.set((0.0, 10.0))
    axis.set((0.0, 20.0))
    assert (axis.range.start, axis.range.end) == (0.0, 20.0)
    assert (axis.range.reset_start, axis.range.reset_end) == (0.0, 20.0)


def test_an_axis_holds_every_estimate_of_a_run_and_forgets_those_of_the_last():
    axis = Axis()
    axis.hold((0.0, 10.0), np.array([3.0]), run_number=1)
    assert (axis.range.start, axis.range.end) == (0.0, 10.0)
    axis.hold((0.0, 10.0), np.array([3.0, -5.0]), run_number=1)
    axis.hold((0.0, 10.0), np.array([14.0]), run_number=1)
    margin = EDGE_SHARE * 10.0
    held = (-5.0 - margin, 14.0 + margin)
    assert (axis.range.start, axis.range.end) == held
    assert (axis.range.reset_start, axis.range.reset_end) == held
    axis.hold((0.0, 10.0), np.zeros(0), run_number=2)
    assert (axis.range.start, axis.range.end) == (0.0, 10.0)


def test_the_wheel_zooms_and_a_double_click_shows_all_again(linked):
    for plot in (linked[0].figure, linked[1].before):
        assert type(plot.toolbar.active_scroll).__name__ == "WheelZoomTool"
        (answer,) = plot.js_event_callbacks["doubletap"]
        assert answer.args == {"x": plot.x_range, "y": plot.y_range}


def test_nothing_is_called_cleaned_before_a_burst_is_modelled(many_ramps, linked):
    _, maps = linked
    burst = int(np.flatnonzero(many_ramps.prepared.static_picture.true_ramps)[0])
    first, last = (compose(many_ramps.snapshot(n), burst, "level") for n in (0, None))
    assert np.isnan(first.fast_time.cleaned).all()
    assert np.isfinite(last.fast_time.cleaned).all()
    maps.update(first)
    assert "No burst is modelled" in maps.after.title.text
    assert not maps._images["after"].data["image"][0].any()
    maps.update(last)
    assert maps.after.title.text == "Range-Doppler, bursts cancelled"
    np.testing.assert_array_equal(maps._images["after"].data["image"][0], last.map_after)


def test_found_and_false_estimates_and_misses_look_different(many_ramps, linked):
    delay, maps = linked
    for shown in (1, len(many_ramps.steps)):
        picture = compose(many_ramps.snapshot(shown), 0, "level")
        maps.update(picture)
        delay.update(picture)
        shapes = maps._marks["objects"].data["shape"]
        assert shapes == delay._stems["objects"].data["shape"]
        assert shapes.count("circle") == picture.score.num_found
        assert shapes.count("square") == picture.score.num_false
        assert len(maps._misses.data["range"]) == 10 - picture.score.num_found


def test_a_miss_is_tied_to_its_nearest_estimate():
    places = {"levels_db": np.zeros(2), "snr_db": np.zeros(2), "opacity": np.ones(2)}
    true = Markers(ranges_m=np.array([1.0, 9.0]), velocities_mps=np.array([0.0, 3.0]), **places)
    objects = Markers(ranges_m=np.array([1.0, 8.0]), velocities_mps=np.array([0.0, 4.0]), **places)
    score = Score(
        found=np.array([True, False]),
        missed=np.array([1]),
        nearest=np.array([1]),
        num_true=2,
        partners={0: 0},
    )
    assert miss_columns(score, true, objects) == {
        "range": [9.0],
        "velocity": [3.0],
        "nearest_range": [8.0],
        "nearest_velocity": [4.0],
    }


def test_a_true_object_has_its_resolution_cell_beside_it(picture, linked):
    _, maps = linked
    maps.update(picture)
    data, radar = maps._marks["true_objects"].data, picture.static_picture.radar
    # A cell to either side: c / (2 B), and lambda / (2 P T).
    bandwidth_hz = radar.slope_hz_per_s * radar.num_samples / radar.sample_rate_hz
    assert data["width"][0] == pytest.approx(2.0 * 299_792_458.0 / (2.0 * bandwidth_hz))
    wavelength_m = 299_792_458.0 / radar.start_frequency_hz
    frame_s = radar.num_ramps * radar.ramp_period_s
    assert data["height"][0] == pytest.approx(2.0 * wavelength_m / (2.0 * frame_s), rel=1e-2)


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


def test_a_table_has_no_truth_where_none_is_known():
    html = table_html([TableRow(component_id=0, range_m=1.5, snr_db=20.0)], moving=True)
    assert "truth" not in html
    assert html.count("<td>") == 4
    assert 'class="unjudged"' in html


def test_the_strip_has_no_row_of_true_bursts_where_none_is_known(picture):
    strip = RampStrip()
    strip.update(picture)
    assert len(strip.figure.y_range.factors) == 2
    unknown = replace(picture.static_picture.observation, truth=None)
    static_picture = replace(picture.static_picture, observation=unknown)
    strip.update(replace(picture, static_picture=static_picture))
    assert strip.figure.y_range.factors == ["estimated bursts"]
    assert len(strip._source.data["ramp"]) == 16


def test_the_log_counts_what_is_frequent_and_does_not_list_it():
    quiet = {"kind": "quiet", "noun": "object candidate rejected"}
    lines = [
        LogLine(iteration=1, text="object candidate rejected, 8 dB", number=1, **quiet),
        LogLine(iteration=2, text="burst found in ramp 2", kind="burst"),
        LogLine(iteration=2, text="object candidate rejected, 9 dB", number=1, **quiet),
    ]
    html = log_html(lines)
    assert html.count("<li") == 1
    assert "Not listed: 2 object candidates rejected." in html


def test_the_log_shows_the_newest_line_first_and_escapes():
    lines = [
        LogLine(iteration=1, text="first", kind="added"),
        LogLine(iteration=2, text="<b>last</b>", kind="end"),
    ]
    html = log_html(lines)
    assert html.index("&lt;b&gt;last") < html.index("first")
    assert "Nothing" in log_html([])


def test_the_map_is_as_received_until_a_burst_is_cancelled_and_then_has_a_line(many_ramps):
    view = SwipedMap(Axis(), Span(dimension="height"))
    view.update(compose(many_ramps.snapshot(0), 0, "level"))
    assert not view._line.visible
    assert view.after.title.text == "Range-Doppler, received"
    view.update(compose(many_ramps.snapshot(), 0, "level"))
    assert view._line.visible
    assert "left of the line as received" in view.after.title.text
    view._x.range.update(start=0.0, end=30.0)
    view._line.location = 12.0
    for place in (0.0, 30.0, 0.0):
        view.swipe()
        assert view._line.location == place
    # The browser puts both together and says nothing of it.
    assert not view._shown.syncable


def test_a_browser_keeps_sizes_and_colours_of_figures_to_itself_but_not_what_is_shown():
    x, y = Axis(), Axis()
    plot = plain_figure("name", "Title", ("x", "y"), (x, y))
    quiet = [plot, plot.title, plot.toolbar, *plot.axis, *plot.grid]
    assert len(quiet) == 7
    assert not any(part.syncable for part in quiet)
    assert x.range.syncable
    assert y.range.syncable
