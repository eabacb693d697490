"""Runs of flagged samples along the ramp: bursts are contiguous, single samples are not bursts."""

import numpy as np
from scipy import ndimage

from vsep._typing import BoolArray
from vsep.mitigation.blanking import samples_to_flagged

_ALONG_RAMPS = np.array([[0, 0, 0], [1, 1, 1], [0, 0, 0]])


def grown(mask: BoolArray, reach: int) -> BoolArray:
    """Flag the `reach` samples beside every flagged one as well.

    Examples
    --------
    >>> grown(np.array([[False, False, False, True]]), 1)
    array([[False, False,  True,  True]])
    """
    return np.asarray(samples_to_flagged(mask) <= reach)


def closed(mask: BoolArray, gap: int) -> BoolArray:
    """Flag what lies between two flagged samples with at most `gap` others between them.

    Examples
    --------
    >>> closed(np.array([[True, False, False, True, False]]), 2)
    array([[ True,  True,  True,  True, False]])
    """
    samples = np.arange(mask.shape[1], dtype=np.float64)
    before = np.maximum.accumulate(np.where(mask, samples, -np.inf), axis=1)
    after = np.minimum.accumulate(np.where(mask, samples, np.inf)[:, ::-1], axis=1)[:, ::-1]
    return np.asarray(after - before <= gap + 1)


def extended(strong: BoolArray, weak: BoolArray) -> BoolArray:
    """Hysteresis: flag the runs of weak samples that hold a strong one.

    Examples
    --------
    >>> weak = np.array([[True, True, False, True]])
    >>> extended(np.array([[False, True, False, False]]), weak)
    array([[ True,  True, False, False]])
    """
    labels, _ = ndimage.label(weak | strong, structure=_ALONG_RAMPS)
    held = np.unique(labels[strong])
    return np.asarray(np.isin(labels, held) & (labels > 0))
