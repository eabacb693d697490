"""Interferer timings fitted to the crossing times of bursts, see `vsep.analysis.crossings`.

A timing holds as long as neither radar pauses: where the frame, or the interferer's, has a gap, the
crossings go on with another first one. Whole fractions of the right step, too, fit bursts on both
sides of a gap; they predict many that are not there, so that a timing whose predicted bursts were
hardly ever found is no evidence.
"""

from dataclasses import replace
from typing import Final

import numpy as np

from vsep._typing import BoolArray
from vsep.analysis.crossings import Crossings, InterfererTiming
from vsep.analysis.timing_fractions import consistent, whole_steps
from vsep.analysis.timing_search import MIN_BURSTS, fit_one, refined
from vsep.signal.radar import ChirpSequence

SLOPE_SPREAD: Final = 0.1  # relative, within which bursts count as of one slope
MIN_MERIT: Final = 0.2
"""Share of its predicted bursts that must have been found for a timing to be reported."""

_GOOD_MERIT = 0.7  # from here on no gap is looked for
_BETTER = 1.5  # times the merit of the whole: what parts must have
_MOST_SPLIT = 512  # bursts among which gaps are looked for
_SAME_PERIOD = 1e-3  # relative, within which two radars are one
_DEEPEST = 3  # parts of parts
# Slopes shared without a timing, and how far from its ramp a burst may cross, in ramps' lengths.
_MAX_UNFITTED = 8
_FARTHEST = 100.0


def fit_interferer_timings(
    crossings: Crossings, radar: ChirpSequence
) -> tuple[InterfererTiming, ...]:
    """Fit a timing to bursts, then others to those that it does not explain.

    Parameters
    ----------
    crossings : Crossings
        Bursts of one or several interferers; some may be wrong, and many missing.
    radar : ChirpSequence
        The victim.

    Returns
    -------
    tuple of InterfererTiming
        Those that hold more bursts than chance would explain, and whose predicted bursts were
        found often enough; often one, or none: then there is not enough evidence. An interferer
        that goes on behind a gap has one for each part of the frame. Of a victim with dithered
        ramps none is fitted.

    Raises
    ------
    InputError
        If the frame is too long to be searched.
    """
    if radar.is_dithered:
        return ()
    timings: list[InterfererTiming] = []
    left = crossings.select(np.abs(crossings.samples) <= _FARTHEST * radar.num_samples)
    num_unfitted = 0
    while len(left.ramps) >= MIN_BURSTS and num_unfitted < _MAX_UNFITTED:
        group = _commonest_slope(left)
        if np.sum(group) < MIN_BURSTS:
            break  # no other slope is shared by more
        found = _fit_parts(left.select(group), radar)
        if found:
            timings += found
            group = np.logical_or.reduce([timing.explains(left) for timing in found])
        else:
            num_unfitted += 1
        left = left.select(~group)
    whole = tuple(each for timing in timings for each in whole_steps(timing))
    return _divided(list(consistent(whole)))


def _divided(timings: list[InterfererTiming]) -> tuple[InterfererTiming, ...]:
    """Return timings, those of one radar before and behind a gap each for its part alone."""
    found = list(timings)
    for number, one in enumerate(found):
        for place, other in enumerate(found):
            is_same = abs(other.ramp_period_s / one.ramp_period_s - 1.0) < _SAME_PERIOD
            start = int(other.crossings.ramps.min())
            if place == number or not is_same or one.crossings.ramps.max() >= start:
                continue
            low, high = found[number].part or (0, one.radar.num_ramps)
            found[number] = replace(one, part=(low, min(high, start)))
            low, high = found[place].part or (0, one.radar.num_ramps)
            found[place] = replace(other, part=(max(low, start), high))
    return tuple(found)


def _commonest_slope(crossings: Crossings) -> BoolArray:
    """(B,) which bursts are of the slope that most of them share, within the spread."""
    slopes = crossings.slopes_hz_per_s
    reach = SLOPE_SPREAD * np.abs(slopes)
    in_order = np.sort(slopes)
    counts = np.searchsorted(in_order, slopes + reach, "right")
    counts -= np.searchsorted(in_order, slopes - reach, "left")
    commonest = np.argmax(counts)
    return np.asarray(np.abs(slopes - slopes[commonest]) <= reach[commonest])


def _fit_parts(
    crossings: Crossings, radar: ChirpSequence, depth: int = _DEEPEST
) -> tuple[InterfererTiming, ...]:
    """Fit one timing to bursts of one slope, or one to each part of a frame with gaps."""
    whole = fit_one(crossings, radar)
    merit = 0.0 if whole is None else whole.merit
    if whole is not None and merit >= _GOOD_MERIT:
        return (whole,)
    if depth and 2 * MIN_BURSTS <= len(crossings.ramps) <= _MOST_SPLIT:
        parts = _parts(crossings, radar, depth - 1)
        least = min((part.merit for part in parts), default=0.0)
        if least >= max(MIN_MERIT, _BETTER * merit):
            return parts
    return () if whole is None or merit < MIN_MERIT else (whole,)


def _parts(crossings: Crossings, radar: ChirpSequence, depth: int) -> tuple[InterfererTiming, ...]:
    """Fit the bursts of one half, as far as they go on, and the others by themselves."""
    ramps = crossings.ramps
    order = np.argsort(np.argsort(ramps, kind="stable"))
    in_first = order < len(order) // 2
    halves = [
        (is_first, fit_one(crossings.select(in_first == is_first), radar))
        for is_first in (True, False)
    ]
    # A half with the gap in it is fitted worse than the other one.
    for is_first, timing in sorted(halves, key=lambda half: -(half[1].merit if half[1] else 0.0)):
        if timing is None or timing.merit < MIN_MERIT:
            continue
        from_end = order if is_first else len(order) - 1 - order
        goes_on = np.where(timing.explains(crossings), 1, -1)[np.argsort(from_end)]
        # As many explained and as few others as can be, from this end of the frame on.
        own = from_end <= int(np.argmax(np.cumsum(goes_on)))
        again = refined(crossings.select(own), radar, timing.drift, timing.step)
        part = timing if again is None else again[0]
        others = crossings.select(~own)
        rest = _fit_parts(others, radar, depth) if len(others.ramps) >= MIN_BURSTS else ()
        inside = ramps[own]
        ends = (0, int(inside.max()) + 1) if is_first else (int(inside.min()), radar.num_ramps)
        found = (replace(part, part=ends), *(_outside(each, ends, radar) for each in rest))
        return tuple(sorted(found, key=lambda each: each.part or (0, 0)))
    return ()


def _outside(
    timing: InterfererTiming, ends: tuple[int, int], radar: ChirpSequence
) -> InterfererTiming:
    """Return a timing that holds beside the ramps of another part."""
    low, high = timing.part or (0, radar.num_ramps)
    if ends[0] == 0:
        return replace(timing, part=(max(low, ends[1]), high))
    return replace(timing, part=(low, min(high, ends[0])))
