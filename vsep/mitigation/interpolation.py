"""Linear interpolation of flagged samples, along the ramp or across the ramps."""

import numpy as np

from vsep._typing import BoolArray
from vsep.mitigation.direct import direct_entry
from vsep.mitigation.method import FrameArray


def interpolated(received: FrameArray, mask: BoolArray) -> FrameArray:
    """Replace flagged samples by straight lines along the last axis.

    Before the first and after the last clean sample of a ramp its value is held; a ramp without a
    clean sample becomes zero.

    Examples
    --------
    >>> frame, mask = np.array([[1j, 9j, 3j, 9j]]), np.array([[False, True, False, True]])
    >>> interpolated(frame, mask).imag
    array([[1., 2., 3., 3.]])
    """
    repaired = np.where(mask, received.dtype.type(0), received)
    samples = np.arange(received.shape[1])
    for ramp in np.flatnonzero(mask.any(axis=1) & ~mask.all(axis=1)):
        clean, flagged = np.flatnonzero(~mask[ramp]), np.flatnonzero(mask[ramp])
        repaired[ramp, flagged] = np.interp(samples[flagged], clean, received[ramp, clean])
    return repaired


def interpolated_across_ramps(received: FrameArray, mask: BoolArray) -> FrameArray:
    """Replace flagged samples by straight lines along the first axis, where a ramp is clean.

    It suits objects that move little from ramp to ramp, and bursts that fall on other samples in
    every ramp. What no clean ramp can tell is interpolated along the ramp.

    Examples
    --------
    >>> frame, mask = np.array([[1j], [9j], [3j]]), np.array([[False], [True], [False]])
    >>> interpolated_across_ramps(frame, mask).imag.T
    array([[1., 2., 3.]])
    """
    across = interpolated(received.T, mask.T).T
    hopeless = np.broadcast_to(mask.all(axis=0), mask.shape)
    return np.where(hopeless, interpolated(received, mask), across)


ENTRIES = (
    direct_entry(
        "linear",
        "Linear interpolation",
        30,
        "A straight line along the ramp over every gap.",
        interpolated,
    ),
    direct_entry(
        "slow-time",
        "Slow-time interpolation",
        50,
        "A straight line over every gap between the same samples of neighbouring ramps.",
        interpolated_across_ramps,
    ),
)
