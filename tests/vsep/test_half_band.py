"""`vsep.recordings.half_band`: real samples as complex ones, with lines as the truth."""

import numpy as np
import pytest

from vsep.errors import InputError
from vsep.inference.core.run import run
from vsep.inference.registry import make_estimator
from vsep.recordings.convert import convert_recording
from vsep.recordings.half_band import complex_at_half_rate, half_band, missing_at_half_rate
from vsep.recordings.settings import RecordingSettings
from vsep.signal.radar import SPEED_OF_LIGHT_MPS
from vsep.signal.template import SignalModel

LENGTHS = [33, 48, 64, 100, 128, 200, 256, 1024]
RATE, SLOPE, NUM_RAMPS = 1e7, 3e13, 16


@pytest.mark.parametrize("num_samples", LENGTHS)
def test_a_cosine_of_any_frequency_becomes_a_pure_line(num_samples: int) -> None:
    design = half_band(num_samples)
    time = np.arange(num_samples)
    for frequency in np.linspace(design.transition, 0.5 - design.transition, 23):
        half = complex_at_half_rate(np.cos(2 * np.pi * frequency * time + 0.4))
        taken = design.delay + 2 * np.arange(half.size)
        line = np.exp(1j * (2 * np.pi * frequency * taken + 0.4))
        amplitude = np.vdot(line, half) / half.size
        residual = np.linalg.norm(half - amplitude * line) / np.linalg.norm(half)
        assert 20 * np.log10(residual) < -70.0
        assert abs(20 * np.log10(abs(amplitude))) < 0.1
        assert abs(np.angle(amplitude)) < 1e-3


@pytest.mark.parametrize("num_samples", LENGTHS)
def test_the_filter_keeps_ripple_and_stop_band(num_samples: int) -> None:
    design = half_band(num_samples)
    frequency = np.arange(4096) / 8192
    response = np.abs(
        np.exp(-2j * np.pi * np.outer(frequency, np.arange(len(design.taps)))) @ design.taps
    )
    passed = response[frequency <= 0.25 - design.transition]
    stopped = response[frequency >= 0.25 + design.transition]
    assert 20 * np.log10(passed.max() / passed.min()) < 0.1
    assert 20 * np.log10(stopped.max()) < -80.0
    np.testing.assert_array_equal(design.taps, design.taps[::-1])


def test_white_noise_becomes_noise_with_the_filters_spectrum() -> None:
    half = complex_at_half_rate(np.random.default_rng(1).normal(size=(4000, 128)))
    taps = half_band(128).taps
    count = half.shape[-1]
    lags = np.arange(6)
    measured = [np.mean(half[:, : count - lag].conj() * half[:, lag:]) for lag in lags]
    # The autocorrelation of the taps at twice the lag, mixed as the signal is
    own = np.array([taps[: taps.size - 2 * lag] @ taps[2 * lag :] for lag in lags])
    expected = 4.0 * own * np.exp(1j * np.pi * lags)
    np.testing.assert_allclose(measured, expected, atol=0.02)


def test_outputs_that_see_a_gap_are_missing() -> None:
    samples = np.random.default_rng(2).normal(size=100)
    gap = np.zeros(100, dtype=bool)
    gap[40:45] = True
    missing = missing_at_half_rate(gap)
    changed = complex_at_half_rate(np.where(gap, 7.0, samples)) != complex_at_half_rate(samples)
    assert np.all(missing[changed])
    assert not missing.all()


def test_short_ramps_are_told() -> None:
    with pytest.raises(InputError, match="32 real samples; at least 33"):
        complex_at_half_rate(np.zeros(32))


def scene(num_samples: int, noise: float, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Real and complex samples of one still object at 5 m."""
    rng = np.random.default_rng(seed)
    turns = SLOPE * 2 * 5.0 / SPEED_OF_LIGHT_MPS * np.arange(num_samples) / RATE
    phase = 2 * np.pi * turns + 1.0
    real = np.cos(phase) + noise * rng.normal(size=(NUM_RAMPS, num_samples))
    spread = rng.normal(size=(NUM_RAMPS, num_samples, 2)) @ np.array([1.0, 1.0j])
    return real, np.exp(1j * phase) + noise * spread


@pytest.mark.parametrize("num_samples", [64, 256])
@pytest.mark.parametrize("noise", [0.001, 0.005])
def test_a_real_scene_gives_the_objects_of_the_complex_one(
    tmp_path: object, num_samples: int, noise: float
) -> None:
    found = []
    for kind, samples in zip(("real", "complex"), scene(num_samples, noise, 5), strict=True):
        path = f"{tmp_path}/{kind}.npy"
        np.save(path, samples)
        chosen = RecordingSettings(
            format="npy",
            samples=kind,
            start_frequency_hz=77e9,
            slope_hz_per_s=SLOPE,
            sample_rate_hz=RATE,
            ramp_period_s=6e-5,
        )
        frame, _ = convert_recording(path, chosen)
        model = SignalModel.of_radar(frame.radar, frame.assumed_filter)
        estimator = make_estimator("factorised", model, false_alarm_rate=1e-3)
        state = run(estimator, frame.received).state
        assert not np.any(state.interference_signal)
        found.append(frame.radar.range_from_beat(state.objects.beats))
    for ranges in found:
        np.testing.assert_allclose(ranges, [5.0], atol=0.002)
