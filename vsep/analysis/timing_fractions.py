"""Timings at whole fractions of the right interval, told by the interferer's chirps that they name.

At a fraction 1/k of the right step all bursts between two gaps belong to every k-th chirp. Of the
right step the remainders of the chirps' numbers change all the time.
"""

import math
from collections.abc import Iterator
from dataclasses import replace
from typing import Final

import numpy as np

from vsep._typing import IntArray
from vsep.analysis.crossings import InterfererTiming
from vsep.analysis.timing_search import MIN_BURSTS, refined

CERTAIN: Final = 0.9  # merit: nearly all predicted bursts are there
_LIKELY = 0.7  # merit from which a timing is kept although multiples explain a part of its bursts
_EXPLAINED = 0.75  # of the bursts, which multiples must explain
_MULTIPLES: Final = (2, 3, 5, 7, 11)
_GAPS: Final = ((20, 3), (12, 2), (0, 1))  # bursts from which on so many gaps would be seen
_SMOOTHED = 12  # bursts from which on a single remainder between two equal ones is a wrong burst
_NEAR = 2e-3  # relative, within which an interval is a whole multiple of another
_ONE_SLOPE = 0.1  # relative difference of slopes of one radar
_ALIKE = 1e-2  # within which two of one slope are one radar's, ...
_SAME = 1e-3  # ... and within which they agree


def whole_steps(timing: InterfererTiming) -> tuple[InterfererTiming, ...]:
    """Return a timing, or those at a multiple of its step that explain it by gaps.

    Parameters
    ----------
    timing : InterfererTiming
        As fitted.

    Returns
    -------
    tuple of InterfererTiming
        Empty where a multiple fits as well, but with too few bursts between gaps to tell.
    """
    if timing.merit >= CERTAIN:
        return (timing,)
    order = np.argsort(timing.crossings.ramps, kind="stable")
    most = next(gaps for count, gaps in _GAPS if len(order) >= count)
    for multiple in _MULTIPLES:
        changes = _changes(timing.chirps[order] % multiple)
        if len(changes) <= most:
            parts = tuple(_parts(timing, np.split(order, changes), multiple))
            explained = sum(len(part.chirps) for part in parts)
            if explained >= _EXPLAINED * len(order):
                return parts
            return (timing,) if timing.merit >= _LIKELY else ()
    return (timing,)


def consistent(timings: tuple[InterfererTiming, ...]) -> tuple[InterfererTiming, ...]:
    """Return timings without whole fractions of another one's interval, these fitted by it.

    Of intervals that nearly agree that of the most bursts counts.
    """
    found: list[InterfererTiming] = []

    def weight(one: InterfererTiming) -> float:
        alike = (each for each in timings if _ratio(one, each, 1.0) < _SAME)
        return sum(each.merit * len(each.chirps) for each in alike)

    for timing in sorted(timings, key=weight, reverse=True):
        better = next((each for each in found if _is_of(timing, each)), None)
        if better is None:
            # A longer interval takes the place of its fraction.
            shorter = [each for each in found if _is_of(each, timing)]
            found = [each for each in found if not _is_of(each, timing)]
            found += [timing, *(each for old in shorter for each in _again(old, timing))]
        else:
            found += _again(timing, better)
    return tuple(each for each in timings if each in found) + tuple(
        each for each in found if each not in timings
    )


def _ratio(one: InterfererTiming, other: InterfererTiming, whole: float) -> float:
    """How far the other's interval is from so many times that of one; infinite for other slopes."""
    if abs(one.slope_hz_per_s / other.slope_hz_per_s - 1.0) > _ONE_SLOPE:
        return math.inf
    return abs(other.ramp_period_s / one.ramp_period_s / whole - 1.0)


def _is_of(one: InterfererTiming, other: InterfererTiming) -> bool:
    """Whether one is a whole fraction of the other's interval, or nearly the same one."""
    whole = max(round(other.ramp_period_s / one.ramp_period_s), 1)
    if whole == 1:
        return _SAME <= _ratio(one, other, 1.0) < _ALIKE
    return _ratio(one, other, whole) < _NEAR


def _again(timing: InterfererTiming, better: InterfererTiming) -> Iterator[InterfererTiming]:
    fitted = refined(timing.crossings, timing.radar, better.drift, better.step)
    if fitted is not None and abs(fitted[0].ramp_period_s / better.ramp_period_s - 1.0) < _SAME:
        yield replace(fitted[0], part=timing.part)


def _changes(remainders: IntArray) -> IntArray:
    """Return where the remainders change along the ramps."""
    kept = remainders.copy()
    if len(kept) >= _SMOOTHED:
        alone = (remainders[1:-1] != remainders[:-2]) & (remainders[:-2] == remainders[2:])
        kept[1:-1][alone] = remainders[:-2][alone]
    return np.flatnonzero(np.diff(kept)) + 1


def _parts(
    timing: InterfererTiming, parts: list[IntArray], multiple: int
) -> Iterator[InterfererTiming]:
    """Yield a timing at a multiple of the step for each part of the frame."""
    low, high = timing.part or (0, timing.radar.num_ramps)
    starts = [int(timing.crossings.ramps[part[0]]) for part in parts[1:]]
    for part, first, last in zip(parts, [low, *starts], [*starts, high], strict=True):
        if len(part) < MIN_BURSTS:
            continue
        chosen = np.zeros(len(timing.chirps), dtype=bool)
        chosen[part] = True
        own = timing.crossings.select(chosen)
        fitted = refined(own, timing.radar, timing.drift, multiple * timing.step)
        if fitted is not None:
            yield replace(fitted[0], part=timing.part if len(parts) == 1 else (first, last))
