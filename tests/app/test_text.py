import numpy as np
import pytest
from vsep_app.model.text import Located, iteration_lines, log_lines, resolution_cells, table_rows

from vsep.inference.core.progress import ComponentEvent, EventKind, IterationInfo


def _info(*events):
    return IterationInfo(
        elbo=0.0,
        events=events,
        max_frequency_change=0.0,
        noise_precision_change=0.0,
        searched=False,
        separability_ratio_db=0.0,
    )


def _event(kind, snr_db=31.2, **place):
    return ComponentEvent(kind=kind, snr_db=snr_db, threshold_db=11.0, **place)


def _texts(radar, *events):
    return [line.text for line in iteration_lines(4, _info(*events), radar)]


def test_an_object_is_told_in_metres_and_metres_a_second(small_radar):
    beat = float(small_radar.beat_from_delay(80e-9))
    event = _event(EventKind.OBJECT_ADDED, beat=beat, doppler=-0.125, component_id=3)
    velocity = -0.125 / 25e-6 * 299_792_458.0 / (2.0 * 79e9)
    assert _texts(small_radar, event) == [f"object added at 12.0 m, {velocity:+.1f} m/s, 31 dB"]


def test_a_burst_is_told_with_its_ramp(small_radar):
    event = _event(EventKind.CHIRP_STARTED, ramp=2)
    assert _texts(small_radar, event) == ["burst found in ramp 2, 31 dB"]


def test_a_rejected_candidate_is_told_with_the_threshold(small_radar):
    event = _event(EventKind.OBJECT_REJECTED, snr_db=8.4)
    assert _texts(small_radar, event) == ["object candidate rejected, 8 dB (threshold 11.0 dB)"]


def test_corrections_of_the_filter_belong_to_no_ramp(small_radar):
    events = [_event(EventKind.FILTER_ADDED), _event(EventKind.FILTER_ADDED)]
    assert _texts(small_radar, *events) == ["2 filter corrections added"]


def test_channel_events_are_counted(small_radar):
    events = [_event(EventKind.CHANNEL_ADDED, ramp=ramp, bin=1) for ramp in (0, 2, 2)]
    events.append(_event(EventKind.CHANNEL_PRUNED, ramp=3, bin=4))
    assert _texts(small_radar, *events) == [
        "3 interference paths added in 2 ramps",
        "1 interference path pruned in ramp 3",
    ]


def test_the_log_ends_with_why_the_run_ended(many_ramps):
    steps, radar = many_ramps.steps, many_ramps.prepared.static_picture.radar
    lines = log_lines(steps, radar)
    assert lines[-1].text == steps[-1].termination.value
    assert [line.iteration for line in lines] == sorted(line.iteration for line in lines)
    added = sum(e.kind is EventKind.OBJECT_ADDED for s in steps for e in s.info.events)
    assert sum(line.kind == "added" for line in lines) == added


def _located(ranges, velocities):
    spread = np.full(len(ranges), 0.01)
    return Located(
        ids=tuple(range(len(ranges))),
        ranges_m=np.array(ranges),
        velocities_mps=np.array(velocities),
        range_std_m=spread,
        velocity_std_mps=spread,
        snr_db=np.full(len(ranges), 20.0),
    )


def _rows(radar, found, true_ranges, true_velocities):
    true = np.array(true_ranges)
    return table_rows(found, true, np.array(true_velocities), np.full(len(true), 20.0), radar)


def test_an_estimate_within_a_cell_belongs_to_the_object(small_radar):
    cell_m, _ = resolution_cells(small_radar)
    rows = _rows(small_radar, _located([10.0 + 0.9 * cell_m], [0.0]), [10.0], [0.0])
    assert [row.true_range_m for row in rows] == [10.0]


def test_an_estimate_beyond_a_cell_is_extra_and_the_object_missed(small_radar):
    cell_m, _ = resolution_cells(small_radar)
    rows = _rows(small_radar, _located([10.0 + 1.1 * cell_m], [0.0]), [10.0], [0.0])
    assert [(row.component_id, row.true_range_m) for row in rows] == [(None, 10.0), (0, None)]


def test_the_velocity_counts_and_wraps(small_radar):
    _, cell_mps = resolution_cells(small_radar)
    unambiguous = cell_mps * small_radar.num_ramps
    apart = _rows(small_radar, _located([10.0], [2.0 * cell_mps]), [10.0], [0.0])
    assert len(apart) == 2
    across = _rows(small_radar, _located([10.0], [unambiguous / 2.0]), [10.0], [-unambiguous / 2.0])
    assert len(across) == 1


def test_each_object_has_at_most_one_estimate(small_radar):
    rows = _rows(small_radar, _located([10.0, 10.1], [0.0, 0.0]), [10.02], [0.0])
    assert [row.true_range_m for row in rows] == [10.02, None]


def test_cells_are_those_of_the_textbook(small_radar):
    cell_m, cell_mps = resolution_cells(small_radar)
    bandwidth = 1e13 * 32 / 5.1e6
    assert cell_m == pytest.approx(299_792_458.0 / (2.0 * bandwidth))
    assert cell_mps == pytest.approx(299_792_458.0 / (2.0 * 79e9 * 4 * 25e-6))
