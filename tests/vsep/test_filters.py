"""Anti-aliasing filters, and Gbar against an oversampled convolution made here."""

import math
import pickle

import numpy as np
import pytest

from vsep.errors import InputError
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
    time = (np.arange(16 * ramp) - 6 * ramp) / (OVERSAMPLING * rate)
    course = start + slope * time
    # The chirp is whole over the ramp and fades out where it nears half of the oversampled rate.
    beyond = np.clip((np.abs(course) / (OVERSAMPLING * rate) - 0.3) / 0.2, 0.0, 1.0)
    chirp = np.cos(np.pi / 2 * beyond) ** 4 * np.exp(1j * np.pi * (start + course) * time)
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


def test_plain_response_errs_where_the_modified_one_does_not():
    # Known from the literature study: -21 dB in Simulation I. Guards the oracle against a burst
    # that any envelope would fit.
    cutoff = BURSTS["simulation-1"][0] / 4
    exact = oversampled_burst("simulation-1", lambda f: raised_cosine(f, cutoff, 0.25))
    rate, num_samples, slope, start = BURSTS["simulation-1"]
    time = np.arange(num_samples) / rate
    course = start + slope * time
    chirp = np.exp(2j * np.pi * (start * time + 0.5 * slope * time**2))
    assert error_db(chirp * raised_cosine(course, cutoff, 0.25), exact) > -25.0


def closed_forms():
    return [
        pytest.param(RaisedCosineFilter(cutoff_hz=CUTOFF_HZ, rolloff=0.25), id="raised-cosine"),
        pytest.param(RaisedCosineFilter(cutoff_hz=CUTOFF_HZ, rolloff=1.0), id="full-roll-off"),
        pytest.param(ButterworthFilter(cutoff_hz=CUTOFF_HZ, order=1), id="butterworth-1"),
        pytest.param(ButterworthFilter(cutoff_hz=CUTOFF_HZ, order=8), id="butterworth-8"),
        pytest.param(NoFilter(), id="none"),
    ]


def all_filters():
    grid = np.linspace(-2e6, 2e6, 401)
    response = RaisedCosineFilter(cutoff_hz=CUTOFF_HZ, rolloff=0.25).response(grid)
    measured = MeasuredFilter(frequency_hz=grid, response=response)
    return [*closed_forms(), pytest.param(measured, id="measured")]


@pytest.mark.parametrize("anti_aliasing_filter", closed_forms())
@pytest.mark.parametrize("slope", [0.6e12, -0.2e12])
def test_jet_equals_finite_differences(anti_aliasing_filter, slope):
    frequency = np.linspace(-2.5e6, 2.5e6, 301)
    # The finest scale of Gbar is the longest part of the impulse response, some 5 us: with a step
    # of 1 kHz the central difference errs by (2 pi 5e-6 1e3)^2 / 6 = 1.6e-4 of its scale, and
    # rounding by 1e-14 / (1e3 * 2e-6).
    step = 1e3
    jet = anti_aliasing_filter.modified_response_jet(frequency, slope)
    above = anti_aliasing_filter.modified_response_jet(frequency + step, slope)
    below = anti_aliasing_filter.modified_response_jet(frequency - step, slope)
    for order in (0, 1):
        difference = (above[order] - below[order]) / (2 * step)
        np.testing.assert_allclose(
            jet[order + 1], difference, rtol=0, atol=1e-3 * np.abs(difference).max()
        )


@pytest.mark.parametrize("anti_aliasing_filter", closed_forms())
def test_slope_derivative_follows_from_the_second_derivative(anti_aliasing_filter):
    frequency = np.linspace(-2.5e6, 2.5e6, 301)
    slope, step = 0.6e12, 1e8
    jet = anti_aliasing_filter.modified_response_jet(frequency, slope)
    above = anti_aliasing_filter.modified_response(frequency, slope + step)
    below = anti_aliasing_filter.modified_response(frequency, slope - step)
    difference = (above - below) / (2 * step)
    # pi * step * (5 us)^2 = 0.008 rad turns the end of the impulse response: (0.008)^2 / 6 = 1e-5.
    np.testing.assert_allclose(
        -0.25j / np.pi * jet.second, difference, rtol=0, atol=1e-4 * np.abs(difference).max()
    )


@pytest.mark.parametrize("anti_aliasing_filter", all_filters())
def test_slopes_and_frequencies_broadcast(anti_aliasing_filter):
    slopes = np.array([[0.6e12], [-0.2e12], [0.6e12]])
    frequency = np.linspace(-1e6, 3e6, 15).reshape(3, 5)
    jet = anti_aliasing_filter.modified_response_jet(frequency, slopes)
    for row in range(3):
        alone = anti_aliasing_filter.modified_response_jet(frequency[row], float(slopes[row, 0]))
        for order in range(3):
            assert jet[order].shape == (3, 5)
            # The step of a measured filter's integral follows the batch; it converges to -120 dB.
            scale = max(np.abs(jet[order]).max(), 1e-300)
            np.testing.assert_allclose(jet[order][row], alone[order], rtol=0, atol=1e-4 * scale)


@pytest.mark.parametrize("anti_aliasing_filter", all_filters())
def test_filters_survive_pickling(anti_aliasing_filter):
    copy = pickle.loads(pickle.dumps(anti_aliasing_filter))
    frequency = np.linspace(-1e6, 1e6, 5)
    np.testing.assert_array_equal(
        copy.response(frequency), anti_aliasing_filter.response(frequency)
    )


@pytest.mark.parametrize("rolloff", [0.01, 0.25, 1.0])
def test_raised_cosine_response_by_definition(rolloff):
    frequency = np.linspace(-4e6, 4e6, 333)
    response = RaisedCosineFilter(cutoff_hz=CUTOFF_HZ, rolloff=rolloff).response(frequency)
    # The argument of the cosine carries a rounding error of eps f / width = 2e-16 * 160.
    np.testing.assert_allclose(
        response, raised_cosine(frequency, CUTOFF_HZ, rolloff), rtol=0, atol=1e-12
    )


@pytest.mark.parametrize("order", range(1, 17))
def test_butterworth_response_equals_the_design_of_scipy(order):
    frequency = np.linspace(-4e6, 4e6, 101)
    response = ButterworthFilter(cutoff_hz=CUTOFF_HZ, order=order).response(frequency)
    # Sixteen factors, and scipy's polynomial of degree sixteen whose terms cancel by up to 1e4.
    np.testing.assert_allclose(
        response, butterworth(frequency, CUTOFF_HZ, order), rtol=0, atol=1e-10
    )


@pytest.mark.parametrize("order", [1, 2, 8, 16])
def test_butterworth_partial_fractions_equal_the_product(order):
    anti_aliasing_filter = ButterworthFilter(cutoff_hz=CUTOFF_HZ, order=order)
    frequency = np.linspace(-4e6, 4e6, 101)
    terms = anti_aliasing_filter.residues / (
        2j * np.pi * frequency[:, None] - anti_aliasing_filter.poles
    )
    # Residues of up to 350 times the radius at order 16, eps each: 1e-13; asked for is -100 dB.
    np.testing.assert_allclose(
        terms.sum(axis=1), anti_aliasing_filter.response(frequency), rtol=0, atol=1e-11
    )


@pytest.mark.parametrize(
    "anti_aliasing_filter",
    [
        RaisedCosineFilter(cutoff_hz=CUTOFF_HZ, rolloff=0.01),
        RaisedCosineFilter(cutoff_hz=CUTOFF_HZ, rolloff=1.0),
        ButterworthFilter(cutoff_hz=CUTOFF_HZ, order=1),
        ButterworthFilter(cutoff_hz=CUTOFF_HZ, order=16),
    ],
)
def test_half_amplitude_at_the_cutoff_of_every_kind(anti_aliasing_filter):
    edge = np.array([-CUTOFF_HZ, CUTOFF_HZ])
    np.testing.assert_allclose(np.abs(anti_aliasing_filter.response(edge)), 0.5, atol=1e-12)


@pytest.mark.parametrize(
    "anti_aliasing_filter",
    [RaisedCosineFilter(cutoff_hz=CUTOFF_HZ), ButterworthFilter(cutoff_hz=CUTOFF_HZ)],
)
def test_modified_response_tends_to_the_response_for_parallel_chirps(anti_aliasing_filter):
    frequency = np.linspace(-2e6, 2e6, 101)
    # First order in the slope: Delta k / (4 pi) |G''| with |G''| < (2 pi 5 us)^2 = 1e-9.
    slope = 1e3
    np.testing.assert_allclose(
        anti_aliasing_filter.modified_response(frequency, slope),
        anti_aliasing_filter.response(frequency),
        rtol=0,
        atol=slope / (4 * np.pi) * 1e-9,
    )


@pytest.mark.parametrize(
    "anti_aliasing_filter",
    [
        RaisedCosineFilter(cutoff_hz=CUTOFF_HZ),
        ButterworthFilter(cutoff_hz=CUTOFF_HZ),
        MeasuredFilter(frequency_hz=np.arange(4.0), response=np.ones(4)),
    ],
)
def test_parallel_chirps_are_refused(anti_aliasing_filter):
    with pytest.raises(InputError, match="slope difference is 0"):
        anti_aliasing_filter.modified_response(np.zeros(3), np.array([[1e12], [0.0]]))


def test_no_filter_is_one_everywhere():
    none = NoFilter()
    np.testing.assert_array_equal(none.response(np.array([0.0, 1e12])), 1.0)
    value, first, second = none.modified_response_jet(np.zeros((2, 3)), np.zeros((2, 1)))
    assert value.shape == (2, 3)
    assert np.all(value == 1.0)
    assert not np.any(first)
    assert not np.any(second)
    assert none.cutoff_hz == math.inf
    assert none.kind == "none"


def test_equal_settings_make_equal_filters():
    assert RaisedCosineFilter(cutoff_hz=1e6) == RaisedCosineFilter(cutoff_hz=1e6, rolloff=0.25)
    assert len({ButterworthFilter(cutoff_hz=1e6), ButterworthFilter(cutoff_hz=1e6, order=8)}) == 1


@pytest.mark.parametrize(
    ("kind", "values", "message"),
    [
        (RaisedCosineFilter, {"cutoff_hz": 0.0}, "filter cutoff is 0"),
        (RaisedCosineFilter, {"cutoff_hz": math.nan}, "filter cutoff is nan"),
        (RaisedCosineFilter, {"cutoff_hz": 1e6, "rolloff": 0.0}, "rolloff is 0; .* 0.01 and 1"),
        (ButterworthFilter, {"cutoff_hz": 1e6, "order": 0}, "order is 0"),
        (ButterworthFilter, {"cutoff_hz": 1e6, "order": 17}, "order is 17; .* 1 and 16"),
        (ButterworthFilter, {"cutoff_hz": 1e6, "order": 2.5}, "order is 2.5; .* integer"),
        (ButterworthFilter, {"cutoff_hz": math.inf}, "filter cutoff is inf"),
    ],
)
def test_values_outside_of_their_range_are_refused(kind, values, message):
    with pytest.raises(InputError, match=message):
        kind(**values)
