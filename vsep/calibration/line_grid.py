"""Bursts as sums of spectral lines, which makes the response estimate linear.

The spectrum of a chirp ``exp(j pi dk t^2)`` is ``exp(-j pi f^2 / dk)`` up to a constant. A burst
with gain c that crosses zero frequency at the sample t is therefore, exactly and for any slope,

    y(n) = c * sum over k of G(f_k) exp(-j pi f_k^2 / dk) exp(j 2 pi f_k (n - t) / f_s),

with lines so close that the burst does not repeat within its window. The lines reach beyond half
the sample rate: what a filter leaves there aliases, and bursts that cross at different fractions
of a sample tell it apart. Line k of a grid of W samples is ``f_k = k f_s / W``; sums over lines and
over samples are FFTs of size W.
"""

from dataclasses import dataclass

import numpy as np
from scipy import fft

from vsep._typing import ComplexArray, FloatArray

BAND = 0.8  # the lines reach up to this share of the sample rate on either side


@dataclass(frozen=True, kw_only=True, slots=True)
class LineGrid:
    """Lines of spacing ``sample_rate_hz / size``."""

    size: int  #: W, longer than any window of a burst
    sample_rate_hz: float  #: f_s

    @property
    def lines(self) -> FloatArray:
        """(K,) numbers k of the lines."""
        half = int(BAND * self.size)
        return np.arange(-half, half + 1, dtype=np.float64)

    @property
    def frequency_hz(self) -> FloatArray:
        """(K,) frequencies of the lines."""
        return self.lines * (self.sample_rate_hz / self.size)

    def chirp(self, crossing: float, slope_hz_per_s: float) -> ComplexArray:
        """(K,) spectrum of a chirp of slope `slope_hz_per_s` that crosses at a sample."""
        quadratic = -np.pi * self.frequency_hz**2 / slope_hz_per_s
        return np.asarray(
            np.exp(1j * (quadratic - 2.0 * np.pi * self.lines / self.size * crossing))
        )

    def synthesize(self, values: ComplexArray, first: int, length: int) -> ComplexArray:
        """(..., length) samples ``first, first + 1, ...`` of lines with the values (..., K)."""
        # Lines beyond half the sample rate alias onto others.
        half = (values.shape[-1] - 1) // 2
        periods = np.zeros((*values.shape[:-1], 2, self.size), dtype=np.complex128)
        flat = periods.reshape(*values.shape[:-1], 2 * self.size)
        flat[..., self.size - half : self.size + half + 1] = values
        folded = periods.sum(axis=-2)
        samples = fft.ifft(folded, axis=-1, norm="forward")
        return np.asarray(samples[..., (first + np.arange(length)) % self.size])

    def project(self, samples: ComplexArray, first: int) -> ComplexArray:
        """(..., K) inner products of the lines with samples (..., M) from `first` on."""
        placed = np.zeros((*samples.shape[:-1], self.size), dtype=np.complex128)
        placed[..., (first + np.arange(samples.shape[-1])) % self.size] = samples
        spectrum = fft.fft(placed, axis=-1)
        half = int(BAND * self.size)
        return np.asarray(spectrum[..., np.arange(-half, half + 1) % self.size])

    def gram(self, first: int, length: int) -> ComplexArray:
        """(2 K - 1,) inner products of lines seen in a window, by difference of their numbers."""
        placed = np.zeros(self.size, dtype=np.complex128)
        placed[(first + np.arange(length)) % self.size] = 1.0
        widest = 2 * int(BAND * self.size)
        return np.asarray(fft.fft(placed)[np.arange(-widest, widest + 1) % self.size])
