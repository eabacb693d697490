"""Detection of interference with the victim's own slope.

It crosses nothing: in a ramp it is a tone, like an object. Only from ramp to ramp does it differ.
If both radars repeat their ramps at different intervals it is there in some ramps and not in
others, and this is what can be recognised; at equal intervals it is a ghost object. A weak burst
is told from it by all that is in its ramp: its energy is spread over beats.
"""

import math
from typing import Final

import numpy as np

from vsep._typing import BoolArray, ComplexArray, FloatArray

MIN_RAMPS: Final = 8  # below, a median over the ramps says nothing
SUDDEN: Final = 30.0  # times the median over the ramps; one noise sample in 1e9 exceeds it
TONE_BINS: Final = 2  # on both sides of the strongest: the main lobe of the window
BESIDE_BINS: Final = 8  # from the strongest on: where a weak burst goes on
TONE_SHARE: Final = 0.9  # of what a ramp holds more than others, within the lobe ...
CERTAIN: Final = 3.0  # ... but for so many deviations of the noise
HANN_CORRELATION: Final = 35.0 / 18.0  # sum of squared correlations of a bin with all others


def parallel_ramps(received: ComplexArray) -> BoolArray:
    """Find ramps with a strong tone that the other ramps do not have.

    Parameters
    ----------
    received : (P, N) or (A, P, N) complex
        The frame; of several antennas a tone at any of them counts.

    Returns
    -------
    (P,) bool
        Nothing where there are fewer than eight ramps, or where most ramps have such tones.

    Examples
    --------
    >>> rng = np.random.default_rng(0)
    >>> frame = rng.normal(size=(16, 64)) + 1j * rng.normal(size=(16, 64))
    >>> frame[5] += 10.0 * np.exp(2j * np.pi * 0.21 * np.arange(64))
    >>> np.flatnonzero(parallel_ramps(frame))
    array([5])
    """
    if received.ndim == 3:
        return np.asarray(np.any([parallel_ramps(each) for each in received], axis=0))
    num_ramps, num_samples = received.shape
    if num_ramps < MIN_RAMPS:
        return np.zeros(num_ramps, dtype=bool)
    power = np.abs(np.fft.fft(received * np.hanning(num_samples), axis=1)) ** 2
    usual = np.median(power, axis=0)
    # A notch of the receiver makes bins next to empty, and what leaks into them look sudden.
    usual = np.maximum(usual, max(np.median(usual), np.finfo(float).tiny))
    power /= usual
    peaks = np.argmax(np.where(power > SUDDEN, power * usual, 0.0), axis=1)
    sudden = np.take_along_axis(power, peaks[:, None], axis=1)[:, 0] > SUDDEN
    # From the strongest bin on; the median of an exponential law is ln 2 its mean.
    order = (peaks[:, None] + np.arange(num_samples)) % num_samples
    more = np.take_along_axis(power * math.log(2.0) - 1.0, order, axis=1)
    inside = _within(more, TONE_BINS)
    for reach in (min(BESIDE_BINS, num_samples // 2), num_samples // 2):
        noise = CERTAIN * math.sqrt(2.0 * HANN_CORRELATION * reach)
        beside = _within(more, reach) - inside - noise
        sudden &= TONE_SHARE * beside <= (1.0 - TONE_SHARE) * inside
    return np.asarray(sudden)


def _within(values: FloatArray, reach: int) -> FloatArray:
    """Return sums of (P, N) periodic values over so many bins on both sides of the first."""
    return np.asarray(values[:, : reach + 1].sum(axis=1) + values[:, -reach:].sum(axis=1))
