"""Layouts of raw captures that nobody described."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from vsep_app import assets

from tests.vsep.layout_scenes import LAYOUTS, SCENES, capture
from vsep.errors import InputError
from vsep.recordings.guess import Guess, guess_layouts
from vsep.recordings.missing_samples import prediction_error

JUDGED_SEED = 401  # the thresholds were chosen with seeds 1 to 6


def guessed(tmp_path: Path, content: bytes) -> tuple[Guess, ...]:
    (tmp_path / "adc.bin").write_bytes(content)
    return guess_layouts(str(tmp_path / "adc.bin"))


def test_the_right_layout_comes_first_in_at_least_23_of_24_captures(tmp_path: Path) -> None:
    right = []
    for number, layout in enumerate(LAYOUTS):
        for place, scene in enumerate(SCENES):
            rng = np.random.default_rng([JUDGED_SEED, number, place])
            guesses = guessed(tmp_path, capture(layout, scene, rng))
            right.append(tuple(guesses[0].settings.values()) == layout.settings)
    assert len(right) == 24
    assert sum(right) >= 23


def test_lost_packets_hide_no_layout(tmp_path: Path) -> None:
    layout = LAYOUTS[2]
    content = bytearray(capture(layout, "clutter", np.random.default_rng(JUDGED_SEED)))
    for packet in (9, 30, 31):
        content[packet * 1456 : (packet + 1) * 1456] = bytes(1456)
    (guess, *_) = guessed(tmp_path, bytes(3 * 1456) + bytes(content))
    assert guess.settings.pop("skip_bytes") == 3 * 1456
    assert tuple(guess.settings.values()) == layout.settings


def test_the_shipped_recording_is_told_from_its_words(tmp_path: Path) -> None:
    with np.load(assets.path("frames/openradar_doppler_example_1.npz")) as archive:
        received = archive["received"]
    pairs = (received / np.max(np.abs(received)) * 2000.0).reshape(128, 64, 2)
    words = np.rint(np.stack([pairs.real, pairs.imag], axis=-2)).astype("<i2")
    best = guessed(tmp_path, words.tobytes())[0]
    assert tuple(best.settings.values()) == ("dca1000-xwr16xx", "complex-1x", 128, 1, 1)


@pytest.mark.parametrize("number", [0, 2])
def test_a_capture_that_was_cut_off_keeps_its_layout(tmp_path: Path, number: int) -> None:
    layout = LAYOUTS[number]
    content = capture(layout, "clutter", np.random.default_rng(number))
    best = guessed(tmp_path, content[:-1234])[0]
    assert tuple(best.settings.values()) == layout.settings
    # Of the last ramp a part is missing.
    assert best.num_ramps == layout.num_ramps - 1


def test_the_picture_shows_the_echo_where_it_is(tmp_path: Path) -> None:
    rng = np.random.default_rng(4)
    ramp, _, time = np.ogrid[:64, :4, :128]
    # At a quarter of the rate one line looks the same in the order I Q.
    phases = np.array([0.0, 0.3, 0.85, 0.2])[:, None]
    samples = 500.0 * np.exp(2j * np.pi * (0.19 * time + 0.125 * ramp + phases))
    samples += rng.normal(size=samples.shape) + 1j * rng.normal(size=samples.shape)
    pairs = samples.reshape(64, 4, 64, 2)
    words = np.rint(np.stack([pairs.real, pairs.imag], axis=-2)).astype("<i2")
    best = guessed(tmp_path, words.tobytes())[0]
    assert (best.settings["num_samples"], best.settings["num_antennas"]) == (128, 4)
    row, column = np.unravel_index(np.argmax(best.picture), best.picture.shape)
    # Both axes from -1/2: 48 rows and 64 columns.
    assert abs(row - 48 * (0.5 + 0.125)) <= 1
    assert abs(column - 64 * (0.5 + 0.19)) <= 1


@pytest.mark.parametrize("number", [0, 3])
def test_frames_are_told_by_what_moves(tmp_path: Path, number: int) -> None:
    layout = LAYOUTS[number]
    content = capture(layout, "clutter", np.random.default_rng(number), num_frames=5)
    best = guessed(tmp_path, content)[0]
    assert tuple(best.settings.values()) == (*layout.settings, layout.num_ramps)
    assert best.num_ramps == 5 * layout.num_ramps


def test_one_frame_is_not_divided(tmp_path: Path) -> None:
    layout = replace(LAYOUTS[0], num_ramps=128)
    for scene in ("clutter", "interfered"):
        best = guessed(tmp_path, capture(layout, scene, np.random.default_rng(8)))[0]
        assert "num_ramps" not in best.settings


def test_noise_and_silence_are_refused(tmp_path: Path) -> None:
    noise = np.random.default_rng(1).normal(scale=100.0, size=40000).astype("<i2")
    for content in (noise.tobytes(), bytes(80000)):
        with pytest.raises(InputError, match="holds no echoes in any layout"):
            guessed(tmp_path, content)


def test_what_cannot_be_guessed_is_refused_in_one_sentence(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="holds 50 words"):
        guessed(tmp_path, bytes(100))
    with pytest.raises(InputError, match="no raw capture but a NumPy array"):
        guessed(tmp_path, b"\x93NUMPY" + bytes(100000))


def test_lines_are_predicted_and_noise_is_not() -> None:
    time = np.arange(2000)
    lines = np.exp(0.3j * time) + np.exp(1.1j * time)
    assert np.max(prediction_error(lines[None], 4)) < 1e-9
    turned = np.where(time < 1000, lines, 1j * lines)
    # The first sample after the turn is 1000; four before it are the first that are not predicted.
    assert int(np.argmax(prediction_error(turned[None], 4))) + 4 in range(1000, 1004)
