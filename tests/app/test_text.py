from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from vsep_app.jobs.tasks import compose
from vsep_app.model.text import (
    Located,
    headline,
    iteration_lines,
    log_lines,
    resolution_cells,
    table_rows,
)

from vsep.inference.core.progress import ComponentEvent, EventKind, IterationInfo, Termination
from vsep.inference.core.receiver import PhasePrior, no_errors


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


def test_errors_of_the_receiver_are_told_once_in_the_units_of_the_controls(small_radar):
    ramps = small_radar.num_ramps
    errors = replace(
        no_errors(ramps, 1),
        prior=PhasePrior(jitter_std=0.005, noise_std=0.01, half_width=0.01),
        image_factors=np.array([0.02j]),
        offsets=np.array([2.0 + 0j]),
    )
    info = _info(_event(EventKind.RECEIVER_CHANGED))
    states = [
        SimpleNamespace(iteration=number, receiver=receiver, noise_precision=4.0)
        for number, receiver in ((3, errors), (5, errors), (7, None))
    ]
    steps = [
        SimpleNamespace(state=state, info=info, termination=Termination.RUNNING) for state in states
    ]
    first, last = (line.text for line in log_lines(steps, small_radar))
    width_khz = 1e-3 * 0.01 * small_radar.sample_rate_hz
    assert first == (
        "oscillator and receiver: Phase jitter 5 mrad; Phase noise 10 mrad; "
        f"Phase noise bandwidth {width_khz:.3g} kHz; I/Q gain error 0 dB; "
        "I/Q phase error 2.29 °; DC offset 4 noise deviations"
    )
    assert last == "oscillator and receiver: no error is evident any more"


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


def test_rows_are_sorted_by_distance_with_the_misses_among_them(small_radar):
    true = np.array([30.0, 10.0]), np.zeros(2), np.full(2, 20.0)
    rows = table_rows(_located([20.0, 10.1], [0.0, 0.0]), *true, small_radar, {1: 1})
    assert [(row.component_id, row.true_range_m) for row in rows] == [
        (1, 10.0),
        (0, None),
        (None, 30.0),
    ]


def test_cells_are_those_of_the_textbook(small_radar):
    cell_m, cell_mps = resolution_cells(small_radar)
    bandwidth = 1e13 * 32 / 5.1e6
    assert cell_m == pytest.approx(299_792_458.0 / (2.0 * bandwidth))
    assert cell_mps == pytest.approx(299_792_458.0 / (2.0 * 79e9 * 4 * 25e-6))


@pytest.mark.parametrize(
    ("shown", "words"),
    [
        (0, "10 objects and bursts of another radar in 4 ramps. Nothing is estimated yet."),
        (1, "Iteration 1: "),
        (None, "Converged after "),
    ],
)
def test_the_headline_says_how_far_the_run_is(many_ramps, shown, words):
    snapshot = many_ramps.snapshot(shown)
    picture = compose(snapshot, 0, "level")
    assert picture.headline.startswith(words)
    if snapshot.steps:
        assert picture.headline.endswith(f"{picture.score.text}.")


def test_the_headline_tells_what_was_found(small_radar):
    beat = float(small_radar.beat_from_delay(80e-9))
    event = _event(EventKind.OBJECT_ADDED, beat=beat, doppler=0.0, component_id=3)
    step = SimpleNamespace(
        state=SimpleNamespace(iteration=4),
        info=_info(_event(EventKind.CHIRP_STARTED, ramp=6), event),
        termination=Termination.RUNNING,
    )
    told = headline([step], small_radar, num_bursts=4, num_found=4, score=None)
    assert told == ("Iteration 4: burst found in ramp 6, object found at 12.0 m. 4 objects so far.")
