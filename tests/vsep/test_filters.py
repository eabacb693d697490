"""Anti-aliasing filters, and Gbar against an oversampled convolution made here."""

import math
import pickle

import numpy as np
import pytest

from vsep._arrays import InputError
from vsep.signal.filters import ButterworthFilter, MeasuredFilter, NoFilter, RaisedCosineFilter

# (sampling rate, slope difference, start frequency) of the first burst of every scene of Table I.
BURSTS = {
    "simulation-1": (10.2e6, 256, -0.8e12, 10e6),
    "simulation-2-a": (5.1e6, 128, -0.1679e12, 2e6),
    "simulation-2-b": (5.1e6, 128, -0.2878e12, 4e6),
    "simulation-2-c": (5.1e6, 128, -0.6075e12, 8e6),
}
OVERSAMPLING = 8
CUTOFF_HZ = 1.275e6


def raised_cosine(frequency_hz, cutoff_hz, rolloff):
    """Amplitude response by its definition, piece by piece."""
    inner, outer = (1 - rolloff) * cutoff_hz, (1 + rolloff) * cutoff_hz
    result = np.zeros(len(frequency_hz))
    for index, frequency in enumerate(np.abs(frequency_hz)):
        if frequency <= inner:
            result[index] = 1.0
        elif frequency < outer:
            result[index] = 0.5 * (1 + np.cos(np.pi * (frequency - inner) / (outer - inner)))
    return result


def butterworth(frequency_hz, cutoff_hz, order):
    """Analogue low-pass from scipy's design, of half amplitude at the cut-off."""
    from scipy.signal import butter, freqs

    corner = 2 * np.pi * cutoff_hz / 3 ** (1 / (2 * order))
    # In units of the corner frequency, where the coefficients stay within range.
    numerator, denominator = butter(order, 1.0, analog=True)
    return freqs(numerator, denominator, 2 * np.pi * np.asarray(frequency_hz) / corner)[1]


def oversampled_burst(case, response):
    """Chirp at eight times the sampling rate through a filter by FFT, at the sampling times."""
    rate, num_samples, slope, start = BURSTS[case]
    ramp = num_samples * OVERSAMPLING
    # The chirp lasts from one ramp before to one ramp after, and fades over another one.
    time = (np.arange(16 * ramp) - 6 * ramp) / (OVERSAMPLING * rate)
    length = ramp / (OVERSAMPLING * rate)
    outside = np.maximum(np.maximum(-time, time - length) / length - 0.5, 0.0)
    fade = np.where(outside < 1.0, np.cos(np.pi / 2 * np.minimum(outside, 1.0)) ** 4, 0.0)
    # Within 1.5 lengths of the ramp the course must stay below half of the oversampled rate.
    assert abs(start) + abs(slope) * 2.5 * length < 0.5 * OVERSAMPLING * rate * 2
    course = start + slope * time
    fade = fade * (np.abs(course) < 0.5 * OVERSAMPLING * rate)
    chirp = fade * np.exp(2j * np.pi * (start * time + 0.5 * slope * time**2))
    frequency = np.fft.fftfreq(len(time), 1 / (OVERSAMPLING * rate))
    filtered = np.fft.ifft(np.fft.fft(chirp) * response(frequency))
    return filtered[6 * ramp : 7 * ramp : OVERSAMPLING]


def modelled_burst(case, anti_aliasing_filter):
    """Template (12): chirp times Gbar."""
    rate, num_samples, slope, start = BURSTS[case]
    time = np.arange(num_samples) / rate
    chirp = np.exp(2j * np.pi * (start * time + 0.5 * slope * time**2))
    return chirp * anti_aliasing_filter.modified_response(start + slope * time, slope)


def error_db(signal, reference):
    return 10 * np.log10(np.sum(np.abs(signal - reference) ** 2) / np.sum(np.abs(reference) ** 2))


@pytest.mark.parametrize("case", BURSTS)
def test_raised_cosine_template_equals_oversampled_convolution(case):
    cutoff = BURSTS[case][0] / 4
    exact = oversampled_burst(case, lambda f: raised_cosine(f, cutoff, 0.25))
    template = modelled_burst(case, RaisedCosineFilter(cutoff_hz=cutoff, rolloff=0.25))
    # The requirement of the project.
    assert error_db(template, exact) <= -90.0


@pytest.mark.parametrize("case", BURSTS)
@pytest.mark.parametrize("order", [2, 4, 8])
def test_butterworth_template_equals_oversampled_convolution(case, order):
    cutoff = BURSTS[case][0] / 4
    exact = oversampled_burst(case, lambda f: butterworth(f, cutoff, order))
    template = modelled_burst(case, ButterworthFilter(cutoff_hz=cutoff, order=order))
    assert error_db(template, exact) <= -90.0
