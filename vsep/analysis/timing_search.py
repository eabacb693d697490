"""Search for the timing that most bursts of one slope follow.

The drift tells k_I and the step then T_I, both in the victim's clock and much more exactly than the
bursts' own slopes do; these choose among the drifts that differ by a whole step. The integers j
follow by rounding.
"""

import math
from typing import Final

import numpy as np
from scipy import fft

from vsep._typing import FloatArray, frozen
from vsep.analysis.crossings import Crossings, InterfererTiming
from vsep.errors import InputError
from vsep.signal.radar import ChirpSequence

MIN_PERIOD_S, MAX_PERIOD_S = 5e-6, 2e-3  # of an interferer's chirps
SLOPE_ERROR = 0.01  # relative, of the median slope of the bursts
NEAR_BEST = 0.7  # of the best agreement: what a place must reach to be refined
CANDIDATES = 12  # places refined, of the strongest and of those with the longest steps
REFINEMENTS = 12
START_SHARE = 0.02  # of a step, from the timing, within which a burst counts at first
GRID = 6  # points of the search per resolution cell
TOLERANCE = 2.0  # samples, and at least these
MIN_TOLERANCE = 0.1  # samples
DEVIATIONS = 5.0  # by which a burst may miss the timing in the end
MIN_BURSTS: Final = 5
_AT_A_TIME = 256  # steps searched by one transform
# Bounds of the search: bursts that take part, steps times drifts.
_MAX_SEARCHED = 4096
_MAX_PLACES = 2**29
CHANCE = 1e-2  # timings expected to fit as many bursts by chance


def fit_one(crossings: Crossings, radar: ChirpSequence) -> InterfererTiming | None:
    """Fit the timing that most bursts of one slope follow; None if it may be chance."""
    if len(crossings.ramps) < MIN_BURSTS:
        return None
    slope = float(np.median(crossings.slopes_hz_per_s))
    interferer_slope = radar.slope_hz_per_s + slope
    if slope == 0.0 or interferer_slope == 0.0:
        return None
    direction = math.copysign(1.0, interferer_slope / slope)
    places, trials = _search(crossings, radar, slope)
    best, least = None, math.log(CHANCE)
    for drift, step in places:
        fitted = refined(crossings, radar, drift, direction * step)
        # Far from where it began a fit shows the right bursts with other integers.
        if fitted is None or abs(fitted[0].drift - drift) > 2.0 * _drift_reach(radar, slope):
            continue
        timing, tolerance = fitted
        share = 2.0 * tolerance / abs(timing.step)
        chance = _chance(len(timing.chirps), len(crossings.ramps), share, trials)
        if chance < least:
            best, least = timing, chance
    return best


def refined(
    crossings: Crossings, radar: ChirpSequence, drift: float, step: float
) -> tuple[InterfererTiming, float] | None:
    """Least squares on the bursts that lie close enough; closer and closer ones count."""
    cycles = (crossings.samples - drift * crossings.ramps) / step
    first = step * float(np.angle(np.sum(np.exp(2j * np.pi * cycles)))) / (2.0 * np.pi)
    tolerance = max(TOLERANCE, START_SHARE * abs(step))
    chosen = np.ones(len(cycles), dtype=bool)
    chirps = np.zeros(len(cycles))
    for _ in range(REFINEMENTS):
        offset = crossings.samples - drift * crossings.ramps - first
        chirps = np.round(offset / step)
        residuals = offset - step * chirps
        chosen = np.abs(residuals) <= tolerance
        columns = np.stack([crossings.ramps, chirps, np.ones_like(chirps)], axis=1)
        solution, _, rank, _ = np.linalg.lstsq(columns[chosen], crossings.samples[chosen])
        if np.sum(chosen) < MIN_BURSTS or rank < columns.shape[1]:
            return None
        drift, step, first = (float(value) for value in solution)
        deviation = 1.4826 * float(np.median(np.abs(residuals[chosen])))
        tolerance = min(tolerance, max(DEVIATIONS * deviation, MIN_TOLERANCE))
    timing = InterfererTiming(
        radar=radar,
        drift=drift,
        step=step,
        first=first,
        crossings=crossings.select(chosen),
        chirps=frozen(chirps[chosen].astype(np.int64)),
    )
    return timing, tolerance


def _search(
    crossings: Crossings, radar: ChirpSequence, slope: float
) -> tuple[list[tuple[float, float]], int]:
    """Search drift and magnitude of the step; the best places, and how many were tried.

    A timing turns the crossings into equal phases ``(t - drift i) / step``. Whole fractions of the
    right step do so as well, so that places with a long step are among the best.
    """
    step_over = -(-len(crossings.ramps) // _MAX_SEARCHED)
    crossings = crossings.select(np.arange(len(crossings.ramps)) % step_over == 0)
    rate, ramps = radar.sample_rate_hz, crossings.ramps
    period = radar.ramp_period_s * rate
    ratio = (radar.slope_hz_per_s + slope) / slope
    middle = -ratio * period
    reach = _drift_reach(radar, slope)
    extent = float(np.ptp(crossings.samples - middle * ramps)) + 1.0
    shortest = max(abs(ratio) * MIN_PERIOD_S * rate, 2.0 * TOLERANCE)
    longest = min(abs(ratio) * MAX_PERIOD_S * rate, extent / 2.0)
    num_steps = GRID * extent * max(0.0, 1.0 / shortest - 1.0 / longest)
    if num_steps * GRID * (np.ptp(ramps) + 1.0) > _MAX_PLACES:
        duration_s = radar.num_ramps * radar.ramp_period_s
        raise InputError(
            f"The frame has {radar.num_ramps} ramps and lasts {duration_s:g} s, which is too long "
            "to search for the timing of interferers; give a part of it."
        )
    inverse_steps = np.arange(1.0 / longest, 1.0 / shortest, 1.0 / (GRID * extent))
    if len(inverse_steps) < 3:
        return [], 0
    agreement, drifts = np.zeros((2, len(inverse_steps)))
    trials = 0
    for first in range(0, len(inverse_steps), _AT_A_TIME):
        part = slice(first, first + _AT_A_TIME)
        tried = _best_drifts(crossings, inverse_steps[part], middle, reach)
        agreement[part], drifts[part], count = tried
        trials += count
    before, after = (np.append(agreement[1:], 0.0), np.append(0.0, agreement[:-1]))
    peaks = np.flatnonzero((agreement >= before) & (agreement >= after))
    peaks = peaks[agreement[peaks] >= NEAR_BEST * agreement.max()]
    # Their order is that of decreasing steps.
    strongest = peaks[np.argsort(-agreement[peaks])[:CANDIDATES]]
    places = {*peaks[:CANDIDATES].tolist(), *strongest.tolist()}
    return [(float(drifts[p]), float(1.0 / inverse_steps[p])) for p in sorted(places)], trials


def _drift_reach(radar: ChirpSequence, slope: float) -> float:
    """Return by how many samples the drift may miss that of the bursts' median slope."""
    period = radar.ramp_period_s * radar.sample_rate_hz
    return SLOPE_ERROR * abs(radar.slope_hz_per_s / slope) * period


def _best_drifts(
    crossings: Crossings, inverse_steps: FloatArray, middle: float, reach: float
) -> tuple[FloatArray, FloatArray, int]:
    """Best agreement and drift of every step, and how many drifts were tried.

    The sum of ``exp(j 2 pi (t - drift i) / step)`` over the bursts is a Fourier transform over the
    ramps i; its bins are drifts over a step, up to whole ones.
    """
    ramps, owners = np.unique(crossings.ramps, return_inverse=True)
    sums = np.zeros((len(inverse_steps), int(np.ptp(ramps)) + 1), dtype=np.complex128)
    order = np.argsort(owners, kind="stable")
    cis = np.exp(2j * np.pi * inverse_steps[:, None] * crossings.samples[order])
    starts = np.searchsorted(owners[order], np.arange(len(ramps)))
    sums[:, ramps - ramps[0]] = np.add.reduceat(cis, starts, axis=1)
    num_bins = fft.next_fast_len(GRID * sums.shape[1])
    found = np.abs(fft.fft(sums, num_bins, axis=1)) / len(crossings.ramps)
    away = np.arange(num_bins) / num_bins - (middle * inverse_steps)[:, None]
    away -= np.round(away)
    # One bin more than the reach, so that there is one at least.
    inside = np.abs(away) <= reach * inverse_steps[:, None] + 1.0 / num_bins
    best = np.argmax(np.where(inside, found, 0.0), axis=1)
    rows = np.arange(len(inverse_steps))
    drifts = middle + away[rows, best] / inverse_steps
    return found[rows, best], drifts, int(np.sum(inside))


def _chance(fitted: int, total: int, share: float, trials: int) -> float:
    """Log of the timings expected to hold as many of bursts that lie anywhere; 3 always fit."""
    choices = math.lgamma(total + 1) - math.lgamma(fitted + 1) - math.lgamma(total - fitted + 1)
    return math.log(trials) + choices + (fitted - 3) * math.log(min(share, 1.0))
