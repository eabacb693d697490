"""Delay and range-Doppler spectra."""

import numpy as np
import pytest

from vsep.errors import InputError
from vsep.signal.spectra import delay_spectrum, range_doppler_map


def atom(num_ramps, num_samples, beat, doppler):
    """Unit-norm atom of the paper's sign."""
    ramp, sample = np.mgrid[:num_ramps, :num_samples]
    turns = beat * sample + doppler * ramp
    return np.exp(-2j * np.pi * turns) / np.sqrt(num_ramps * num_samples)


@pytest.mark.parametrize("window", ["hann", "rectangular"])
@pytest.mark.parametrize("beat", [0.25, -0.375])
def test_peak_of_a_line_stands_at_its_beat_with_its_power(window, beat):
    beats, power = delay_spectrum(3.0 * atom(1, 64, beat, 0.0)[0], 4, window)
    assert power.shape == beats.shape == (256,)
    assert beats[np.argmax(power)] == beat
    # 64 terms of a sum, some roundings each.
    assert power.max() == pytest.approx(9.0, rel=1e-12)


def test_ramps_have_their_own_spectra():
    frame = atom(2, 32, 0.125, 0.0) * np.array([[1.0], [2.0]])
    beats, power = delay_spectrum(frame)
    assert power.shape == (2, 128)
    np.testing.assert_allclose(power[:, np.argmin(np.abs(beats - 0.125))], [0.5, 2.0])


def test_rectangular_spectrum_without_padding_keeps_the_energy():
    rng = np.random.default_rng(0)
    frame = rng.standard_normal((4, 16)) + 1j * rng.standard_normal((4, 16))
    energy = np.sum(np.abs(frame) ** 2)
    assert delay_spectrum(frame, 1, "rectangular").power.sum() == pytest.approx(energy)
    assert range_doppler_map(frame, 1, "rectangular").power.sum() == pytest.approx(energy)


@pytest.mark.parametrize(("window", "factor"), [("hann", 1.5), ("rectangular", 1.0)])
def test_noise_floor_is_the_noise_power_times_the_window_factor(window, factor):
    rng = np.random.default_rng(1)
    noise = (rng.standard_normal((64, 256)) + 1j * rng.standard_normal((64, 256))) / np.sqrt(2)
    # 64 * 256 powers, for a Hann window a third of them independent in either dimension: five
    # standard deviations are 5 * 3 / 128 = 12 %. The finite Hann window has 1.5 N / (N + 1).
    assert delay_spectrum(noise, 1, window).power.mean() == pytest.approx(factor, rel=0.12)
    assert range_doppler_map(noise, 1, window).power.mean() == pytest.approx(factor**2, rel=0.12)


def test_map_peaks_at_beat_and_doppler_of_an_object():
    dopplers, beats, power = range_doppler_map(2j * atom(16, 32, -0.25, 0.125))
    assert power.shape == (len(dopplers), len(beats)) == (64, 128)
    row, column = np.unravel_index(np.argmax(power), power.shape)
    assert (dopplers[row], beats[column]) == (0.125, -0.25)
    assert power.max() == pytest.approx(4.0, rel=1e-12)


def test_single_ramp_has_a_single_doppler_bin():
    dopplers, beats, power = range_doppler_map(atom(1, 32, 0.25, 0.0))
    np.testing.assert_array_equal(dopplers, [0.0])
    np.testing.assert_array_equal(power[0], delay_spectrum(atom(1, 32, 0.25, 0.0)[0]).power)
    assert len(beats) == 128


@pytest.mark.parametrize("lowest", [-0.5, 0.0, -1.0, -0.3])
def test_axis_ascends_over_one_cycle_from_its_lowest_beat(lowest):
    signal = atom(1, 30, 0.3, 0.0)
    beats, power = delay_spectrum(signal[0], 2, lowest_beat=lowest)
    np.testing.assert_allclose(np.diff(beats), 1 / 60, rtol=1e-9)
    assert lowest <= beats[0] < lowest + 1 / 60
    peak = beats[np.argmax(power)]
    expected = (0.3 - lowest) % 1.0 + lowest
    assert peak == pytest.approx(expected, abs=1e-12)
    _, map_beats, _ = range_doppler_map(signal, 2, lowest_beat=lowest)
    np.testing.assert_array_equal(map_beats, beats)


def test_one_sample_has_a_spectrum():
    beats, power = delay_spectrum(np.array([2j]), 1)
    np.testing.assert_array_equal(beats, [0.0])
    np.testing.assert_allclose(power, [4.0])


@pytest.mark.parametrize(
    ("shape", "options", "message"),
    [
        ((2, 3, 4), {}, r"shape \(2, 3, 4\); it must have 1 or 2 axes"),
        ((0,), {}, "not be empty"),
        ((8,), {"zero_padding": 0}, "zero_padding is 0"),
        ((8,), {"zero_padding": 65}, "zero_padding is 65"),
        ((8,), {"window": "kaiser"}, "window is 'kaiser'; it must be 'hann' or 'rectangular'"),
        ((8,), {"lowest_beat": 0.1}, "lowest_beat is 0.1"),
    ],
)
def test_unusable_arguments_are_refused(shape, options, message):
    with pytest.raises(InputError, match=message):
        delay_spectrum(np.zeros(shape), **options)


def test_map_needs_a_frame():
    with pytest.raises(InputError, match="must have 2 axes"):
        range_doppler_map(np.zeros(8))
