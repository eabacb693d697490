import re
from dataclasses import replace

import numpy as np
from vsep_app.pages.compare.maps import CompareMaps
from vsep_app.pages.compare.metrics import FrameResult, MethodMetrics
from vsep_app.pages.compare.results import CompareResults, table_html
from vsep_app.pages.compare.tasks import advance, compose, prepare
from vsep_app.views.tables import MISSING

from tests.app.test_compare_tasks import plan_of, snapshot_of


def picture_of(*methods, **changes):
    comparison = prepare(plan_of(*methods, **changes))
    step = advance(comparison, comparison.initial_state)
    return compose(snapshot_of(comparison, (step,)))


def cells(html):
    rows = re.findall("<tr>(.*?)</tr>", html)[1:]
    return [
        [re.sub("<.*?>", "", cell) for cell in re.findall("<td>(.*?)</td>", row)] for row in rows
    ]


def test_the_table_has_a_row_for_the_frame_and_each_method():
    picture = picture_of("pm-ist", "masked")
    received, prior, masked = cells(table_html(picture))
    assert [received[0], prior[0], masked[0]] == ["as received", "pm-ist", "masked"]
    assert received[2] == MISSING
    # One iteration of the repair, one of the estimator.
    assert (prior[2], masked[2]) == ("1", "1")
    assert (prior[4], prior[10], masked[10]) == (MISSING, "0 peaks", MISSING)
    assert prior[6] == f"{picture.method_runs[0].metrics.windowed_error_db:.1f}"
    assert masked[4] == str(picture.method_runs[1].metrics.misses)
    assert [received[8], received[9]] == [
        f"{picture.received.nsinr_db:.1f}",
        f"{picture.received.gtnr:.2f}",
    ]


def test_earlier_frames_are_in_the_curves():
    results = CompareResults()
    picture = picture_of("linear", "masked")
    past = tuple(
        FrameResult(
            frame_number=number,
            method_runs=(MethodMetrics(windowed_error_db=-8.0 - number), MethodMetrics()),
        )
        for number in range(2)
    )
    later = type(picture)(**{**vars(picture), "past": past, "frame_number": 2})
    results.show(later)
    first, second, third, _ = results._sources
    assert first.data["frame"] == [0, 1, 2]
    now = picture.method_runs[0].metrics.windowed_error_db
    np.testing.assert_array_equal(first.data["error"], [-8.0, -9.0, now])
    assert np.isnan(second.data["error"][0])
    assert third.data["frame"] == []


def test_the_maps_show_the_cleaned_frames_and_their_objects():
    maps = CompareMaps()
    picture = picture_of("zeroing", "factorised")
    maps.show(picture)
    assert maps.grid.css_classes == ["of-2"]
    assert [card.column.visible for card in maps.methods] == [True, True, False, False]
    for card, view in zip(maps.methods, picture.method_runs, strict=False):
        np.testing.assert_array_equal(card.plots.image.data["image"][0], view.map_cleaned)
        np.testing.assert_array_equal(card.marks.data["range"], view.objects.ranges_m)
        assert card.plots.map.title.text == f"{view.name}: {view.score.text}"
    assert picture.method_runs[1].objects.ranges_m.size > 0


def test_the_maps_begin_with_the_frame_as_received_and_without_interference():
    maps = CompareMaps()
    picture = picture_of("zeroing", "factorised")
    maps.show(picture)
    static_picture = picture.static_picture
    observation = static_picture.observation
    received, without = (card.plots.image.data["image"][0] for card in (maps.received, maps.truth))
    np.testing.assert_array_equal(received, static_picture.map_before)
    clean = observation.received - observation.truth.interference_signal
    np.testing.assert_array_equal(without, static_picture.map_of(clean))
    # What the bursts raise is noise again.
    assert np.median(received) > np.median(without) + 50
    unknown = replace(static_picture, observation=replace(observation, truth=None))
    maps.show(replace(picture, static_picture=unknown))
    assert not maps.truth.column.visible
    assert maps.received.column.css_classes == ["received", "alone"]


def test_a_single_ramp_is_a_curve():
    maps = CompareMaps()
    picture = picture_of("linear", "factorised", preset="simulation-1")
    maps.show(picture)
    card = maps.methods[1]
    assert (card._map_pane.visible, card._profile_pane.visible) == (False, True)
    np.testing.assert_array_equal(card.plots.line.data["level"], picture.method_runs[1].profile_db)
