"""Accuracy of repaired frames and of masks of interfered samples.

The error is weighted by the two-dimensional Hann window of range-Doppler processing. That of the
whole frame is bounded by the noise of its clean samples; inside the gaps the methods differ.
"""

from typing import NamedTuple

import numpy as np

from vsep._typing import BoolArray, ComplexArray
from vsep.signal.spectra import hann_window
from vsep.units import to_db


def windowed_error_db(object_signal: ComplexArray, cleaned: ComplexArray) -> float:
    """Normalised squared error of the windowed frame, in dB.

    Parameters
    ----------
    object_signal, cleaned : (P, N) complex
        True object signal, and the frame after mitigation.

    Examples
    --------
    >>> import numpy as np
    >>> round(windowed_error_db(np.ones((2, 4)), 1.1 * np.ones((2, 4))), 6)
    -20.0
    """
    everywhere = np.ones(object_signal.shape, dtype=np.bool_)
    return gap_error_db(object_signal, cleaned, everywhere)


def gap_error_db(object_signal: ComplexArray, cleaned: ComplexArray, mask: BoolArray) -> float:
    """Normalised squared error of the windowed samples that were flagged, in dB.

    Parameters
    ----------
    object_signal, cleaned : (P, N) complex
        True object signal, and the frame after mitigation.
    mask : (P, N) bool
        True where a sample was flagged.

    Returns
    -------
    float
        NaN where no object energy was flagged.
    """
    num_ramps, num_samples = object_signal.shape
    window = np.outer(hann_window(num_ramps), hann_window(num_samples))
    present = np.sum(np.abs(window * object_signal)[mask] ** 2)
    if present == 0.0:
        return float("nan")
    error = np.sum(np.abs(window * (cleaned - object_signal))[mask] ** 2)
    return float(to_db(error / present))


class MaskErrors(NamedTuple):
    """Share of the interfered samples that were missed, and of the clean ones flagged falsely."""

    missed: float
    false: float


def mask_errors(true: BoolArray, found: BoolArray) -> MaskErrors:
    """Compare a found mask with the true one.

    Parameters
    ----------
    true, found : (P, N) bool
        Masks of interfered samples.

    Examples
    --------
    >>> true, found = np.array([[True, True, False, False]]), np.array([[True, False, False, True]])
    >>> mask_errors(true, found)
    MaskErrors(missed=0.5, false=0.5)
    """
    missed = np.sum(true & ~found) / max(int(np.sum(true)), 1)
    false = np.sum(found & ~true) / max(int(np.sum(~true)), 1)
    return MaskErrors(missed=float(missed), false=float(false))
