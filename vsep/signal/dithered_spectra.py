"""Range-Doppler spectra of frames of dithered ramps.

Samples become beats by a Fourier transform, every beat is turned back by the phase that its ramp's
start frequency gave it, and the ramps become Doppler frequencies by a transform over their true
start times. Where objects move through range cells, their motion is taken off first, for blocks of
Doppler frequencies within which it is the same up to a part of a cell.
"""

from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import fft

from vsep._typing import FloatArray, frozen
from vsep.signal.dithered_atoms import RampDither


def dithered_spectrum(
    signals: NDArray[Any],
    dither: RampDither,
    dopplers: FloatArray,
    num_beats: int,
    *,
    cells: float = 0.0625,
    along: float | None = None,
) -> NDArray[Any]:
    """Transform signals (A, P, N) to Doppler frequencies and beats, (A, R, num_beats).

    Parameters
    ----------
    signals : (A, P, N) complex
        What antennas receive; the result has their precision.
    dither : RampDither
        How the ramps were dithered.
    dopplers : (R,) float
        Ascending, cycles per ramp.
    num_beats : int
        Beats are multiples of its inverse, from zero on.
    cells : float
        By how much the motion within a block differs at most, in range cells.
    along : float, optional
        Doppler frequency by which the motion is taken off, the same for all.

    Examples
    --------
    >>> equal = RampDither(start_ramps=(0.0,) * 4, start_samples=(0.0,) * 4)
    >>> frame = np.ones((1, 4, 8), dtype=complex)
    >>> np.abs(dithered_spectrum(frame, equal, np.array([0.0, 0.25]), 8))[0, :, 0].round(9)
    array([32.,  0.])
    """
    num_ramps, num_samples = signals.shape[1:]
    precision = np.complex64 if signals.dtype == np.complex64 else np.complex128
    beats = dither.unambiguous(np.arange(num_beats) / num_beats)
    phases = np.exp(2j * np.pi * dither.samples[:, None] * beats).astype(precision)
    turns = np.exp(2j * np.pi * dopplers[:, None] * dither.ramps).astype(precision)
    beyond = dither.course(num_samples) - dither.ramps[:, None]
    parts = np.empty((len(signals), len(dopplers), num_beats), dtype=precision)
    for block in _blocks(dopplers, dither, num_ramps * num_samples, cells, along):
        middle = along if along is not None else float(dopplers[block].mean())
        resting = signals
        if dither.motion.coupling != 0.0:
            resting = signals * np.exp(2j * np.pi * middle * beyond).astype(precision)
        across = phases * fft.ifft(resting, num_beats, axis=2, norm="forward")
        parts[:, block] = turns[block] @ across
    return parts


def _blocks(
    dopplers: FloatArray, dither: RampDither, size: int, cells: float, along: float | None
) -> list[slice]:
    """Return runs of Doppler frequencies within which objects move alike."""
    walk = abs(dither.motion.coupling) * size  # range cells in a frame per cycle a ramp
    if walk == 0.0 or along is not None:
        return [slice(0, len(dopplers))]
    step = (dopplers[-1] - dopplers[0]) / max(len(dopplers) - 1, 1)
    count = max(int(cells / max(walk * step, 1e-12)), 1)
    return [slice(first, first + count) for first in range(0, len(dopplers), count)]


class DitheredTransform:
    """A unitary transform in the place of the discrete Fourier transform of both axes of a frame.

    Lines of Doppler frequencies on the grid of a DFT are no orthonormal basis over start times that
    are no grid; the nearest one is taken. Beats are those of a DFT.

    Parameters
    ----------
    dither : RampDither
        How the ramps were dithered; objects stay in their range cells.
    num_samples : int
        N.
    precision : dtype
        complex64 or complex128.

    Examples
    --------
    >>> dither = RampDither(start_ramps=(0.0, 0.2, -0.1), start_samples=(1.5, 0.0, -2.0))
    >>> transform = DitheredTransform(dither, 4, np.complex128)
    >>> frame = np.arange(12.0).reshape(3, 4) + 0j
    >>> bool(np.allclose(transform.synthesis(transform.analysis(frame)), frame))
    True
    """

    def __init__(self, dither: RampDither, num_samples: int, precision: Any) -> None:
        num_ramps = len(dither.start_ramps)
        lines = np.exp(-2j * np.pi * dither.ramps[:, None] * fft.fftfreq(num_ramps))
        left, _, right = np.linalg.svd(lines / np.sqrt(num_ramps))
        beats = dither.unambiguous(fft.fftfreq(num_samples))
        phases = np.exp(-2j * np.pi * dither.samples[:, None] * beats)
        self._turns = frozen((left @ right).astype(precision))
        self._phases = frozen(phases.astype(precision))

    def synthesis(self, spectrum: NDArray[Any]) -> NDArray[Any]:
        """Return the frame (P, N) of a spectrum (P, N); in a DFT's place."""
        return np.asarray(fft.fft((self._turns @ spectrum) * self._phases, axis=1, norm="ortho"))

    def analysis(self, frame: NDArray[Any]) -> NDArray[Any]:
        """Return the spectrum (P, N) of a frame (P, N); in an inverse DFT's place."""
        lines = fft.ifft(frame, axis=1, norm="ortho") * self._phases.conj()
        return np.asarray(self._turns.conj().T @ lines)


@lru_cache(maxsize=8)
def dithered_transform(dither: RampDither, num_samples: int, precision: Any) -> DitheredTransform:
    """Return the transform of a frame; it is made once."""
    return DitheredTransform(dither, num_samples, precision)
