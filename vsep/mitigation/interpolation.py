"""Linear interpolation of flagged samples, along the ramp or across the ramps."""

from functools import partial
from typing import Final

import numpy as np

from vsep._typing import BoolArray
from vsep.mitigation.direct import DirectMitigation, direct_entry
from vsep.mitigation.entry import time_domain_entry
from vsep.mitigation.method import FrameArray
from vsep.signal.dithered_atoms import RampDither

_TAPS: Final = 8  # samples that tell a value between two of them


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


def slow_time(dither: RampDither | None = None) -> DirectMitigation:
    """Make the interpolation across the ramps, which may be dithered."""
    return DirectMitigation("slow-time", partial(interpolated_across_ramps, dither=dither))


def interpolated_across_ramps(
    received: FrameArray, mask: BoolArray, dither: RampDither | None = None
) -> FrameArray:
    """Replace flagged samples by straight lines along the first axis, where a ramp is clean.

    It suits objects that move little from ramp to ramp, and bursts that fall on other samples in
    every ramp. What no clean ramp can tell is interpolated along the ramp. Dithered ramps are read
    where they sweep through the frequency of the sample, between their samples by `_TAPS` of
    them, and lines are over their true start times.

    Examples
    --------
    >>> frame, mask = np.array([[1j], [9j], [3j]]), np.array([[False], [True], [False]])
    >>> interpolated_across_ramps(frame, mask).imag.T
    array([[1., 2., 3.]])
    """
    if dither is not None:
        return _across_dithered_ramps(received, mask, dither)
    across = interpolated(received.T, mask.T).T
    hopeless = np.broadcast_to(mask.all(axis=0), mask.shape)
    return np.where(hopeless, interpolated(received, mask), across)


def _across_dithered_ramps(received: FrameArray, mask: BoolArray, dither: RampDither) -> FrameArray:
    repaired = interpolated(received, mask)
    num_ramps, num_samples = received.shape
    middle = dither.lowest_beat + 0.5  # of the beats, which are turned to zero in between
    resting = received * np.exp(2j * np.pi * middle * np.arange(num_samples))
    taps, times = np.arange(1 - _TAPS // 2, _TAPS // 2 + 1), dither.ramps
    for ramp in np.flatnonzero(mask.any(axis=1)):
        flagged = np.flatnonzero(mask[ramp])
        # Where each ramp (P, 1) sweeps through the same frequencies (F,), and samples around it
        places = flagged + (dither.samples[ramp] - dither.samples)[:, None]
        around = np.floor(places).astype(np.int64)[..., None] + taps
        inside = np.all((around >= 0) & (around < num_samples), axis=2)
        around = np.clip(around, 0, num_samples - 1)
        rows = np.arange(num_ramps)[:, None, None]
        apart = places[..., None] - around
        weights = np.sinc(apart) * np.cos(np.pi * apart / (_TAPS + 1)) ** 2
        read = np.sum(weights * resting[rows, around], axis=2)
        clean = inside & ~mask[rows, around].any(axis=2)
        turn = np.exp(-2j * np.pi * middle * flagged)
        for place, sample in enumerate(flagged):
            known = np.flatnonzero(clean[:, place])
            if len(known):
                # Start times may come in another order than the ramps.
                known = known[np.argsort(times[known])]
                line = np.interp(times[ramp], times[known], read[known, place])
                repaired[ramp, sample] = line * turn[place]
    return repaired


ENTRIES = (
    direct_entry(
        "linear",
        "Linear interpolation",
        30,
        "A straight line along the ramp over every gap.",
        interpolated,
    ),
    time_domain_entry(
        "slow-time",
        "Slow-time interpolation",
        50,
        "A straight line over every gap between the same samples of neighbouring ramps.",
        slow_time,
    ),
)
