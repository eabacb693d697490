"""`vsep.recordings.sampling`: Complex 1x, Complex 2x and the sign, told by simulated echoes."""

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from vsep.recordings.convert import convert_recording
from vsep.recordings.settings import RecordingSettings
from vsep.signal.radar import SPEED_OF_LIGHT_MPS

RATE, SLOPE, NUM_SAMPLES, NUM_RAMPS = 1e7, 2e13, 128, 16
REACH_M = RATE / SLOPE * SPEED_OF_LIGHT_MPS / 2.0  # 75 m
RADAR = {
    "start_frequency_hz": 77e9,
    "slope_hz_per_s": SLOPE,
    "sample_rate_hz": RATE,
    "ramp_period_s": 4e-5,
}


def echoes(ranges_m: list[float], seed: int = 1) -> Any:
    """Beat signals of still objects that weaken with their distance, positive sign, and noise."""
    rng = np.random.default_rng(seed)
    time = np.arange(NUM_SAMPLES) / RATE
    signal = 0.003 * rng.normal(size=(NUM_RAMPS, NUM_SAMPLES, 2)) @ np.array([1.0, 1.0j])
    for distance in ranges_m:
        beat = SLOPE * 2.0 * distance / SPEED_OF_LIGHT_MPS
        amplitude = min(1.0, 10.0 / distance) * np.exp(1j * rng.uniform(0.0, 6.0))
        signal += amplitude * np.exp(2j * np.pi * beat * time)
    return signal


def taken(tmp_path: Path, signal: Any, **changes: Any) -> tuple[float, tuple[str, ...]]:
    np.save(tmp_path / "a.npy", signal)
    chosen = RecordingSettings(**({"format": "npy"} | RADAR | changes))
    frame, remarks = convert_recording(str(tmp_path / "a.npy"), chosen)
    return frame.radar.lowest_beat, remarks


def raw(tmp_path: Path, signal: Any, **changes: Any) -> tuple[Any, tuple[str, ...]]:
    """Write as a card of two lanes does, I I Q Q, and convert."""
    whole = np.rint(signal * 3000.0)
    pairs = whole.reshape(NUM_RAMPS, NUM_SAMPLES // 2, 2)
    words = np.stack([pairs.real, pairs.imag], axis=2).astype("<i2")
    (tmp_path / "adc.bin").write_bytes(words.tobytes())
    settings = {"format": "dca1000-xwr16xx", "num_samples": NUM_SAMPLES}
    chosen = RecordingSettings(**(settings | RADAR | changes))
    return convert_recording(str(tmp_path / "adc.bin"), chosen)


def test_echoes_at_positive_distances_need_no_remark(tmp_path: Path) -> None:
    assert taken(tmp_path, echoes([6.0, 20.0, 33.0])) == (-0.5, ())


@pytest.mark.parametrize("slope", [SLOPE, -SLOPE])
def test_echoes_on_both_sides_are_complex_1x(tmp_path: Path, slope: float) -> None:
    signal = echoes([12.0, 25.0, 50.0])
    signal = signal if slope > 0.0 else signal.conj()
    lowest, remarks = taken(tmp_path, signal, slope_hz_per_s=slope)
    assert lowest == (0.0 if slope > 0.0 else -1.0)
    assert len(remarks) == 1
    assert "no sign makes all of them positive: Complex 1x is taken" in remarks[0]


def test_the_other_sign_fits_where_echoes_are_next_to_zero(tmp_path: Path) -> None:
    lowest, remarks = taken(tmp_path, echoes([5.0, 12.0, 20.0]).conj())
    assert lowest == -0.5
    assert "sign (positive) is perhaps the other one" in remarks[0]
    assert "which fits less: echoes weaken with distance" in remarks[0]


def test_complex_1x_fits_where_echoes_are_far_from_zero(tmp_path: Path) -> None:
    lowest, remarks = taken(tmp_path, echoes([40.0, 44.0, 50.0]))
    assert lowest == 0.0
    assert "sign (positive) is the other one, or the samples are Complex 1x" in remarks[0]
    assert "far from zero beat frequency" in remarks[0]


def test_the_order_of_a_raw_capture_speaks_for_complex_1x(tmp_path: Path) -> None:
    frame, remarks = raw(tmp_path, echoes([60.0]))
    assert frame.radar.lowest_beat == 0.0
    spectrum = np.abs(np.fft.ifft(frame.received[0], 4096))
    found = frame.radar.range_from_beat(np.array(np.argmax(spectrum) / 4096))
    assert float(found) == pytest.approx(60.0, abs=REACH_M / 4096)
    assert "fixes the order of I and Q" in remarks[0]
    assert "would lie at 15." in remarks[0]


def test_the_other_sign_of_a_raw_capture_is_not_silent(tmp_path: Path) -> None:
    frame, remarks = raw(tmp_path, echoes([60.0]), sign="negative")
    assert frame.radar.lowest_beat == -0.5
    told = re.search(r"samples: complex-1x it lies at ([\d.]+) m", remarks[0])
    assert told is not None
    # By the cells of half a ramp
    assert float(told[1]) == pytest.approx(60.0, abs=REACH_M / NUM_SAMPLES)


@pytest.mark.parametrize(("samples", "lowest"), [("complex-1x", 0.0), ("complex-2x", -0.5)])
def test_what_is_said_is_taken(tmp_path: Path, samples: str, lowest: float) -> None:
    assert taken(tmp_path, echoes([12.0, 25.0, 50.0]), samples=samples) == (lowest, ())
    assert taken(tmp_path, echoes([12.0, 50.0]), lowest_beat=-0.25)[0] == -0.25
