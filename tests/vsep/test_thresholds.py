"""Thresholds against the numbers of false alarms that they stand for."""

import numpy as np
import pytest
from scipy.optimize import brentq

from vsep.inference.core.thresholds import threshold_from_false_alarm_rate


@pytest.mark.parametrize("rate", [0.01, 0.05, 0.5, 5.0])
@pytest.mark.parametrize(("num_ramps", "num_samples"), [(1, 256), (16, 128)])
def test_threshold_solves_the_expected_number_of_maxima(rate, num_ramps, num_samples):
    def excess(threshold):
        if num_ramps == 1:
            scale = num_samples * np.sqrt(np.pi * threshold / 3)
        else:
            scale = num_samples * num_ramps * np.pi * threshold / 3
        return np.log(scale / rate) - threshold

    alone = brentq(excess, 1.0, 60.0, xtol=1e-12)
    # The expected false alarms take their share of the noise energy, T each, from lambda.
    expected = alone / (1.0 - rate * alone / (num_ramps * num_samples))
    found = threshold_from_false_alarm_rate(rate, num_ramps, num_samples)
    assert found == pytest.approx(expected, rel=1e-10)


def test_threshold_never_falls_below_one():
    assert threshold_from_false_alarm_rate(1e3, 1, 8) == 1.0
