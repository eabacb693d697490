"""The measured filter against closed forms sampled on a grid."""

import numpy as np
import pytest

from vsep.errors import InputError
from vsep.signal.filters import ButterworthFilter, MeasuredFilter, RaisedCosineFilter

CUTOFF_HZ = 1.275e6


def sampled(anti_aliasing_filter, frequency_hz):
    return MeasuredFilter(
        frequency_hz=frequency_hz, response=anti_aliasing_filter.response(frequency_hz)
    )


@pytest.mark.parametrize("slope", [1e10, 0.17e12, -0.6e12, 0.8e12, -20e12])
def test_sampled_raised_cosine_gives_its_modified_response(slope):
    exact = RaisedCosineFilter(cutoff_hz=CUTOFF_HZ, rolloff=0.25)
    # Spacing D = 10 kHz. G'' = pi^2 / (2 W^2) jumps at the edges of the taper of W = 0.64 MHz: the
    # spline misses it there by at most D^2 |G''| / 8 = 1.5e-4 within one spacing of four edges,
    # which the kernel spreads; 4 D / sqrt|Delta k| of it remains, 6e-5 at the shallowest slope.
    measured = sampled(exact, np.linspace(-2e6, 2e6, 401))
    frequency = np.linspace(-2.5e6, 2.5e6, 501)
    np.testing.assert_allclose(
        measured.modified_response(frequency, slope),
        exact.modified_response(frequency, slope),
        rtol=0,
        atol=1.5e-4 * 4e4 / np.sqrt(abs(slope)),
    )


def test_modified_response_of_a_smooth_response_is_accurate_to_100_db():
    exact = ButterworthFilter(cutoff_hz=CUTOFF_HZ, order=8)
    # At the ends of the band the response is 5 (1.275 / 8)^8 = 2e-6; the spline errs by
    # (5/384) D^4 |G''''| = (5/384) (2e4 * 2 pi * 2e-6)^4 = 5e-5 at most and 1e-6 on average.
    measured = sampled(exact, np.linspace(-8e6, 8e6, 801))
    frequency = np.linspace(-2.5e6, 2.5e6, 501)
    error = measured.modified_response(frequency, 0.6e12) - exact.modified_response(
        frequency, 0.6e12
    )
    assert np.abs(error).max() < 1e-5


@pytest.mark.parametrize("slope", [0.6e12, -0.2e12])
def test_jet_equals_finite_differences(slope):
    spacing = 1e4
    measured = sampled(
        RaisedCosineFilter(cutoff_hz=CUTOFF_HZ, rolloff=0.25), np.arange(-2e6, 2.001e6, spacing)
    )
    frequency = np.linspace(-2.5e6, 2.5e6, 301)
    step, slope_step = 1e3, 1e8
    jet = measured.modified_response_jet(frequency, slope)
    above = measured.modified_response_jet(frequency + step, slope)
    below = measured.modified_response_jet(frequency - step, slope)
    steeper = measured.modified_response(frequency, slope + slope_step)
    shallower = measured.modified_response(frequency, slope - slope_step)
    # G'' jumps at four edges; as a ramp of width D, summed with the step D/2, each errs by
    # D / 24 of the jump, which the kernel of height 1 / sqrt|Delta k| weighs: 3.7e-3 of the peak
    # at the shallower slope. G' has kinks instead of jumps and errs by D / W = 1/64 of that.
    second = 4 * spacing / 24 / np.sqrt(abs(slope))
    for order, relative in ((0, second / 64 + 2e-4), (1, second)):
        difference = (above[order] - below[order]) / (2 * step)
        np.testing.assert_allclose(
            jet[order + 1], difference, rtol=0, atol=relative * np.abs(difference).max()
        )
    difference = (steeper - shallower) / (2 * slope_step)
    np.testing.assert_allclose(
        -0.25j / np.pi * jet.second, difference, rtol=0, atol=second * np.abs(difference).max()
    )


def test_very_many_samples_keep_the_transform():
    exact = RaisedCosineFilter(cutoff_hz=CUTOFF_HZ, rolloff=1.0)
    measured = sampled(exact, np.linspace(-3e6, 3e6, 100_001))
    frequency = np.linspace(-3e6, 3e6, 51)
    # Steps of 120 Hz against a taper of 2.6 MHz leave (120 / 2.6e6)^2 = 2e-9, far below.
    np.testing.assert_allclose(
        measured.modified_response(frequency, 0.6e12),
        exact.modified_response(frequency, 0.6e12),
        rtol=0,
        atol=1e-7,
    )


def test_band_beside_zero_frequency_moves_the_modified_response():
    # Shifting G by F shifts Gbar by F.
    shift = 1.7e6
    exact = RaisedCosineFilter(cutoff_hz=CUTOFF_HZ, rolloff=1.0)
    grid = np.linspace(-3e6, 3e6, 301)
    measured = MeasuredFilter(frequency_hz=grid + shift, response=exact.response(grid))
    frequency = np.linspace(-3e6, 3e6, 101)
    # The spline errs by D^2 |G''| / 8 = (2e4 / 2.55e6)^2 * 5 / 8 = 4e-5 next to the four edges.
    np.testing.assert_allclose(
        measured.modified_response(frequency + shift, 0.6e12),
        exact.modified_response(frequency, 0.6e12),
        rtol=0,
        atol=4e-5,
    )


@pytest.mark.parametrize("slope", [5e8, -5e8, 1e9])
def test_nearly_parallel_chirps_follow_the_expansion(slope):
    # Below 6e8 Hz/s the grid would be too large and the expansion steps in, above it is the
    # transform. The term of first order is Delta k / (4 pi) |G''| with |G''| = 7.6e-13, 3e-5.
    exact = RaisedCosineFilter(cutoff_hz=CUTOFF_HZ, rolloff=1.0)
    measured = sampled(exact, np.linspace(-3e6, 3e6, 1201))
    frequency = np.linspace(-3e6, 3e6, 601)
    expected = exact.modified_response(frequency, slope)
    rms = np.sqrt(np.mean(np.abs(measured.modified_response(frequency, slope) - expected) ** 2))
    # Only where G'' jumps, within 50 kHz of three edges, is half of that term missed:
    # 1.5e-5 sqrt(0.15 / 6) = 2.4e-6.
    assert rms < 3e-6
    # It is there: without it the whole band would err.
    plain = np.sqrt(np.mean(np.abs(measured.response(frequency) - expected) ** 2))
    assert plain > 1e-5


def test_irregular_and_one_sided_samples_are_allowed():
    exact = ButterworthFilter(cutoff_hz=CUTOFF_HZ, order=2)
    frequency = np.sort(np.random.default_rng(2).uniform(-0.1e6, 4e6, 400))
    measured = sampled(exact, frequency)
    inside = np.linspace(0.0, 3.9e6, 200)
    # Gaps of up to 8 mean spacings of 10 kHz: (5/384) (8e4 / 0.9e6)^4 * 24 = 2e-5.
    np.testing.assert_allclose(measured.response(inside), exact.response(inside), atol=2e-5)
    assert np.all(measured.response(np.array([-0.7e6, 4.6e6])) == 0.0)


def test_response_fades_to_zero_over_an_eighth_of_the_band():
    measured = MeasuredFilter(frequency_hz=np.linspace(-8.0, 8.0, 33), response=np.full(33, 2j))
    outside = np.array([8.0, 9.0, 9.999, 10.001])
    # Half way out the smooth step is one half; its spline through eighths errs below 1e-3.
    np.testing.assert_allclose(np.abs(measured.response(outside)), [2, 1, 0, 0], atol=2e-3)


def test_cutoff_is_the_outermost_half_amplitude():
    frequency = np.linspace(-5e6, 5e6, 101)
    measured = sampled(RaisedCosineFilter(cutoff_hz=2.5e6), frequency)
    # The samples stand 0.1 MHz apart and one of them on the cut-off.
    assert measured.cutoff_hz == pytest.approx(2.5e6, abs=0.1e6)


def test_filter_keeps_its_samples_from_changes():
    frequency, response = np.arange(5.0), np.ones(5, dtype=complex)
    measured = MeasuredFilter(frequency_hz=frequency, response=response)
    frequency[0] = response[0] = -7.0
    assert measured.frequency_hz[0] == 0.0
    assert measured.samples[0] == 1.0
    assert not measured.samples.flags.writeable
    assert repr(measured) == "MeasuredFilter(5 samples from 0 to 4 Hz)"


@pytest.mark.parametrize(
    ("frequency", "response", "message"),
    [
        ([0.0, 1.0, 2.0], [1.0, 1.0, 1.0], r"\(3,\) frequencies and \(3,\) samples.*at least 4"),
        ([0.0, 1.0, 2.0, 3.0], [1.0], "one length"),
        ([[0.0, 1.0, 2.0, 3.0]], [[1.0, 1.0, 1.0, 1.0]], "one-dimensional"),
        ([0.0, 1.0, np.nan, 3.0], [1.0, 1.0, 1.0, 1.0], "NaN or infinity"),
        ([0.0, 1.0, 2.0, 3.0], [1.0, np.inf, 1.0, 1.0], "NaN or infinity"),
        ([0.0, 1.0, 1.0, 3.0], [1.0, 1.0, 1.0, 1.0], "not ascending"),
        ([0.0, 1.0, 2.0, 3.0], [0.0, 0.0, 0.0, 0.0], "zero everywhere"),
        (["a", "b", "c", "d"], [1.0, 1.0, 1.0, 1.0], "no numbers"),
    ],
)
def test_unusable_samples_are_refused(frequency, response, message):
    with pytest.raises(InputError, match=message):
        MeasuredFilter(frequency_hz=frequency, response=response)
