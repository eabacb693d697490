"""Sequences on the street, whose truth is known: identities, and what a cold start finds."""

import pickle
from collections import defaultdict
from dataclasses import replace
from typing import NamedTuple

import numpy as np
import pytest

import vsep
from vsep.errors import InputError
from vsep.inference.deviations import state_deviations
from vsep.inference.factorised import FactorisedSeparator
from vsep.presets.scenes import preset
from vsep.presets.street import street_frame
from vsep.presets.street_traffic import RADAR
from vsep.signal.linear_array import AntennaScene, UniformLinearArray
from vsep.signal.motion import moving_scenes
from vsep.signal.simulate import simulate_antennas
from vsep.signal.template import SignalModel
from vsep.tracking.sequence import SequenceSeparator, SequenceState
from vsep.tracking.sources import frame_of_street, street_sequence
from vsep.tracking.tracks import MOST_MISSED, resolution_cells
from vsep.tracking.warm_start import separate_cold

SEED, NUM_FRAMES = 1, 100
SETTLED_FRAMES = 4  # in view: a track is confirmed by the third at the latest
COMPARED = (12, 24, 43, 66, 98)  # one or two interferers, a car that passes at 4 m
SAME = 0.1  # deviations, root mean square over a frame's objects
WORST = 0.5  # deviations, of one frequency of one object


class Played(NamedTuple):
    """The street with its truth, and what was made of it."""

    streets: list
    results: list


def played(**options):
    """Separate the street frame after frame."""
    streets = [street_frame(number, seed=SEED, **options) for number in range(NUM_FRAMES)]
    return Played(streets, list(vsep.track(frame_of_street(each) for each in streets)))


@pytest.fixture(scope="module")
def interfered():
    return played()


@pytest.fixture(scope="module")
def interference_free():
    return played(interference=False)


def names_of_tracks(run):
    """For every true object the tracks that were at its place, frame after frame, 0 for none."""
    metres, speed = resolution_cells(RADAR)
    found = defaultdict(list)
    for street, result in zip(run.streets, run.results, strict=True):
        truth = street.observation.truth
        places = zip(
            RADAR.range_from_beat(truth.beats),
            RADAR.velocity_from_doppler(truth.dopplers),
            strict=True,
        )
        for name, (distance, velocity) in zip(street.names, places, strict=True):
            near = [
                track.track_id
                for track in result.confirmed_tracks
                if abs(track.range_m - distance) < 0.5 * metres
                and abs(track.velocity_mps - velocity) < 0.5 * speed
            ]
            found[name].append(near[0] if near else 0)
    return found


def test_every_object_has_one_name_as_long_as_it_is_in_view(interfered):
    for name, tracks in names_of_tracks(interfered).items():
        if len(tracks) > 2 * SETTLED_FRAMES:
            assert len({*tracks} - {0}) == 1, name
            # A far car's second reflection comes into view below the threshold.
            assert np.mean(np.array(tracks[SETTLED_FRAMES:]) > 0) > 0.9, name


def test_no_name_is_lost_that_the_run_without_interference_keeps(interfered, interference_free):
    lost = {
        name: (ours, free)
        for (name, ours), free in zip(
            names_of_tracks(interfered).items(),
            names_of_tracks(interference_free).values(),
            strict=True,
        )
        if len({*free} - {0}) == 1 and len({*ours} - {0}) > 1
    }
    assert lost == {}


def test_no_track_follows_what_is_not_there(interfered):
    for street, result in zip(interfered.streets, interfered.results, strict=True):
        seen = [track for track in result.confirmed_tracks if track.missed == 0]
        assert len(seen) <= len(street.names) + 1


def test_an_object_that_leaves_is_dropped_and_one_that_comes_is_born(interfered):
    names = [street.names for street in interfered.streets]
    last = max(number for number, seen in enumerate(names) if "car 1" in seen)
    first = min(number for number, seen in enumerate(names) if "pedestrian 1" in seen)
    tracks = names_of_tracks(interfered)
    (car,), (pedestrian,) = ({*tracks[name]} - {0} for name in ("car 1", "pedestrian 1"))
    alive = [{track.track_id for track in result.tracks} for result in interfered.results]
    assert car in alive[last]
    assert car not in alive[last + MOST_MISSED + 2]
    (track,) = [
        each for each in interfered.results[first + 4].tracks if each.track_id == pedestrian
    ]
    assert first <= track.born <= first + 1


def test_a_frame_without_interference_is_recognised(interfered):
    for street, result in zip(interfered.streets[1:], interfered.results[1:], strict=True):
        truth = street.observation.truth
        clean = not np.any(truth.perfect_mask())
        assert result.start == ("clean" if clean else "warm"), result.number
        assert clean == (len(result.state.bursts) == 0)


@pytest.mark.parametrize("number", [3, 35, 70])
def test_a_clean_frame_is_what_a_cold_start_finds(interfered, number):
    assert interfered.results[number].start == "clean"
    differences = differences_from_cold(interfered, number)
    assert np.abs(differences).max() < SAME


@pytest.mark.parametrize("number", COMPARED)
def test_an_interfered_frame_is_what_a_cold_start_finds(interfered, number):
    assert interfered.results[number].start == "warm"
    differences = differences_from_cold(interfered, number)
    # Channel components at their threshold are there in one of both and not in the other.
    assert np.sqrt(np.mean(np.square(differences))) < 1.5 * SAME
    assert np.abs(differences).max() < WORST


def differences_from_cold(run, number):
    """Beats and Dopplers of all objects against a cold start, in deviations."""
    frame = run.results[number].frame
    model = SignalModel.of_radar(frame.radar, frame.assumed_filter)
    cold = separate_cold(FactorisedSeparator(model=model), frame.received).solution.state
    warm = run.results[number].state
    std = state_deviations(cold, RADAR.shape, RADAR.migration)
    assert warm.objects.num_components == cold.objects.num_components
    order, other = (np.argsort(each.objects.beats) for each in (cold, warm))
    return np.concatenate(
        [
            (warm.objects.beats[other] - cold.objects.beats[order]) / std.beats[order],
            (warm.objects.dopplers[other] - cold.objects.dopplers[order]) / std.dopplers[order],
        ]
    )


def test_the_same_frame_again_costs_nothing_and_the_next_one_is_two_cycles_later():
    frames = list(street_sequence(seed=SEED, num_frames=12))
    *_, before, again, after = vsep.track([*frames[:10], frames[9], frames[11]])
    assert again.start == "repeated"
    assert again.solution is not None
    assert again.state.objects is before.state.objects
    assert [track.mean.tolist() for track in again.tracks] == [
        track.mean.tolist() for track in before.tracks
    ]
    assert again.seconds < 0.25 * before.seconds
    assert after.start != "cold"
    assert {track.track_id for track in before.confirmed_tracks} == {
        track.track_id for track in after.confirmed_tracks
    }


def test_a_step_is_pure_and_its_state_read_only():
    first, second = street_sequence(seed=SEED, num_frames=2)
    separator = SequenceSeparator()
    state, _ = separator.step(first, SequenceState())
    content = pickle.dumps(state)
    once, twice = separator.step(second, state)[1], separator.step(second, state)[1]
    assert pickle.dumps(state) == content
    np.testing.assert_array_equal(once.state.objects.beats, twice.state.objects.beats)
    for array in (state.received, state.tracks[0].mean, once.state.object_signal):
        assert not array.flags.writeable


def test_a_state_does_not_grow(interfered):
    sizes = []
    state = SequenceState()
    for result in interfered.results[:40]:
        state, _ = SequenceSeparator().step(result.frame, state)
        sizes.append(len(pickle.dumps(state)))
    # Frame, two signals, weights and the objects; not what was before.
    assert max(sizes[20:]) < 1.5 * max(sizes[:20])


def test_another_radar_begins_anew():
    first, second, third = street_sequence(seed=SEED, num_frames=3)
    shorter = replace(
        third,
        received=third.received[:16],
        radar=replace(third.radar, num_ramps=16),
        truth=None,
    )
    *_, last = vsep.track([first, second, shorter])
    assert last.start == "cold"
    assert all(track.hits == 1 for track in last.tracks)


def test_cold_frames_are_followed_as_well():
    frames = list(street_sequence(seed=SEED, num_frames=4))
    results = list(vsep.track(frames, warm=False))
    assert [result.start for result in results] == ["cold"] * 4
    assert len(results[-1].confirmed_tracks) >= 8


def test_several_antennas_are_followed_together():
    scenario = preset("simulation-2-b", snr_db=60.0, sir_db=-20.0, rng=np.random.default_rng(1))
    rng = np.random.default_rng(2)
    frames = []
    for scene in moving_scenes(scenario.radar, scenario.scene, 3):
        received = simulate_antennas(
            scenario.radar,
            AntennaScene(
                scene=scene,
                antennas=UniformLinearArray(num_antennas=2),
                object_angles_deg=np.linspace(-40.0, 40.0, scene.objects.num_paths),
                interferer_angles_deg=np.array([10.0]),
            ),
            anti_aliasing_filter=scenario.anti_aliasing_filter,
            rng=rng,
        ).received
        frames.append(
            vsep.Frame(
                received=received[0],
                antennas=received,
                radar=scenario.radar,
                anti_aliasing_filter=scenario.anti_aliasing_filter,
            )
        )
    results = list(vsep.track(frames))
    assert [result.start for result in results] == ["cold", "warm", "warm"]
    assert len(results[-1].confirmed_tracks) >= 9
    assert results[-1].state.objects.amplitudes.shape[1] == 2


def test_samples_that_were_never_received_are_no_interference():
    missing = np.zeros((1, *RADAR.shape), np.bool_)
    missing[0, :, 40:60] = True
    frames = [
        replace(frame, received=np.where(missing[0], 0.0, frame.received), missing=missing)
        for frame in street_sequence(seed=SEED, num_frames=4)
    ]
    results = list(vsep.track(frames))
    assert [result.start for result in results] == ["cold", "clean", "clean", "clean"]
    assert len(results[-1].confirmed_tracks) >= 8


def noise_frames(count):
    """Frames without any object."""
    (like,) = street_sequence(seed=SEED, num_frames=1)
    draws = np.random.default_rng(4).standard_normal((count, 2, *RADAR.shape))
    return [replace(like, received=draw[0] + 1j * draw[1], truth=None) for draw in draws]


def test_noise_alone_is_clean_and_has_no_tracks():
    results = list(vsep.track(noise_frames(4)))
    assert [result.start for result in results] == ["cold", "clean", "clean", "clean"]
    assert not any(result.confirmed_tracks for result in results)


def test_a_frame_that_has_nothing_of_the_last_one_begins_anew():
    (street,) = street_sequence(seed=SEED, num_frames=1)
    noise = noise_frames(2)
    louder = replace(street, received=street.received * 1e3)
    # Objects 100 dB over the noise before, and a frame that is interfered in nearly all samples.
    flooded = noise[0].received.copy()
    flooded[:, ::2] *= 1e4
    flooded[:, 1::4] *= 1e3
    frames = [*noise, louder, replace(noise[0], received=flooded)]
    assert [result.start for result in vsep.track(frames)][2:] == ["cold", "cold"]


@pytest.mark.parametrize(
    ("settings", "sentence"),
    [
        ({"cycle_s": 0.0}, "cycle_s is 0 s; it must lie between 0.0001 and 10 s"),
        ({"speed": 3}, "speed is 3; a sequence takes none"),
        ({"false_alarm_rate": -1.0}, "false_alarm_rate is -1"),
    ],
)
def test_a_setting_that_cannot_be_used_is_named(settings, sentence):
    frames = street_sequence(seed=SEED, num_frames=1)
    with pytest.raises(InputError, match=sentence):
        list(vsep.track(frames, **settings))


def test_what_is_no_frame_is_named():
    with pytest.raises(InputError, match=r"'frame\.npz' is no frame; read_frame makes one"):
        list(vsep.track(["frame.npz"]))
