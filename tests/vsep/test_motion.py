"""Objects move as their Doppler frequencies say."""

import numpy as np
import pytest

from vsep.errors import InputError
from vsep.presets.scenes import preset_radar
from vsep.signal.motion import moved_paths, moving_scenes
from vsep.signal.radar import SPEED_OF_LIGHT_MPS
from vsep.signal.scene import Channel, Scene

RADAR = preset_radar("simulation-2-a")


def paths(speed_mps):
    dopplers = 2.0 * np.array([speed_mps]) * RADAR.start_frequency_hz / SPEED_OF_LIGHT_MPS
    return Channel(delays_s=np.array([1e-7]), dopplers_hz=dopplers, weights=np.ones(1) + 0j)


def distance_m(channel):
    return channel.delays_s[0] * SPEED_OF_LIGHT_MPS / 2.0


@pytest.mark.parametrize("speed_mps", [8.0, -3.0])
def test_the_distance_grows_by_speed_times_time(speed_mps):
    channel = paths(speed_mps)
    moved = moved_paths(RADAR, channel, 0.05)
    assert distance_m(moved) - distance_m(channel) == pytest.approx(0.05 * speed_mps, rel=1e-9)
    # The same speed as the radar itself would name.
    doppler = RADAR.doppler_from_hz(channel.dopplers_hz)
    assert RADAR.velocity_from_doppler(doppler)[0] == pytest.approx(speed_mps)


def test_the_phase_turns_as_it_does_from_ramp_to_ramp():
    channel = paths(5.0)
    moved = moved_paths(RADAR, channel, RADAR.ramp_period_s)
    turn = np.exp(-2j * np.pi * RADAR.doppler_from_hz(channel.dopplers_hz))
    np.testing.assert_allclose(moved.weights, channel.weights * turn, rtol=1e-12)


def test_the_first_scene_is_the_scene_itself_and_cycles_follow():
    scene = Scene(objects=paths(10.0), snr_db=30.0)
    scenes = list(moving_scenes(RADAR, scene, 3, cycle_s=0.1))
    assert distance_m(scenes[0].objects) == distance_m(scene.objects)
    assert distance_m(scenes[2].objects) - distance_m(scene.objects) == pytest.approx(2.0)
    assert all(later.snr_db == 30.0 for later in scenes)


def test_a_sequence_without_frames_is_refused():
    scene = Scene(objects=paths(1.0), snr_db=30.0)
    with pytest.raises(InputError, match="num_frames is 0"):
        next(moving_scenes(RADAR, scene, 0))
