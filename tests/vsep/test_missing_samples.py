"""Samples that were never received: found, kept in frame files, and left out by the estimators."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from vsep.errors import InputError
from vsep.files.frame import Frame, read_frame, write_frame
from vsep.files.frame_mask import frame_mask
from vsep.inference.core.run import run
from vsep.inference.registry import make_estimator
from vsep.recordings.missing_samples import samples_before_ramp, zero_runs
from vsep.signal.radar import ChirpSequence
from vsep.signal.template import SignalModel

NUM_ANTENNAS, NUM_RAMPS, NUM_SAMPLES = 2, 16, 64
RADAR = ChirpSequence(
    start_frequency_hz=77e9,
    slope_hz_per_s=2e13,
    sample_rate_hz=1e7,
    ramp_period_s=4e-5,
    num_samples=NUM_SAMPLES,
    num_ramps=NUM_RAMPS,
)
NOISE = 0.005
BEATS, DOPPLERS = np.array([0.11, 0.27]), np.array([0.0, 0.2])


def lossy_frame(seed: int = 1) -> Frame:
    """Two objects, noise, and a tenth of the samples replaced by zeros."""
    rng = np.random.default_rng(seed)
    ramp, sample = np.ogrid[:NUM_RAMPS, :NUM_SAMPLES]
    shape = (NUM_ANTENNAS, NUM_RAMPS, NUM_SAMPLES)
    received = NOISE * (rng.normal(size=(*shape, 2)) @ np.array([1.0, 1.0j]))
    for beat, doppler in zip(BEATS, DOPPLERS, strict=True):
        phases = np.exp(1j * rng.uniform(0.0, 6.0, (NUM_ANTENNAS, 1, 1)))
        received += phases * np.exp(-2j * np.pi * (beat * sample + doppler * ramp))
    missing = np.zeros(shape, dtype=bool)
    missing.reshape(NUM_ANTENNAS, -1)[0, 100:220] = True
    missing.reshape(NUM_ANTENNAS, -1)[1, 500:580] = True
    received[missing] = 0.0
    return Frame(received=received[0], antennas=received, radar=RADAR, missing=missing)


def objects_of(name: str, frame: Frame, *, together: bool, told: bool, **settings: Any) -> Any:
    model = SignalModel.of_radar(RADAR, frame.assumed_filter, frame.num_antennas if together else 1)
    missing = frame.missing_rows(together=together) if told else None
    estimator = make_estimator(name, model, missing=missing, false_alarm_rate=1e-3, **settings)
    return run(estimator, frame.antennas if together else frame.received).state


@pytest.mark.parametrize(
    ("name", "together"),
    [
        ("factorised", True),
        ("factorised", False),
        ("joint", False),
        ("object-only", True),
        ("object-only", False),
        ("masked", False),
    ],
)
def test_estimators_leave_missing_samples_out(name: str, together: bool) -> None:
    frame = lossy_frame()
    state = objects_of(name, frame, together=together, told=True)
    order = np.argsort(state.objects.beats % 1.0)
    assert len(order) == 2
    # Deviations are sqrt(6 / (SNR P N)) / (2 pi N) = 1.3e-6 and 5e-6 with the number of ramps.
    np.testing.assert_allclose(state.objects.beats[order] % 1.0, BEATS, atol=1e-5)
    turned = (state.objects.dopplers[order] - DOPPLERS + 0.5) % 1.0 - 0.5
    np.testing.assert_allclose(turned, 0.0, atol=4e-5)
    assert not np.any(state.interference_signal)
    # Noise of both parts; its deviation over the frame is 1/sqrt(PN), 3 %.
    assert 1.0 / state.noise_precision == pytest.approx(2.0 * NOISE**2, rel=0.15)


def test_zeros_that_are_taken_for_samples_move_the_objects() -> None:
    state = objects_of("object-only", lossy_frame(), together=True, told=False)
    moved = np.abs(np.sort(state.objects.beats % 1.0) - BEATS)
    assert np.all(moved > 2e-5)
    assert 1.0 / state.noise_precision > 100.0 * 2.0 * NOISE**2


def test_missing_samples_survive_a_file(tmp_path: Path) -> None:
    frame = lossy_frame()
    write_frame(tmp_path / "a.npz", frame)
    again = read_frame(tmp_path / "a.npz", antenna=1)
    assert np.array_equal(again.missing, frame.missing)
    alone = again.of_antenna(1)
    assert np.array_equal(alone.missing, frame.missing[1:])
    assert np.array_equal(again.missing_rows(together=False), frame.missing[1])
    write_frame(tmp_path / "b.npz", alone)
    assert np.array_equal(read_frame(tmp_path / "b.npz").missing, frame.missing[1:])


def test_a_mask_of_interfered_samples_holds_the_missing_ones() -> None:
    frame = lossy_frame()
    assert frame.missing is not None
    mask = frame_mask(frame, "autoregressive")
    assert np.all(mask[frame.missing[0]])
    whole = replace(frame, missing=None)
    assert np.array_equal(mask, frame_mask(whole, "autoregressive") | frame.missing[0])


def test_what_is_no_mask_is_told() -> None:
    frame = lossy_frame()
    with pytest.raises(InputError, match=r"missing has shape .* must be boolean"):
        replace(frame, missing=frame.missing[0])
    with pytest.raises(InputError, match="not true everywhere"):
        replace(frame, missing=np.ones_like(frame.missing))
    model = SignalModel.of_radar(RADAR, frame.assumed_filter)
    with pytest.raises(InputError, match="missing has shape"):
        make_estimator("factorised", model, missing=np.zeros((3, 3), dtype=bool))


def test_single_zeros_are_samples() -> None:
    rng = np.random.default_rng(1)
    words = rng.integers(-3, 4, 5000)
    assert zero_runs(words) is None
    words[1000:1100] = 0
    runs = zero_runs(words)
    assert runs is not None
    assert np.all(runs[1000:1100])
    assert np.count_nonzero(runs) < 110
    # A converter that hardly moves gives long runs of its own.
    quiet = (rng.uniform(size=5000) < 0.02).astype(int)
    assert zero_runs(quiet) is None


@pytest.mark.parametrize("before", [0, 1, 17, 63])
def test_the_start_of_ramps_is_where_the_prediction_fails(before: int) -> None:
    rng = np.random.default_rng(2)
    ramp, sample = np.ogrid[:20, :64]
    signal = np.exp(2j * np.pi * (0.11 * sample)) + 0.3 * np.exp(
        2j * np.pi * (0.31 * sample + 0.13 * ramp)
    )
    signal = signal + 0.01 * (rng.normal(size=(20, 64, 2)) @ np.array([1.0, 1.0j]))
    course = signal.reshape(-1)[64 - before :] if before else signal.reshape(-1)
    assert samples_before_ramp(course, 64) == before
    noise = rng.normal(size=(1280, 2)) @ np.array([1.0, 1.0j])
    assert samples_before_ramp(noise, 64) == 0
