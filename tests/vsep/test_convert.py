"""`vsep.recordings.convert`, `.axes` and `.advice`: from arrays and settings to frames."""

import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from vsep.errors import InputError
from vsep.files.frame import read_frame, write_frame
from vsep.recordings.convert import convert_recording
from vsep.recordings.half_band import half_band
from vsep.recordings.settings import RecordingSettings
from vsep.signal.filters import MeasuredFilter
from vsep.signal.radar import SPEED_OF_LIGHT_MPS

RATE, SLOPE, PERIOD = 1e7, 2e13, 30e-6
NUM_RAMPS, NUM_SAMPLES = 16, 64
RANGE_M, VELOCITY_MPS = 12.0, 6.0


def settings(**changes: Any) -> RecordingSettings:
    values = {
        "format": "npy",
        "start_frequency_hz": 77e9,
        "slope_hz_per_s": SLOPE,
        "sample_rate_hz": RATE,
        "ramp_period_s": PERIOD,
    }
    return RecordingSettings(**(values | changes))


def target(*, period_s: float = PERIOD, slope: float = SLOPE, delay_s: float = 0.0) -> Any:
    """Phase in turns of the mixer's output for one receding object, (ramps, samples)."""
    time = np.arange(NUM_SAMPLES) / RATE
    ramp_time = np.arange(NUM_RAMPS)[:, None] * period_s + delay_s
    # Only the phase at the start frequency moves from ramp to ramp, as in (5).
    delay = 2.0 * RANGE_M / SPEED_OF_LIGHT_MPS
    moved = 2.0 * VELOCITY_MPS * ramp_time / SPEED_OF_LIGHT_MPS
    return slope * delay * time + 77e9 * moved


def converted(tmp_path: Path, array: Any, **changes: Any) -> tuple[Any, tuple[str, ...]]:
    np.save(tmp_path / "a.npy", array)
    frame, remarks = convert_recording(str(tmp_path / "a.npy"), settings(**changes))
    write_frame(tmp_path / "frame.npz", frame)
    return read_frame(tmp_path / "frame.npz"), remarks


def place_of_peak(frame: Any) -> tuple[float, float]:
    """Range and velocity of the largest cell of a padded spectrum in the paper's sign."""
    spectrum = np.abs(np.fft.ifft2(frame.received, (256, 2048)))
    doppler, beat = np.unravel_index(np.argmax(spectrum), spectrum.shape)
    doppler = (doppler / 256 + 0.5) % 1.0 - 0.5
    radar = frame.radar
    distance = float(radar.range_from_beat(np.array(beat / 2048)))
    return distance, float(radar.velocity_from_doppler(np.array(doppler)))


# Half of a cell of the padded spectra.
CELL_M = RATE / 2048 / SLOPE * SPEED_OF_LIGHT_MPS / 4
CELL_MPS = SPEED_OF_LIGHT_MPS / (4 * 77e9 * PERIOD * 256)


@pytest.mark.parametrize("sign", ["positive", "negative"])
def test_a_target_is_where_it_is_in_either_sign(tmp_path: Path, sign: str) -> None:
    turns = target() if sign == "positive" else -target()
    frame, remarks = converted(tmp_path, np.exp(2j * np.pi * turns), sign=sign)
    distance, velocity = place_of_peak(frame)
    assert distance == pytest.approx(RANGE_M, abs=CELL_M)
    assert velocity == pytest.approx(VELOCITY_MPS, abs=CELL_MPS)
    assert remarks == ()


@pytest.mark.parametrize("slope", [SLOPE, -SLOPE])
def test_a_target_is_where_it_is_in_real_samples(tmp_path: Path, slope: float) -> None:
    samples = np.cos(2 * np.pi * target(slope=slope))
    # A falling ramp makes -beat + doppler of the phase: the object recedes all the same.
    frame, remarks = converted(tmp_path, samples, samples="real", slope_hz_per_s=slope)
    assert frame.radar.sample_rate_hz == RATE / 2
    taps = len(half_band(NUM_SAMPLES).taps)
    assert frame.radar.shape == (NUM_RAMPS, (NUM_SAMPLES - taps) // 2 + 1)
    # Samples belong to the middle of the filter.
    moved = slope * (taps - 1) / 2 / RATE
    assert frame.radar.start_frequency_hz == pytest.approx(77e9 + moved, rel=1e-12)
    distance, velocity = place_of_peak(frame)
    # The grid is that of half the rate.
    assert distance == pytest.approx(RANGE_M, abs=CELL_M)
    assert velocity == pytest.approx(VELOCITY_MPS, abs=CELL_MPS)
    assert len(remarks) == 1
    assert f"{taps} taps, which takes {taps - 1} of 64 samples" in remarks[0]


def test_samples_are_not_changed(tmp_path: Path) -> None:
    rng = np.random.default_rng(2)
    stored = rng.normal(size=(3, 8, 32, 2)) @ np.array([1.0, 1.0j])
    frame, _ = converted(tmp_path, stored, antenna_spacing_wavelengths=0.5)
    assert np.array_equal(frame.in_file_sign(frame.antennas), stored)
    assert frame.antenna_spacing_wavelengths == 0.5
    assert frame.radar.ramp_period_s == PERIOD


@pytest.mark.parametrize("sign", ["positive", "negative"])
def test_a_frame_file_keeps_its_filter_whatever_else_is_changed(tmp_path: Path, sign: str) -> None:
    frame, _ = converted(tmp_path, np.exp(2j * np.pi * target()))
    measured = MeasuredFilter(
        frequency_hz=np.array([-3e6, -1e6, 2e6, 4e6]), response=np.array([0.1, 1j, 0.5 - 0.5j, 0.2])
    )
    write_frame(tmp_path / "own.npz", replace(frame, anti_aliasing_filter=measured))
    own, path = read_frame(tmp_path / "own.npz"), str(tmp_path / "own.npz")
    changed = settings(format="npz", key="received", sign=sign, crop_start_samples=8)
    kept = convert_recording(path, changed)[0].anti_aliasing_filter
    # The response has the sign of the samples: where these are conjugated, it is mirrored as well.
    expected = own.received if sign == "positive" else np.conj(own.received)
    np.testing.assert_array_equal(convert_recording(path, changed)[0].received, expected[:, 8:])
    assert isinstance(kept, MeasuredFilter)
    if sign == "positive":
        np.testing.assert_array_equal(kept.samples, measured.samples)
        np.testing.assert_array_equal(kept.frequency_hz, measured.frequency_hz)
    else:
        np.testing.assert_array_equal(kept.samples, measured.samples[::-1].conj())
        np.testing.assert_array_equal(kept.frequency_hz, -measured.frequency_hz[::-1])


def test_axes_may_have_any_order(tmp_path: Path) -> None:
    rng = np.random.default_rng(3)
    stored = rng.normal(size=(2, 3, 4, 32, 8, 2))  # frames antennas transmitters samples ramps iq
    frame, _ = converted(
        tmp_path,
        np.moveaxis(stored, 5, 0),
        axes="iq, frames, antennas, transmitters, samples, ramps",
        frame=1,
        num_transmitters=4,
        num_ramps=32,
        num_samples=32,
    )
    expected = stored[1] @ np.array([1.0, 1.0j])
    for transmitter in range(4):
        for antenna in range(3):
            found = frame.in_file_sign(frame.antennas[3 * transmitter + antenna])
            assert np.array_equal(found, expected[antenna, transmitter].T)


def test_transmitters_that_take_turns_make_virtual_antennas(tmp_path: Path) -> None:
    stored = np.arange(2 * 8 * 32).reshape(2, 8, 32) * (1.0 + 2.0j)
    frame, _ = converted(tmp_path, stored, num_transmitters=2, offset="keep")
    signal = frame.in_file_sign(frame.antennas)
    assert signal.shape == (4, 4, 32)
    for transmitter in (0, 1):
        turns = signal[2 * transmitter : 2 * transmitter + 2]
        assert np.array_equal(turns, stored[:, transmitter::2])
    assert frame.radar.ramp_period_s == 2 * PERIOD


def test_cropping_moves_the_start_frequency(tmp_path: Path) -> None:
    stored = np.arange(4 * 32).reshape(4, 32) * (1.0 - 0.5j)
    frame, _ = converted(tmp_path, stored, crop_start_samples=12, adc_start_s=1e-6)
    assert np.array_equal(frame.in_file_sign(frame.received), stored[:, 12:])
    assert frame.radar.start_frequency_hz == pytest.approx(77e9 + SLOPE * 2.2e-6, rel=1e-12)
    with pytest.raises(InputError, match="crop_start_samples is 32, but a ramp"):
        converted(tmp_path, stored, crop_start_samples=32)


@pytest.mark.parametrize(
    ("shape", "changes", "words"),
    [
        ((8, 32), {"axes": "ramps,sample"}, "axes is 'ramps,sample'; it must name samples"),
        ((8, 32), {"axes": "ramps,ramps"}, "it must name samples and others"),
        ((8, 32), {"axes": "antennas,ramps,samples"}, r"names 3 axes, but .* array of 8 x 32"),
        ((1, 1, 8, 32), {}, "an array of 4 axes; name them by axes"),
        ((), {}, "an array of 0 axes"),
        ((8, 32), {"axes": "iq,samples"}, "the axis iq has length 8 of type complex128"),
        ((2, 32), {"axes": "frames,samples", "frame": 2}, "holds 2 frames; frame 2 is not"),
        ((8, 32), {"frame": 1}, "axes names no frames"),
        ((8, 32), {"num_samples": 8}, "num_samples is 8, but .* holds 32; check axes"),
        ((8, 32), {"num_ramps": 32}, "num_ramps is 32, but .* holds 8; check axes"),
        ((8, 32), {"num_transmitters": 3}, "8 ramps, which is no whole number of turns"),
        ((3, 32), {"axes": "transmitters,samples"}, "num_transmitters is 1, but .* holds 3"),
        ((8, 32), {"samples": "real"}, "holds complex numbers, but samples is 'real'"),
        ((0, 32), {}, "without samples"),
        ((8, 512), {}, "ramp_period_s is 3e-05 s, but adc_start_s and 512 samples"),
        ((8, 32), {"sample_rate_hz": -1e7}, "sample_rate_hz is -1e"),
        ((8, 4), {}, "num_samples is 4; it must lie between"),
        ((8, 32), {"start_frequency_hz": 1.0}, "start_frequency_hz is"),
        ((8, 32), {"slope_hz_per_s": 0.0}, "slope_hz_per_s"),
    ],
)
def test_what_does_not_fit_is_told(
    tmp_path: Path, shape: tuple[int, ...], changes: dict[str, Any], words: str
) -> None:
    with pytest.raises(InputError, match=words) as caught:
        converted(tmp_path, np.ones(shape, dtype=complex), **changes)
    assert "\n" not in str(caught.value)


def test_values_that_are_no_numbers_are_told(tmp_path: Path) -> None:
    stored = np.ones((8, 32), dtype=complex)
    stored[3, 4] = np.nan
    with pytest.raises(InputError, match="1 of 256 samples of received are NaN"):
        converted(tmp_path, stored)
    with pytest.raises(InputError, match="holds real numbers; name an axis iq"):
        converted(tmp_path, np.ones((8, 32)))


# Advice


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"start_frequency_hz": 7.7e9}, "starts? at 7.7 GHz, which is in no usual radar band"),
        ({"start_frequency_hz": 80.9e9}, "sweep 0.126 GHz from 80.9 to 81.026 GHz, out of the"),
        ({"slope_hz_per_s": 2e7}, "sweep 1.26e-07 GHz only; check slope_hz_per_s"),
        ({"slope_hz_per_s": 2e7}, r"reach 7.*e\+07 m; check sample_rate_hz"),
        ({"sign": "negative"}, "energy lies at negative distances; sign .negative. is perhaps"),
    ],
)
def test_implausible_values_are_remarked(
    tmp_path: Path, changes: dict[str, Any], words: str
) -> None:
    _, remarks = converted(tmp_path, np.exp(2j * np.pi * target()), **changes)
    assert any(re.search(words, remark) for remark in remarks)


def test_frames_without_ramps_are_ramps(tmp_path: Path) -> None:
    turns = target(period_s=0.04)[:, None, :]
    axes = {"axes": "frames,antennas,samples", "ramp_period_s": 0.04}
    frame, remarks = converted(tmp_path, np.exp(2j * np.pi * turns), **axes)
    assert frame.radar.num_ramps == NUM_RAMPS
    assert "one chirp a frame" in remarks[0]
    alone, _ = converted(tmp_path, np.exp(2j * np.pi * turns), **axes, num_ramps=1)
    assert alone.radar.num_ramps == 1


def test_axes_that_look_swapped_are_remarked(tmp_path: Path) -> None:
    still = np.exp(2j * np.pi * target(period_s=0.0))
    _, remarks = converted(tmp_path, still[:, :16].T.copy())
    assert "Are the axes swapped? There are 16 ramps of 16 samples." in remarks[0]
    assert converted(tmp_path, still)[1] == ()


def test_lanes_that_look_wrong_are_remarked(tmp_path: Path) -> None:
    still = np.exp(2j * np.pi * target())
    _, remarks = converted(tmp_path, still.real.astype(complex))
    assert "mirror images" in remarks[0]
