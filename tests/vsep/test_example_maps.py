"""Pictures of single trials: time-frequency planes and range-Doppler maps."""

import numpy as np
import pytest

from vsep.studies.catalogue import make_study
from vsep.studies.example import example_panels
from vsep.studies.panels import FigurePanel, ImagePanel
from vsep.studies.trial import run_trial


def panels_of(name, *methods):
    return example_panels(run_trial(make_study(name, methods=methods).trial(0, 0)))


def test_a_burst_is_a_slope_in_the_time_frequency_plane_and_objects_are_level():
    objects, bursts, lines = panels_of("fig-1", "object-only")
    assert isinstance(objects, ImagePanel)
    assert isinstance(lines, FigurePanel)
    course = bursts.y[np.argmax(bursts.levels_db, axis=0)]
    inside = np.max(bursts.levels_db, axis=0) > bursts.levels_db.max() - 6.0
    # Set a, one of three that take turns: Delta k = -167.9 GHz/s; the paper's sign turns it round.
    slope = np.polyfit(bursts.x[inside], course[inside], 1)[0]
    assert abs(slope) == pytest.approx(0.1679, rel=0.1)
    assert np.ptp(objects.y[np.argmax(objects.levels_db, axis=0)]) < 0.2


def test_maps_count_misses_and_false_alarms_against_the_frame_without_bursts():
    before, interfered, cleaned, lines = panels_of("fig-7", "factorised")
    counts = [[series.label for series in panel.series] for panel in (before, interfered, cleaned)]
    assert counts[0] == ["detections"]
    found = {label.split()[1]: int(label.split()[0]) for label in counts[2]}
    assert found["detections"] >= 27
    lost = {label.split()[1]: int(label.split()[0]) for label in counts[1]}
    assert lost["missed"] >= 20
    assert {panel.levels_db.shape for panel in (before, interfered, cleaned)} == {(256, 256)}
    assert [series.label for series in lines.series] == ["received", "mitigated", "object estimate"]
