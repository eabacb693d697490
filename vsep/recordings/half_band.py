"""Real samples as complex ones of half the rate, by a linear-phase half-band filter.

The samples are mixed by a quarter of their rate, low-passed, decimated by two and shifted back.
Only outputs that see whole ramps are kept, so that a line stays a line: the cosine of frequency f,
``cos(2 pi f n)``, becomes ``exp(j 2 pi f n)`` with an image of at most -80 dB. In the transition
bands next to zero and to half the rate both are there.
"""

from dataclasses import dataclass
from functools import lru_cache
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray
from scipy import signal

from vsep._typing import ComplexArray, FloatArray
from vsep.errors import InputError

STOP_BAND_DB: Final = 80.0
RIPPLE_DB: Final = 0.1
MOST_TAPS: Final = 63
SHARE_OF_RAMP: Final = 3  # the taps take at most a third of a ramp ...
LEAST_SAMPLES: Final = 33  # ... of eleven taps
_TRANSITION: Final = 3.5  # cycles per sample times taps, for this ripple and stop band


@dataclass(frozen=True, slots=True, eq=False)
class HalfBand:
    """The filter for ramps of a certain length.

    Parameters
    ----------
    taps : (L,) float
        Low-pass of a quarter of the rate; L is odd.
    transition : float
        Width of the bands next to zero and to half the rate in which images remain, cycles per
        real sample.
    """

    taps: FloatArray
    transition: float

    @property
    def delay(self) -> int:
        """Real samples before the first output's, (L - 1) / 2."""
        return len(self.taps) // 2


@lru_cache(maxsize=8)
def half_band(num_samples: int) -> HalfBand:
    """Design the filter for ramps of so many real samples.

    Raises `InputError` if they are too short.

    Examples
    --------
    >>> len(half_band(256).taps), round(half_band(256).transition, 3)
    (63, 0.028)
    """
    if num_samples < LEAST_SAMPLES:
        raise InputError(
            f"A ramp has {num_samples} real samples; at least {LEAST_SAMPLES} are needed."
        )
    count = min((num_samples // SHARE_OF_RAMP - 1) | 1, MOST_TAPS)
    half_width = _TRANSITION / (count - 1) / 2.0
    edges = [0.0, 0.25 - half_width, 0.25 + half_width, 0.5]
    weight = (10.0 ** (RIPPLE_DB / 40.0) - 1.0) * 10.0 ** (STOP_BAND_DB / 20.0)
    taps = signal.remez(count, edges, [1.0, 0.0], weight=[1.0, weight], fs=1.0, grid_density=32)
    return HalfBand(taps=taps, transition=half_width)


def complex_at_half_rate(samples: NDArray[Any]) -> ComplexArray:
    """Filter and decimate real samples along the last axis.

    Output m belongs to the sample ``delay + 2 m`` of `half_band`; a cosine of amplitude one becomes
    a line of magnitude one at its positive frequency, twice as many cycles per sample.

    Raises `InputError` if there are too few samples.

    Examples
    --------
    >>> line = complex_at_half_rate(np.cos(2 * np.pi * 0.2 * np.arange(64)))
    >>> line.shape, float(np.ptp(np.abs(line))) < 1e-3
    ((22,), True)
    """
    design = half_band(samples.shape[-1])
    quarter = np.exp(-0.5j * np.pi * np.arange(samples.shape[-1]))
    every = signal.upfirdn(design.taps, samples * quarter, down=2, axis=-1)
    # Outputs that see nothing beyond the ramp's ends
    low_passed = 2.0 * every[..., design.delay : (samples.shape[-1] + 1) // 2]
    times = design.delay + 2 * np.arange(low_passed.shape[-1])
    return np.asarray(low_passed * np.exp(0.5j * np.pi * times), dtype=np.complex128)


def missing_at_half_rate(missing: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return which outputs of `complex_at_half_rate` see a sample that is missing."""
    taps = len(half_band(missing.shape[-1]).taps)
    windows = np.lib.stride_tricks.sliding_window_view(missing, taps, axis=-1)
    return np.asarray(windows[..., ::2, :].any(axis=-1))
