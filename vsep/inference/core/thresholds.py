"""Thresholds of activation ratios from false-alarm rates."""

from functools import lru_cache

import numpy as np
from scipy.optimize import brentq
from scipy.special import gammainccinv, gammaln, lambertw, xlogy

MAX_EXPLAINED = 0.5  # of a frame's noise that false alarms may be expected to explain


@lru_cache(maxsize=64)
def threshold_from_false_alarm_rate(
    rate: float, num_ramps: int, num_samples: int, num_antennas: int = 1
) -> float:
    r"""Object threshold T for an expected number of false alarms in a noise-only frame.

    The activation ratio over the delay-Doppler plane of white noise is a chi-square field with two
    degrees of freedom. Its expected number of local maxima above T is, by the Rice formula,
    ``N sqrt(pi T / 3) exp(-T)`` for one ramp and ``N P (pi T / 3) exp(-T)`` for several. Both are
    solved for T in closed form with Lambert's W function.

    Over A antennas the sum of the ratios is such a field with 2A degrees of freedom, and the
    numbers become ``N sqrt(pi / 3) T^(A - 1/2) exp(-T) / Gamma(A)`` and ``N P (pi / 3) T^(A - 1)
    (T - A + 1) exp(-T) / Gamma(A)`` (K. Worsley, Adv. Appl. Prob. 26, 1994), which is solved for T
    by bisection.

    The false alarms of a frame explain T + 1 noise units each on average and give back one as
    uncertainty in (65): with `rate` of them lambda is too high by ``1 / (1 - rate T / (N P))``, and
    the threshold is raised by that.

    Parameters
    ----------
    rate : float
        False alarms per frame.
    num_ramps, num_samples : int
        P and N.
    num_antennas : int
        A.

    Returns
    -------
    float
        T, linear; at least A, below which every component would be kept.

    Examples
    --------
    >>> import math
    >>> round(10 * math.log10(threshold_from_false_alarm_rate(0.05, 16, 128)), 2)
    11.22
    """
    if num_antennas > 1:
        return _threshold_of_antennas(rate, num_ramps, num_samples, num_antennas)
    # Both forms read T^m exp(-T) = level with m = 1/2 or 1; T = -m W_{-1}(-level^(1/m) / m).
    if num_ramps == 1:
        power, level = 0.5, rate / (num_samples * np.sqrt(np.pi / 3.0))
    else:
        power, level = 1.0, rate / (num_samples * num_ramps * np.pi / 3.0)
    argument = -(level ** (1.0 / power)) / power
    if argument <= -np.exp(-1.0):
        return 1.0
    # solution of T^m exp(-T) = level
    threshold = max(1.0, float((-power * lambertw(argument, -1)).real))
    # share of the noise that false alarms take from lambda
    explained = min(rate * threshold / (num_ramps * num_samples), MAX_EXPLAINED)
    return threshold / (1.0 - explained)


@lru_cache(maxsize=64)
def _threshold_of_antennas(
    rate: float, num_ramps: int, num_samples: int, num_antennas: int
) -> float:
    def excess(threshold: float) -> float:
        """Logarithm of the expected number of false alarms over the rate."""
        log_number = xlogy(num_antennas - 1, threshold) - threshold - gammaln(num_antennas)
        if num_ramps == 1:
            return float(log_number + np.log(scale * np.sqrt(threshold)))
        return float(log_number + np.log(scale * (threshold - num_antennas + 1.0)))

    if num_ramps == 1:
        scale = num_samples * np.sqrt(np.pi / 3.0) / rate
    else:
        scale = num_samples * num_ramps * np.pi / 3.0 / rate
    # The numbers fall from here on: both their logarithms are concave, with the peak below.
    lowest = num_antennas + np.sqrt(num_antennas)
    highest = lowest
    while excess(highest) > 0.0:
        highest *= 2.0
    threshold = lowest if highest == lowest else float(brentq(excess, lowest, highest))
    gained = rate * (threshold + 1.0 - num_antennas)
    explained = min(gained / (num_antennas * num_ramps * num_samples), MAX_EXPLAINED)
    return threshold / (1.0 - explained)


def threshold_of_sum(threshold: float, num_antennas: int) -> float:
    """Threshold that the sum of A antennas' ratios exceeds as often in noise as one exceeds its.

    The ratio of a weight in noise is exponential, the sum of A of them follows a Gamma law.

    Examples
    --------
    >>> round(threshold_of_sum(20.0, 1), 6), round(threshold_of_sum(20.0, 4), 1)
    (20.0, 28.3)
    """
    if num_antennas == 1:
        return threshold
    # P(sum of A exponentials > T_A) = exp(-T)
    return float(gammainccinv(num_antennas, np.exp(-threshold)))
