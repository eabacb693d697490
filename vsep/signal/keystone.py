"""Exact keystone transform: Doppler frequency and beat of objects that move through range cells.

In sample n an object turns from ramp to ramp by its Doppler frequency times ``1 + mu n``. A
chirp-z transform along the ramps, scaled like that, has the same Doppler frequencies in its rows
for every sample; a Fourier transform along the samples follows.
"""

from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import fft

from vsep._typing import FloatArray
from vsep.kernels.moving_atoms import Migration, fold_width

SingleComplexArray = NDArray[np.complex64]


def keystone_dopplers(shape: tuple[int, int], migration: Migration, padding: int = 2) -> FloatArray:
    """Doppler frequencies (R,) of the rows of `keystone_transform`, in cycles per ramp."""
    num_rows = padding * shape[0] * (2 * migration.folds + 1)
    step = fold_width(migration, shape[1]) / (padding * shape[0])
    return np.asarray(step * (np.arange(num_rows) - num_rows // 2))


@lru_cache(maxsize=4)
def _chirps(
    shape: tuple[int, int], migration: Migration, padding: int
) -> tuple[SingleComplexArray, SingleComplexArray, SingleComplexArray]:
    """Chirps before and after Bluestein's convolution (P, N) and (R, N), and its kernel's spectrum.

    With ``g p = (g^2 + p^2 - (g - p)^2) / 2`` the transform at row g is a convolution.
    """
    num_ramps, num_samples = shape
    dopplers = keystone_dopplers(shape, migration, padding)
    num_rows, samples = len(dopplers), np.arange(num_samples)
    # Cycles per row and ramp
    turns = (dopplers[1] - dopplers[0]) * (1.0 + migration.coupling * samples)
    ramps = np.arange(num_ramps)[:, None]
    rows = np.arange(num_rows)[:, None] - num_rows // 2
    within = migration.ramp_share * (samples - 0.5 * (num_samples - 1))
    before = 0.5 * turns * ramps**2
    after = 0.5 * turns * rows**2 + turns * rows * (within - 0.5 * (num_ramps - 1))
    size = fft.next_fast_len(num_rows + num_ramps - 1)
    lags = np.arange(size)[:, None]
    lags[lags >= size - num_ramps + 1] -= size
    kernel = _cis(-0.5 * turns * (lags + rows[0]) ** 2)
    scale = np.float32(1.0 / np.sqrt(num_ramps * num_samples))
    return _cis(before), scale * _cis(after), fft.fft(kernel, axis=0)


def _cis(cycles: NDArray[Any]) -> SingleComplexArray:
    return np.asarray(np.exp(2j * np.pi * (cycles % 1.0)), dtype=np.complex64)


def keystone_transform(
    signals: SingleComplexArray, migration: Migration, padding: int = 2
) -> SingleComplexArray:
    """Inner products of signals with atoms of moving objects, on a grid.

    Parameters
    ----------
    signals : (A, P, N) complex
        What antennas receive.
    migration : Migration
        How objects move.
    padding : int
        Points of the grid in a cell.

    Returns
    -------
    (A, R, padding N) complex
        At `keystone_dopplers`, zero in row R/2, and beats from 0 on. Atoms are known up to a phase.
    """
    shape = signals.shape[1:]
    before, after, spectrum = _chirps(shape, migration, padding)
    transforms = fft.fft(signals * before, len(spectrum), axis=1, overwrite_x=True)
    transforms *= spectrum
    transforms = fft.ifft(transforms, axis=1, overwrite_x=True)[:, : len(after)]
    transforms *= after
    return np.asarray(fft.ifft(transforms, padding * shape[1], axis=2, norm="forward"))
