"""Blanking: flagged samples become zero, at once or between soft edges."""

from functools import partial

import numpy as np

from vsep._typing import BoolArray, FloatArray
from vsep._validation import require_range
from vsep.mitigation.direct import DirectMitigation, direct_entry
from vsep.mitigation.entry import time_domain_entry
from vsep.mitigation.method import FrameArray

EDGE_SAMPLES = 4  # on either side of what is blanked: the taper of sensor vendors' data sheets


def blanking(edge_samples: int = EDGE_SAMPLES) -> DirectMitigation:
    """Make windowed blanking: zero where flagged, raised-cosine edges beside it.

    Parameters
    ----------
    edge_samples : int
        Length of an edge; 0 is zeroing.

    Raises
    ------
    InputError
        If the length is out of its range.
    """
    require_range("edge_samples", edge_samples, 0, 1024)
    return DirectMitigation("blanking", partial(blanked, edge_samples=edge_samples))


def zeroed(received: FrameArray, mask: BoolArray) -> FrameArray:
    """Return the frame with zeros where the mask is True.

    Examples
    --------
    >>> zeroed(np.array([[1j, 2j]]), np.array([[False, True]])).imag
    array([[1., 0.]])
    """
    return np.where(mask, received.dtype.type(0), received)


def blanked(received: FrameArray, mask: BoolArray, edge_samples: int = EDGE_SAMPLES) -> FrameArray:
    """Return the frame under weights that fall to zero towards flagged samples.

    Soft edges spread an object's energy less over the range axis than a gap with hard ones, and
    cost the samples that they attenuate.

    Examples
    --------
    >>> frame, mask = np.ones((1, 4), dtype=complex), np.array([[False, False, False, True]])
    >>> blanked(frame, mask, edge_samples=2).real.round(2)
    array([[1.  , 0.75, 0.25, 0.  ]])
    """
    distance = samples_to_flagged(mask)
    inside = np.minimum(distance, edge_samples + 1) / (edge_samples + 1)
    weights = np.sin(0.5 * np.pi * inside) ** 2
    return np.asarray((received * weights).astype(received.dtype))


def samples_to_flagged(mask: BoolArray) -> FloatArray:
    """(P, N) distance of every sample to the nearest flagged one of its ramp; infinite if none.

    Examples
    --------
    >>> samples_to_flagged(np.array([[True, False, False], [False, False, False]]))
    array([[ 0.,  1.,  2.],
           [inf, inf, inf]])
    """
    samples = np.arange(mask.shape[1], dtype=np.float64)
    before = np.maximum.accumulate(np.where(mask, samples, -np.inf), axis=1)
    after = np.minimum.accumulate(np.where(mask, samples, np.inf)[:, ::-1], axis=1)[:, ::-1]
    return np.asarray(np.minimum(samples - before, after - samples))


ENTRIES = (
    direct_entry(
        "zeroing", "Zeroing", 10, "Interfered samples become zero, as in most products.", zeroed
    ),
    time_domain_entry(
        "blanking",
        "Blanking",
        20,
        "Interfered samples become zero between raised-cosine edges.",
        blanking,
    ),
)
