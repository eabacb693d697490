"""A tight short-time Fourier frame: its synthesis undoes its analysis exactly."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy import fft

from vsep._typing import FloatArray
from vsep.mitigation.method import FrameArray
from vsep.signal.spectra import hann_window

LENGTH = 16  # samples of a segment
HOP = 4  # samples between segments


@dataclass(frozen=True)
class ShortTimeFrame:
    """Windowed segments of ramps and their spectra.

    Examples
    --------
    >>> transform, ramps = ShortTimeFrame(50), np.ones((2, 50), dtype=complex)
    >>> bool(np.allclose(transform.synthesize(transform.analyse(ramps)), ramps, atol=1e-12))
    True
    """

    num_samples: int  #: length of a ramp

    @property
    def num_segments(self) -> int:
        """Segments of a ramp; the first and last ones reach over its ends."""
        return -(-(self.num_samples + LENGTH - HOP) // HOP)

    @cached_property
    def window(self) -> FloatArray:
        """(LENGTH,) window whose squares add up to one over all segments."""
        squares = hann_window(LENGTH)
        total = squares.reshape(-1, HOP).sum(axis=0)
        return np.asarray(np.sqrt(squares / np.tile(total, LENGTH // HOP)))

    def analyse(self, ramps: FrameArray) -> FrameArray:
        """(P, S, LENGTH) unitary spectra of the segments of (P, N) ramps."""
        length = (self.num_segments - 1) * HOP + LENGTH
        padded = np.zeros((len(ramps), length), dtype=ramps.dtype)
        padded[:, LENGTH - HOP : LENGTH - HOP + self.num_samples] = ramps
        starts = HOP * np.arange(self.num_segments)
        segments = padded[:, starts[:, None] + np.arange(LENGTH)]
        window = self.window.astype(segments.real.dtype)
        spectra: FrameArray = fft.ifft(segments * window, axis=2, norm="ortho")
        return spectra

    def synthesize(self, spectra: FrameArray) -> FrameArray:
        """(P, N) ramps of segment spectra, the adjoint of `analyse`."""
        window = self.window.astype(spectra.real.dtype)
        segments = fft.fft(spectra, axis=2, norm="ortho") * window
        blocks = segments.reshape(len(segments), self.num_segments, LENGTH // HOP, HOP)
        total = np.zeros((len(segments), self.num_segments + LENGTH // HOP - 1, HOP), spectra.dtype)
        for part in range(LENGTH // HOP):
            total[:, part : part + self.num_segments] += blocks[:, :, part]
        ramps = total.reshape(len(segments), -1)
        return ramps[:, LENGTH - HOP : LENGTH - HOP + self.num_samples]
