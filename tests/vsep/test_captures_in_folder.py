"""Captures that come into a folder, saturated words, and figures of their interference."""

import os
from pathlib import Path

import numpy as np
import pytest

from vsep.errors import InputError
from vsep.files.frame import Frame
from vsep.inference.core.run import run
from vsep.inference.registry import make_estimator
from vsep.presets.scenes import simulate_preset
from vsep.recordings.captures_in_folder import FolderState, existing, next_captures
from vsep.recordings.interference_figures import InterferenceFigures, interference_figures
from vsep.recordings.raw_words import read_raw
from vsep.recordings.saturation import saturated_words
from vsep.recordings.settings import RecordingSettings
from vsep.signal.template import SignalModel


def names(captures: tuple[tuple[str, float], ...]) -> list[str]:
    return [Path(path).name for path, _ in captures]


def test_a_capture_is_returned_once_and_when_it_has_stopped_growing(tmp_path: Path) -> None:
    (tmp_path / "before.bin").write_bytes(b"1")
    state = existing(tmp_path)
    (tmp_path / "b.bin").write_bytes(b"12")
    (tmp_path / "notes.txt").write_text("none")
    state, captures = next_captures(tmp_path, state)
    assert captures == ()
    (tmp_path / "b.bin").write_bytes(b"1234")
    state, captures = next_captures(tmp_path, state)
    assert captures == ()
    state, captures = next_captures(tmp_path, state)
    assert names(captures) == ["b.bin"]
    state, captures = next_captures(tmp_path, state)
    assert captures == ()
    # A file of the same name, written anew after it was removed, is another capture.
    (tmp_path / "b.bin").unlink()
    state, _ = next_captures(tmp_path, state)
    (tmp_path / "b.bin").write_bytes(b"56")
    state, _ = next_captures(tmp_path, state)
    assert names(next_captures(tmp_path, state)[1]) == ["b.bin"]


def test_captures_come_in_the_order_in_which_they_were_written(tmp_path: Path) -> None:
    for number, name in enumerate(("z.bin", "a.npy", "m.mat")):
        (tmp_path / name).write_bytes(b"1")
        os.utime(tmp_path / name, (100.0, 100.0 + number))
    (tmp_path / "empty.bin").touch()
    state, _ = next_captures(tmp_path, FolderState())
    state, captures = next_captures(tmp_path, state)
    assert names(captures) == ["z.bin", "a.npy", "m.mat"]
    assert [written for _, written in captures] == [100.0, 101.0, 102.0]
    with pytest.raises(InputError, match="cannot be watched: No such file"):
        next_captures(tmp_path / "nowhere", state)


def test_words_at_full_scale_are_counted_and_missing(tmp_path: Path) -> None:
    rng = np.random.default_rng(1)
    words = np.rint(rng.normal(scale=3000.0, size=(16, 2, 16, 2, 2)))
    words[3, 1, 5] = 2**15 - 1
    words[7, 0, 2, 1] = -(2**15)
    words[9, 0, 2, :] = -(2**15)
    words.astype("<i2").tofile(tmp_path / "adc.bin")
    settings = RecordingSettings(
        format="dca1000-xwr16xx",
        start_frequency_hz=77e9,
        slope_hz_per_s=2e13,
        sample_rate_hz=1e7,
        ramp_period_s=4e-5,
        num_samples=32,
        num_antennas=2,
    )
    found = read_raw(str(tmp_path / "adc.bin"), settings)
    assert found.missing is not None
    expected = np.zeros((16, 2, 32), bool)
    expected[3, 1, 10:12] = expected[7, 0, 4:6] = expected[9, 0, 4:6] = True
    assert np.array_equal(found.missing, expected)
    assert any(
        remark.startswith("6 samples (0.59%) in 3 of 16 ramps are saturated")
        for remark in found.remarks
    )


def test_the_largest_word_alone_is_not_saturated() -> None:
    words = np.array([2047, -2048, 2047, 17, -3])
    assert saturated_words(words, 12) is None
    assert saturated_words(np.full(4, 2046), 12) is None


def figures(**changes: float) -> InterferenceFigures:
    usual = {
        "sample_share": 0.1,
        "ramp_share": 0.5,
        "saturated_samples": 0,
        "saturated_share": 0.0,
        "inr_db": 30.0,
        "floor_rise_db": 20.0,
        "blanking_loss_db": 0.9,
    }
    return InterferenceFigures(**(usual | changes))


def test_the_verdict_follows_from_the_figures() -> None:
    assert figures(sample_share=0.0, floor_rise_db=0.0).verdict == "Yes: nothing interferes."
    assert figures(floor_rise_db=0.4).verdict.startswith("Yes, as they are")
    assert figures().verdict.startswith("Yes, with separation")
    assert figures(sample_share=0.5).verdict.startswith("No: 50% of the samples are hit")
    assert figures(saturated_share=0.02).verdict.startswith("No: 2.0% of the samples are saturated")
    sides = [figures().can_run_side_by_side, figures(sample_share=0.5).can_run_side_by_side]
    assert sides == [True, False]


def test_the_figures_are_those_of_the_simulated_interference() -> None:
    preset, observation = simulate_preset("simulation-2-b", snr_db=60.0, sir_db=-20.0, seed=7)
    frame = Frame(received=observation.received, radar=preset.radar)
    model = SignalModel.of_radar(preset.radar, preset.anti_aliasing_filter)
    state = run(make_estimator("factorised", model), frame.received).state
    found = interference_figures(frame, state)
    truth = observation.truth
    noise = float(
        np.mean(np.abs(frame.received - truth.object_signal - truth.interference_signal) ** 2)
    )
    power = np.abs(truth.interference_signal) ** 2 / noise
    assert found.sample_share == pytest.approx(np.mean(power > 1.0), rel=0.1)
    assert found.ramp_share == np.mean((power > 1.0).any(axis=1))
    assert found.inr_db == pytest.approx(10.0 * np.log10(power[power > 1.0].mean()), abs=1.0)
    assert found.floor_rise_db == pytest.approx(10.0 * np.log10(1.0 + power.mean()), abs=1.0)
    assert found.saturated_samples == 0
