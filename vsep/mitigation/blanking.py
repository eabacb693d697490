"""Blanking: flagged samples become zero, at once or under a window's soft edges."""

import numpy as np

from vsep._arrays import BoolArray
from vsep.mitigation.direct import DirectMitigation
from vsep.mitigation.method import FrameArray


def zeroing() -> DirectMitigation:
    """Make the usual remedy of products: flagged samples become zero."""
    return DirectMitigation("zeroing", zeroed)


def zeroed(received: FrameArray, mask: BoolArray) -> FrameArray:
    """Return the frame with zeros where the mask is True.

    Examples
    --------
    >>> zeroed(np.array([[1j, 2j]]), np.array([[False, True]])).imag
    array([[1., 0.]])
    """
    return np.where(mask, received.dtype.type(0), received)
