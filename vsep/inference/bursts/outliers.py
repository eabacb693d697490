"""Censoring of outliers: samples that no source explains count as missing.

Deviation: an interferer that switches on or off inside the band, a second burst in the same ramp or
a filter other than the assumed one leave samples far above the noise. Expectation-maximisation puts
what both sources predict there in their place.
"""

import math

import numpy as np
from scipy import ndimage

from vsep._typing import ComplexArray, FloatArray

UNEXPLAINED = 20.0  # times the noise power: what one in 5e8 noise samples exceeds is censored ...
RAISED, RAISED_SAMPLES = 3.0, 5  # ... with its neighbours, as long as their local mean is raised
ALONG_THE_RAMP = np.array([[False] * 3, [True] * 3, [False] * 3])


def drop_outliers(received: ComplexArray, explained: ComplexArray) -> tuple[ComplexArray, int]:
    """Replace samples that are not explained by what is.

    Parameters
    ----------
    received, explained : (P, N) complex
        The frame, and what both sources predict of it.

    Returns
    -------
    received : (P, N) complex
        The frame itself where every sample counts.
    num_used : int
        Samples that count.

    Examples
    --------
    >>> import numpy as np
    >>> noise = np.exp(2j * np.pi * np.random.default_rng(1).uniform(size=(1, 64)))
    >>> frame = noise + 100.0 * (np.arange(64) == 20)
    >>> repaired, num_used = drop_outliers(frame, np.zeros((1, 64), dtype=complex))
    >>> int(np.abs(repaired[0, 20])), num_used < 64
    (0, True)
    """
    noise_residual = received - explained
    power = noise_residual.real**2 + noise_residual.imag**2
    noise = _median(power) / math.log(2.0)  # the median of an exponential law is ln 2 its mean
    # Seeds, then neighbours whose local mean is raised as well
    certain = power > UNEXPLAINED * noise
    if not certain.any():
        return received, received.size
    # without the seeds themselves
    around = ndimage.uniform_filter1d(np.where(certain, 0.0, power), RAISED_SAMPLES, axis=1)
    counted = ndimage.uniform_filter1d(np.where(certain, 0.0, 1.0), RAISED_SAMPLES, axis=1)
    raised = around > RAISED * noise * counted
    unexplained = ndimage.binary_propagation(certain, ALONG_THE_RAMP, certain | raised)
    return np.where(unexplained, explained, received), int(np.sum(~unexplained))


def _median(values: FloatArray) -> float:
    """Median of all values, none of them NaN."""
    flat, middle = values.ravel(), values.size // 2
    places = [middle] if values.size % 2 else [middle - 1, middle]
    return float(np.partition(flat, places)[places].mean())
