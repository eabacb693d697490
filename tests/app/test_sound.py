"""Sound of a frame, by the frequency that is heard."""

import numpy as np
import pytest
from vsep_app.jobs.tasks import frame_sound
from vsep_app.model.sound import LEAST_SECONDS, MOST_SECONDS, RATE_HZ, sound_of
from vsep_app.widgets.sound import CLEANED, NAMES, RECEIVED


def heard_hz(sound):
    """Strongest frequency of a sound."""
    return np.argmax(np.abs(np.fft.rfft(sound))) * RATE_HZ / len(sound)


@pytest.mark.parametrize("beat", [0.05, 0.2, 0.45])
def test_an_object_is_a_tone_that_is_higher_the_farther_it_is(beat):
    signal = np.exp(-2j * np.pi * beat * np.arange(8192)).reshape(32, 256)
    # half of the sampling rate is 4 kHz
    assert heard_hz(sound_of(signal)) == pytest.approx(beat * RATE_HZ, abs=RATE_HZ / 8192)


@pytest.mark.parametrize("shape", [(1, 64), (32, 256), (128, 512)])
def test_a_sound_is_neither_a_click_nor_without_end(shape):
    sound = sound_of(np.ones(shape, dtype=complex))
    assert LEAST_SECONDS <= len(sound) / RATE_HZ <= MOST_SECONDS
    assert np.abs(sound).max() == 1.0
    assert max(abs(sound[0]), abs(sound[-1])) < 0.02


def test_nothing_is_heard_of_an_empty_frame():
    assert not sound_of(np.zeros((4, 64), dtype=complex)).any()


def test_the_burst_is_heard_before_and_not_after(many_ramps):
    snapshot = many_ramps.snapshot()
    static, state = snapshot.prepared_run.static_picture, snapshot.steps[-1].state
    received = static.observation.received
    np.testing.assert_array_equal(frame_sound(snapshot), sound_of(received))
    cleaned = frame_sound(snapshot, cleaned=True)
    np.testing.assert_array_equal(cleaned, sound_of(state.cleaned(received)))
    # crest factor: a burst is loud for a moment, objects sound on
    assert np.std(cleaned) > 2.0 * np.std(frame_sound(snapshot))


def test_buttons_name_both():
    assert set(NAMES) == {RECEIVED, CLEANED}
