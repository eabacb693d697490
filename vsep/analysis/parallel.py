"""Detection of interference with the victim's own slope.

It crosses nothing: in a ramp it is a tone, like an object. Only from ramp to ramp does it differ.
If both radars repeat their ramps at different intervals it is there in some ramps and not in
others, and this is what can be recognised; at equal intervals it is a ghost object.
"""

from typing import Final

import numpy as np

from vsep._typing import BoolArray, ComplexArray

MIN_RAMPS: Final = 8  # below, a median over the ramps says nothing
SUDDEN: Final = 30.0  # times the median over the ramps; one noise sample in 1e9 exceeds it
TONE_BINS: Final = 2  # on both sides of the strongest: the main lobe of the window
TONE_SHARE: Final = 0.9  # of what is sudden in a ramp, within the lobe


def parallel_ramps(received: ComplexArray) -> BoolArray:
    """Find ramps with a strong tone that the other ramps do not have.

    Parameters
    ----------
    received : (P, N) complex
        The frame.

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
    num_ramps, num_samples = received.shape
    if num_ramps < MIN_RAMPS:
        return np.zeros(num_ramps, dtype=bool)
    power = np.abs(np.fft.fft(received * np.hanning(num_samples), axis=1)) ** 2
    usual = np.median(power, axis=0)
    # A notch of the receiver makes bins next to empty, and what leaks into them look sudden.
    usual = np.maximum(usual, np.median(usual))
    sudden = np.where(power > SUDDEN * usual, power, 0.0)
    total = sudden.sum(axis=1)
    peaks = np.argmax(sudden, axis=1)
    lobe = (peaks[:, None] + np.arange(-TONE_BINS, TONE_BINS + 1)) % num_samples
    inside = np.take_along_axis(sudden, lobe, axis=1).sum(axis=1)
    return np.asarray((total > 0.0) & (inside >= TONE_SHARE * total))
