import numpy as np
import pytest

from vsep.errors import InputError
from vsep.signal.receiver_response import ReceiverResponse

FREQUENCY_HZ = np.linspace(-8e6, 8e6, 33)


def response_of(samples, **changes):
    values = {
        "frequency_hz": FREQUENCY_HZ,
        "response": samples,
        "coherence": np.ones(np.shape(samples)),
        "slope_difference_hz_per_s": 2e13,
        "num_bursts": 10,
    }
    return ReceiverResponse(**(values | changes))


def test_each_antenna_has_its_delay_and_filter():
    samples = np.exp(-2j * np.pi * FREQUENCY_HZ * np.array([[10e-9], [-30e-9]]))
    response = response_of(samples)
    np.testing.assert_allclose(response.delays_s, [10e-9, -30e-9], rtol=1e-9)
    np.testing.assert_allclose(response.filter_of(1).response(FREQUENCY_HZ), samples[1], atol=1e-12)


@pytest.mark.parametrize("antenna", [-1, 2])
def test_an_antenna_that_is_not_there_is_refused(antenna):
    with pytest.raises(InputError, match=rf"antenna is {antenna}; .* 0 to 1"):
        response_of(np.ones((2, 33), complex)).filter_of(antenna)


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ({"response": np.ones(33, complex)}, r"\(antennas, frequencies\)"),
        ({"coherence": np.full((1, 33), 1.5)}, "between 0 and 1"),
        ({"coherence": np.full((1, 33), np.nan)}, "between 0 and 1"),
        ({"response": np.full((1, 33), np.nan + 0j)}, "NaN or infinity"),
        ({"frequency_hz": FREQUENCY_HZ[::-1]}, "not ascending"),
    ],
)
def test_what_is_no_response_is_refused(changes, sentence):
    with pytest.raises(InputError, match=sentence):
        response_of(np.ones((1, 33), complex), **changes)
