"""A frame as sound: its ramps one after the other, slow enough for the ear.

The intermediate frequency is what a radar's ear hears anyway: an object is a tone that is higher
the farther it is, a burst is a chirp. Half of the sampling rate becomes 4 kHz.
"""

from typing import Final

import numpy as np

from vsep._typing import ComplexArray, FloatArray

RATE_HZ: Final = 8000
LEAST_SECONDS, MOST_SECONDS = 1.0, 4.0
FADE_SECONDS = 0.01  # at both ends: a sudden one is a click


def sound_of(signal: ComplexArray) -> FloatArray:
    """Make sound (S,) of a frame (P, N): its real part, ramp after ramp, as loud as it can be.

    A short frame is repeated, a long one ends before its last ramp.

    Examples
    --------
    >>> import numpy as np
    >>> tone = np.exp(-2j * np.pi * 0.1 * np.arange(256))[None, :]
    >>> len(sound_of(tone)) / RATE_HZ
    1.024
    """
    wave = signal.real.ravel()
    wave = np.tile(wave, max(1, int(np.ceil(LEAST_SECONDS * RATE_HZ / len(wave)))))
    wave = wave[: int(MOST_SECONDS * RATE_HZ)]
    fade = np.minimum(1.0, np.arange(1, len(wave) + 1) / (FADE_SECONDS * RATE_HZ))
    wave = wave * fade * fade[::-1]
    loudest = float(np.abs(wave).max())
    return np.asarray(wave / loudest if loudest > 0.0 else wave)
