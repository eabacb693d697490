from dataclasses import replace

import numpy as np
import pytest

from vsep.studies.catalogue import CATALOGUE, make_study
from vsep.studies.figures import study_panels
from vsep.studies.panels import BoxPanel, FigurePanel
from vsep.studies.trial import failed_rows

METHODS = ("factorised", "object-only", "no-interference")


def rows_of(name, realizations=3):
    """Rows of a study as it could have gone: errors of half the bound, growing with the point."""
    study = make_study(name, realizations=realizations)
    rows = []
    for index, point in enumerate(study.points):
        for realization in range(realizations):
            for method in METHODS:
                trial = replace(study.trial(index, realization), methods=(method,))
                (row,) = failed_rows(trial, "")
                rows.append(row | finished(point, realization))
    return rows


def finished(point, realization):
    count = {"simulation-1": 1, "simulation-2": 3}.get(point.scene, 0)
    error = 1e-5 * (realization + 1)
    return {
        "status": "done",
        "reason": None,
        "num_ramps": 16 if point.scene == "simulation-2" else 1,
        "num_samples": 128,
        "num_objects_true": count,
        "num_objects": count + realization,
        "misses": 0,
        "false_alarms": realization,
        "errors": [error] * count,
        "beat_errors": [error] * count,
        "beat_stds": [2e-5] * count,
        "doppler_errors": [0.0] * count,
        "doppler_stds": [1e-3] * count,
        "root_crlb": 2e-5 if count else None,
        "separability_db": point.sir_db,
        "separability_weakest_db": point.sir_db - 30.0,
        "termination": "converged",
        "iteration_ms": 1.0,
        "operator_megabytes": 1.0,
        "mask_missed": 0.1,
    }


STATISTICAL = [name for name in CATALOGUE if not CATALOGUE[name].example]


@pytest.mark.parametrize("name", STATISTICAL)
def test_every_panel_of_a_whole_study_has_its_series(name):
    panels = study_panels(rows_of(name))
    assert panels
    shown = set()
    for panel in panels:
        if isinstance(panel, FigurePanel):
            assert panel.series
            assert panel.note
            for series in panel.series:
                shown.add(series.label)
                assert np.all(np.diff(series.x) > 0.0)
                sizes = {len(series.x), len(series.y), len(series.low), len(series.high)}
                assert len(sizes) == 1
    assert any("factorised" in label for label in shown)


def test_figure_3_shows_the_bound_and_both_filter_orders():
    panels = study_panels(rows_of("fig-3"))
    rmse = {
        panel.title[:7]: panel
        for panel in panels
        if panel.y_label == "RMSE [cycles/sample]" and panel.title.endswith("half a cell")
    }
    assert set(rmse) == {"Fig. 3a", "Fig. 3b", "Fig. 3c"}
    (bound,) = [series for series in rmse["Fig. 3b"].series if series.role == "bound"]
    assert bound.x.tolist() == [float(level) for level in range(-50, 11, 5)]
    assert bound.y == pytest.approx(np.full(13, 2e-5))
    labels = {series.label for series in rmse["Fig. 3c"].series}
    assert {"factorised, order 4", "factorised, order 8", "object-only, order 8"} <= labels
    (own,) = [series for series in rmse["Fig. 3b"].series if series.role == "factorised"]
    # Errors of 1, 2 and 3 times 1e-5.
    assert own.y == pytest.approx(np.full(13, 1e-5 * np.sqrt(14.0 / 3.0)))
    assert np.all(own.low <= own.y)
    assert np.all(own.y <= own.high)


def test_figure_5_has_boxes_of_both_readings_of_its_level():
    boxes = [panel for panel in study_panels(rows_of("fig-5")) if isinstance(panel, BoxPanel)]
    assert [box.title.rpartition(", ")[0] for box in boxes] == [
        *["Fig. 5g-i: SNR 60 dB, SIR 15 dB"] * 6,
        *["Fig. 5g-i: SNR 60 dB, SIR -15 dB"] * 6,
    ]
    assert [box.role for box in boxes[0].boxes] == list(METHODS)
    assert boxes[2].boxes[0].middle == 1.0


def test_a_condition_of_the_scene_is_drawn_once():
    panels = study_panels(rows_of("separability"))
    (whole,) = [p for p in panels if p.y_label == "condition (27), all objects [dB]"]
    assert [series.role for series in whole.series] == ["scene", "guide"]
    assert whole.series[0].y.tolist() == whole.series[0].x.tolist()
    (slopes,) = [p for p in panels if p.y_label == "condition (27) [dB]"]
    assert sum(series.role == "scene" for series in slopes.series) == 4
    assert "scene, slope 9.2 MHz/µs" in {series.label for series in slopes.series}


def test_the_reference_is_drawn_first():
    panels = study_panels(rows_of("fig-3"))
    assert panels
    for panel in panels:
        assert panel.series[0].role == "no-interference"


def test_a_part_of_a_study_shows_what_it_has_and_examples_show_nothing_here():
    some = [row for row in rows_of("fig-3") if row["point"]["panel"] == "3a"]
    assert {panel.title[:7] for panel in study_panels(some)} == {"Fig. 3a"}
    assert study_panels(failed_rows(make_study("fig-3").trial(0, 0), "lost")) == []
    assert study_panels(failed_rows(make_study("fig-2").trial(0, 0), "lost")) == []
    assert study_panels([]) == []
