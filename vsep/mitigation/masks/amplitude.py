"""Amplitude and difference thresholds with hysteresis, as sensor vendors find interference.

A burst is stronger than what is usual in the frame, or changes faster from sample to sample. Both
are compared with multiples of the frame's median: this sees bursts that rise above the objects,
and fails once half of the frame is interfered.
"""

import numpy as np

from vsep._typing import BoolArray
from vsep.mitigation.masks.runs import closed, extended
from vsep.mitigation.method import FrameArray

START = 4.0  # times the median: where a run of flagged samples may begin
EXTEND = 2.0  # times the median: how far it reaches
MAX_GAP = 4  # samples below the threshold inside a run: a burst passes through zero


def amplitude_mask(received: FrameArray) -> BoolArray:
    """Flag samples by their magnitude and by their difference from the sample before.

    `received` (P, N): the frame. Returns (P, N).

    Examples
    --------
    >>> frame = np.exp(0.1j * np.arange(40))[None]
    >>> frame[0, 10:20] *= 30.0
    >>> np.flatnonzero(amplitude_mask(frame)[0])
    array([10, 11, 12, 13, 14, 15, 16, 17, 18, 19])
    """
    magnitude = np.abs(received)
    steps = np.abs(np.diff(received, axis=1))
    # A step belongs to the larger of its two samples: what follows a burst is clean.
    larger = magnitude[:, 1:] >= magnitude[:, :-1]
    change = np.zeros_like(magnitude)
    change[:, 1:] = np.where(larger, steps, 0.0)
    change[:, :-1] = np.maximum(change[:, :-1], np.where(larger, 0.0, steps))
    usual, usual_step = np.median(magnitude), np.median(steps) if steps.size else 0.0

    def exceeding(factor: float) -> BoolArray:
        return np.asarray((magnitude > factor * usual) | (change > factor * usual_step))

    return extended(exceeding(START), closed(exceeding(EXTEND), MAX_GAP))
