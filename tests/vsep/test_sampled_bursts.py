"""Bursts through a sampled response against the closed forms that were sampled."""

import numpy as np
import pytest

from vsep.signal.filters import MeasuredFilter, RaisedCosineFilter
from vsep.signal.sampled_bursts import sampled_bursts
from vsep.signal.template import SignalModel

RATE_HZ, NUM_SAMPLES = 5.1e6, 256
EXACT = RaisedCosineFilter(cutoff_hz=1.275e6, rolloff=1.0)
CENTRES = np.array([-20.0, 0.3, 77.25, 140.0, 300.0])  # samples, inside and outside of the ramp


def model(anti_aliasing_filter):
    return SignalModel(
        num_ramps=1,
        num_samples=NUM_SAMPLES,
        sample_rate_hz=RATE_HZ,
        anti_aliasing_filter=anti_aliasing_filter,
    )


def sampled():
    frequency = np.linspace(-3e6, 3e6, 601)
    return MeasuredFilter(frequency_hz=frequency, response=EXACT.response(frequency))


def parameters(slope):
    slopes = slope * np.linspace(0.9, 1.1, len(CENTRES))
    return -slopes * CENTRES, slopes, np.clip(CENTRES, 0.0, NUM_SAMPLES - 1.0)


# Bursts of 7, 50 and 256 samples, upwards and downwards
@pytest.mark.parametrize("slope", [0.07, -0.01, 0.002])
def test_templates_and_derivatives_are_those_of_the_closed_form(slope):
    measured = model(sampled()).template_jets(*parameters(slope))
    exact = model(EXACT).template_jets(*parameters(slope))
    # Spacing D = 10 kHz, half of it in the sum: the spline errs by D^2 |G''| / 8 = 1e-5 around the
    # ends of the taper, which the kernel spreads; derivatives weigh that by the burst's length.
    np.testing.assert_allclose(measured[0], exact[0], rtol=0, atol=1e-4)
    for k in range(2):
        size = np.abs(exact[1][:, k]).max()
        np.testing.assert_allclose(measured[1][:, k], exact[1][:, k], rtol=0, atol=2e-3 * size)


def test_derivatives_are_differences_with_a_phase_that_stands_still():
    start, slope, reference = parameters(0.02)
    seen = model(sampled())
    _, derivatives = seen.template_jets(start, slope, reference)

    def moved(by_frequency, by_slope):
        s = slope + by_slope
        f = start + by_frequency - by_slope * reference
        templates = seen.template_jets(f, s, reference)[0]
        # the phase at the reference as it was
        turn = (f - start) * reference + 0.5 * (s - slope) * reference**2
        return templates * np.exp(-2j * np.pi * turn)[:, None]

    for k, step in enumerate(((1e-6, 0.0), (0.0, 1e-8))):
        above, below = moved(*step), moved(*(-np.array(step)))
        difference = (above - below) / (2.0 * max(step))
        scale = np.abs(difference).max()
        np.testing.assert_allclose(derivatives[:, k], difference, rtol=0, atol=1e-5 * scale)


def test_nearly_parallel_chirps_have_no_short_transform():
    steep = sampled_bursts(sampled().smooth, parameters(0.02), RATE_HZ, NUM_SAMPLES)
    flat = sampled_bursts(sampled().smooth, parameters(1e-8), RATE_HZ, NUM_SAMPLES)
    assert steep.shape == (3, len(CENTRES), NUM_SAMPLES)
    assert flat is None
