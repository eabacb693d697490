import numpy as np
import pytest

from vsep.errors import InputError
from vsep.mitigation.noise_canceller import cancelled, noise_canceller

SAMPLE = np.arange(128)


def chirp(centre):
    """Burst that crosses zero frequency at a sample, symmetric about it."""
    return (
        30.0 * np.exp(1j * np.pi * 0.02 * (SAMPLE - centre) ** 2) * (np.abs(SAMPLE - centre) < 20)
    )


@pytest.mark.parametrize("beat", [0.2, -0.2])
def test_a_symmetric_burst_is_lowered_by_ten_decibels_on_the_side_of_the_objects(beat):
    line = np.exp(-2j * np.pi * beat * SAMPLE)
    for centre in (40.0, 70.0):
        burst = chirp(centre)
        mask = (np.abs(burst) > 0)[None]
        cleaned = cancelled((line + burst)[None], mask)[0]
        # The half of the spectrum that is thrown away is 3 dB of it.
        assert np.linalg.norm(cleaned - line) < 10 ** (-13 / 20) * np.linalg.norm(burst)


def test_ramps_without_flagged_samples_stay_as_they_are():
    frame = np.stack([chirp(60.0), np.exp(-0.3j * SAMPLE)])
    mask = np.zeros(frame.shape, dtype=bool)
    mask[0, 40:80] = True
    np.testing.assert_array_equal(cancelled(frame, mask)[1], frame[1])


def test_settings_out_of_range_are_refused():
    with pytest.raises(InputError, match="taps is 0"):
        noise_canceller(taps=0)
    with pytest.raises(InputError, match="step is 3"):
        noise_canceller(step=3.0)
