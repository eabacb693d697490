"""Tracks on measurements whose truth is known: names, births, ends, standard deviations."""

from dataclasses import replace

import numpy as np
import pytest

from vsep.presets.street_traffic import RADAR
from vsep.tracking.tracks import (
    CONFIRMED_HITS,
    MOST_MISSED,
    Measured,
    resolution_cells,
    updated_tracks,
)

CYCLE_S = 0.05
STD_M, STD_MPS = 0.02, 0.05


def measured(places, ids):
    """What a frame finds at these distances and velocities."""
    ranges, velocities = np.array(places, dtype=float).reshape(-1, 2).T
    count = len(ranges)
    return Measured(
        component_ids=np.array(ids, dtype=np.int64),
        ranges_m=ranges,
        velocities_mps=velocities,
        range_variances=np.full(count, STD_M**2),
        velocity_variances=np.full(count, STD_MPS**2),
        snr=np.full(count, 1e3),
    )


def followed(frames):
    """Tracks after each of some frames, (places, component ids)."""
    tracks, next_id, history = (), 1, []
    for number, (places, ids) in enumerate(frames):
        tracks, next_id = updated_tracks(
            tracks,
            measured(places, ids),
            RADAR,
            elapsed_s=CYCLE_S,
            next_id=next_id,
            frame_number=number,
        )
        history.append(tracks)
    return history


def at(track_history):
    return {track.track_id: track for track in track_history}


def test_objects_that_cross_keep_their_names():
    # One approaches, one recedes; where they meet in distance their velocities are 8 m/s apart, and
    # the components change their numbers in every frame.
    times = CYCLE_S * np.arange(40)
    frames = [
        ([(20.0 - 4.0 * t, -4.0), (16.0 + 4.0 * t, 4.0)], [2 * k, 2 * k + 1])
        for k, t in enumerate(times)
    ]
    last = at(followed(frames)[-1])
    assert {*last} == {1, 2}
    assert last[1].range_m == pytest.approx(20.0 - 4.0 * times[-1], abs=3 * STD_M)
    assert last[2].range_m == pytest.approx(16.0 + 4.0 * times[-1], abs=3 * STD_M)


def test_components_that_exchange_their_numbers_keep_their_tracks():
    near, far = (10.0, 0.0), (30.0, 0.0)
    history = followed([([near, far], [0, 1])] * 3 + [([far, near], [0, 1])])
    last = at(history[-1])
    assert {*last} == {1, 2}
    assert last[1].range_m == pytest.approx(10.0, abs=0.1)


def test_an_object_that_comes_back_has_its_name():
    speed = -10.0
    places = [[(40.0 + speed * CYCLE_S * k, speed)] for k in range(14)]
    seen = [place if not 5 <= k < 5 + MOST_MISSED else [] for k, place in enumerate(places)]
    frames = [(place, [k] * len(place)) for k, place in enumerate(seen)]
    history = followed(frames)
    assert [[track.track_id for track in tracks] for tracks in history] == [[1]] * 14
    (gone,) = history[4 + MOST_MISSED]
    assert gone.missed == MOST_MISSED
    # Predicted on, the less sure the longer.
    assert gone.range_m == pytest.approx(places[4 + MOST_MISSED][0][0], abs=3 * gone.range_std_m)
    assert gone.range_std_m > history[4][0].range_std_m


def test_an_object_that_leaves_is_forgotten_and_its_name_is_not_given_again():
    frames = [([(20.0, 0.0)], [0])] * 4 + [([], [])] * (MOST_MISSED + 1) + [([(20.0, 0.0)], [1])]
    history = followed(frames)
    assert history[-2] == ()
    assert [track.track_id for track in history[-1]] == [2]


def test_a_false_alarm_is_never_confirmed():
    frames = [([(12.0, 3.0)], [0]), ([], []), ([], []), ([(50.0, -8.0)], [1])]
    assert not any(track.is_confirmed for tracks in followed(frames) for track in tracks)
    steady = followed([([(12.0, 3.0)], [0])] * CONFIRMED_HITS)
    assert [tracks[0].is_confirmed for tracks in steady] == [False, False, True]


def test_the_filter_is_surer_than_a_measurement_and_rightly_so():
    rng = np.random.default_rng(3)
    errors = []
    for _ in range(40):
        frames = [
            (
                [(30.0 - 5.0 * CYCLE_S * k + STD_M * rng.normal(), -5.0 + STD_MPS * rng.normal())],
                [0],
            )
            for k in range(20)
        ]
        (track,) = followed(frames)[-1]
        errors.append((track.range_m - (30.0 - 5.0 * CYCLE_S * 19)) / track.range_std_m)
        assert track.range_std_m < STD_M
    # 40 squared errors of a filter that allows for accelerations there are not: their mean is at
    # most that of chi-square, whose own deviation is sqrt(2 / 40).
    assert np.mean(np.square(errors)) < 1.0 + 3.0 * np.sqrt(2.0 / 40)


def test_of_a_single_ramp_the_distance_alone_is_followed():
    radar = replace(RADAR, num_ramps=1)
    metres, speed = resolution_cells(radar)
    assert metres == pytest.approx(resolution_cells(RADAR)[0])
    assert np.isinf(speed)
    tracks, next_id = (), 1
    for number in range(4):
        found = measured([(20.0, 0.0)], [0])._replace(velocity_variances=np.array([np.inf]))
        tracks, next_id = updated_tracks(
            tracks, found, radar, elapsed_s=CYCLE_S, next_id=next_id, frame_number=number
        )
    (track,) = tracks
    assert track.is_confirmed
    assert track.range_m == pytest.approx(20.0)
