"""Interferer timing fitted to the crossing times of its bursts.

Chirp j of an interferer with slope k_I and interval T_I reaches the mixer during the victim's ramp
i at the intermediate frequency ``f_I - f_0 + k_I (T_V i + t - T_I j - offset) - k t``. It is zero
at the crossing time

    t = drift i + step j + first,   drift = -k_I T_V / (k_I - k),   step = k_I T_I / (k_I - k).

This timing of an interferer has three unknowns. The drift tells k_I and the step then T_I, both in
the victim's clock and much more exactly than the bursts' own slopes do; these choose among the
drifts that differ by a whole step. The integers j follow by rounding.
"""

import math
from dataclasses import dataclass

import numpy as np
from scipy import fft

from vsep._typing import BoolArray, FloatArray, IntArray, frozen
from vsep.errors import InputError
from vsep.signal.radar import ChirpSequence, InterfererSequence

MIN_PERIOD_S, MAX_PERIOD_S = 5e-6, 2e-3  # of an interferer's chirps
SLOPE_ERROR = 0.01  # relative, of the median slope of the bursts
SLOPE_SPREAD = 0.1  # relative, within which bursts count as of one slope
NEAR_BEST = 0.7  # of the best agreement: what a place must reach to be refined
CANDIDATES = 12  # places refined, of the strongest and of those with the longest steps
REFINEMENTS = 12
START_SHARE = 0.02  # of a step, from the timing, within which a burst counts at first
GRID = 6  # points of the search per resolution cell
TOLERANCE = 2.0  # samples, and at least these
MIN_TOLERANCE = 0.1  # samples
DEVIATIONS = 5.0  # by which a burst may miss the timing in the end
MIN_BURSTS = 5
_AT_A_TIME = 256  # steps searched by one transform
# Bounds of the search: bursts that take part, steps times drifts, slopes shared without a timing,
# and how far from its ramp a burst may cross, in ramps' lengths.
_MAX_SEARCHED = 4096
_MAX_PLACES = 2**29
_MAX_UNFITTED = 8
_FARTHEST = 100.0
CHANCE = 1e-2  # timings expected to fit as many bursts by chance


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class Crossings:
    """Crossings of zero intermediate frequency by bursts."""

    ramps: IntArray  #: (B,) the victim's ramps i
    samples: FloatArray  #: (B,) crossing times t in samples after the ramp's first
    slopes_hz_per_s: FloatArray  #: (B,) slope of the interferer less that of the victim

    def __post_init__(self) -> None:
        """Freeze the arrays; they must be of one length and finite."""
        arrays = (self.ramps, self.samples, self.slopes_hz_per_s)
        if len({np.shape(array) for array in arrays}) != 1 or np.ndim(self.ramps) != 1:
            raise InputError("ramps, samples and slopes of crossings must be lists of one length.")
        if not all(np.all(np.isfinite(array)) for array in arrays):
            raise InputError("A crossing is NaN or infinite; all must be finite.")
        object.__setattr__(self, "ramps", frozen(np.array(self.ramps, dtype=np.int64)))
        for name in ("samples", "slopes_hz_per_s"):
            values = np.array(getattr(self, name), dtype=np.float64)
            object.__setattr__(self, name, frozen(values))

    @classmethod
    def of_chirps(
        cls,
        ramps: IntArray | FloatArray,
        start_frequencies_hz: FloatArray,
        slopes_hz_per_s: FloatArray,
        sample_rate_hz: float,
    ) -> "Crossings":
        """Crossings of bursts (B,) with these frequencies at their ramp's first sample.

        One without a slope crosses nothing and is left out.

        Examples
        --------
        >>> Crossings.of_chirps(np.array([0, 1]), np.array([-4e6, 1e6]), np.array([2e12, 0.0]),
        ...                     5e6).samples
        array([10.])
        """
        crossing = np.asarray(slopes_hz_per_s) != 0.0
        slopes = np.asarray(slopes_hz_per_s)[crossing]
        return cls(
            ramps=np.asarray(ramps, dtype=np.int64)[crossing],
            samples=-np.asarray(start_frequencies_hz)[crossing] / slopes * sample_rate_hz,
            slopes_hz_per_s=slopes,
        )

    def select(self, chosen: BoolArray) -> "Crossings":
        """Return the crossings that a (B,) mask chooses."""
        return Crossings(
            ramps=self.ramps[chosen],
            samples=self.samples[chosen],
            slopes_hz_per_s=self.slopes_hz_per_s[chosen],
        )


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class InterfererTiming:
    """One interferer as the victim sees it."""

    radar: ChirpSequence  #: the victim
    #: in samples, see the module
    drift: float
    step: float
    first: float
    crossings: Crossings  #: the bursts that lie on it
    chirps: IntArray  #: (B,) their integers j

    @property
    def slope_hz_per_s(self) -> float:
        """Slope k_I of the interferer."""
        period = self.radar.ramp_period_s * self.radar.sample_rate_hz
        return self.radar.slope_hz_per_s * self.drift / (self.drift + period)

    @property
    def ramp_period_s(self) -> float:
        """Interval T_I of its chirps in the victim's clock."""
        difference = self.slope_hz_per_s - self.radar.slope_hz_per_s
        return self.step * difference / self.slope_hz_per_s / self.radar.sample_rate_hz

    @property
    def residuals(self) -> FloatArray:
        """(B,) samples by which the bursts lie off the timing."""
        predicted = self.drift * self.crossings.ramps + self.step * self.chirps + self.first
        return np.asarray(self.crossings.samples - predicted)

    @property
    def median_residual(self) -> float:
        """Median of their magnitudes, samples."""
        return float(np.median(np.abs(self.residuals)))

    def predicted(self, margin: float = 0.0) -> Crossings:
        """Predicted crossings of all bursts, whether found or not.

        Parameters
        ----------
        margin : float
            Samples by which a crossing may lie outside of its ramp.

        Returns
        -------
        Crossings
            In the order of the ramps. The interferer need not be on all the time.
        """
        num_ramps, num_samples = self.radar.shape
        base = self.drift * np.arange(num_ramps) + self.first
        ends = np.array([-margin, num_samples - 1 + margin])[:, None]
        low, high = np.sort((ends - base) / self.step, axis=0)
        ramps, samples = [], []
        for ramp in range(num_ramps):
            chirps = np.arange(math.ceil(low[ramp]), math.floor(high[ramp]) + 1)
            ramps += [ramp] * len(chirps)
            samples += list(base[ramp] + self.step * chirps)
        slope = self.slope_hz_per_s - self.radar.slope_hz_per_s
        return Crossings(
            ramps=np.array(ramps, dtype=np.int64),
            samples=np.array(samples),
            slopes_hz_per_s=np.full(len(ramps), slope),
        )

    def explains(self, crossings: Crossings) -> BoolArray:
        """(B,) whether a burst is one of this timing, or what a fit left of one of them.

        That is any burst within the time for which the interferer sweeps across the sampled band,
        where this is short beside the step.
        """
        offsets = crossings.samples - self.drift * crossings.ramps - self.first
        distances = np.abs(offsets - self.step * np.round(offsets / self.step))
        difference = self.slope_hz_per_s - self.radar.slope_hz_per_s
        sweep = self.radar.sample_rate_hz**2 / abs(difference)
        own = float(np.abs(self.residuals).max())
        reach = max(sweep, own) if sweep < 0.25 * abs(self.step) else own
        return np.asarray(distances <= reach * (1.0 + 1e-9) + 1e-9)

    def sequence(self, *, ramp_duration_s: float | None = None) -> InterfererSequence:
        """Return an interferer for the simulator that makes the same crossings.

        Its start frequency is the victim's: only together with the time offset does it matter.

        Parameters
        ----------
        ramp_duration_s : float, optional
            While its chirp is on; all the time by default.
        """
        period = self.ramp_period_s
        rate = self.radar.sample_rate_hz
        chirp = self.slope_hz_per_s
        # The crossing of chirp 0 in ramp 0 tells the offset; chirps before that one count too.
        offset = self.first / rate * (chirp - self.radar.slope_hz_per_s) / chirp
        duration = self.radar.num_ramps * self.radar.ramp_period_s
        before = math.ceil((abs(offset) + duration) / period) + 2
        return InterfererSequence(
            start_frequency_hz=self.radar.start_frequency_hz,
            slope_hz_per_s=chirp,
            ramp_duration_s=period if ramp_duration_s is None else ramp_duration_s,
            ramp_period_s=period,
            num_ramps=2 * before + math.ceil(duration / period),
            time_offset_s=offset - before * period,
        )


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
        Those that hold more bursts than chance would explain; often one, or none.

    Raises
    ------
    InputError
        If the frame is too long to be searched.
    """
    timings: list[InterfererTiming] = []
    left = crossings.select(np.abs(crossings.samples) <= _FARTHEST * radar.num_samples)
    num_unfitted = 0
    while len(left.ramps) >= MIN_BURSTS and num_unfitted < _MAX_UNFITTED:
        group = _commonest_slope(left)
        if np.sum(group) < MIN_BURSTS:
            break  # no other slope is shared by more
        timing = _fit_one(left.select(group), radar)
        if timing is None:
            num_unfitted += 1
        else:
            timings.append(timing)
            group = timing.explains(left)
        left = left.select(~group)
    return tuple(timings)


def _commonest_slope(crossings: Crossings) -> BoolArray:
    """(B,) which bursts are of the slope that most of them share, within the spread."""
    slopes = crossings.slopes_hz_per_s
    reach = SLOPE_SPREAD * np.abs(slopes)
    in_order = np.sort(slopes)
    counts = np.searchsorted(in_order, slopes + reach, "right")
    counts -= np.searchsorted(in_order, slopes - reach, "left")
    commonest = np.argmax(counts)
    return np.asarray(np.abs(slopes - slopes[commonest]) <= reach[commonest])


def _fit_one(crossings: Crossings, radar: ChirpSequence) -> InterfererTiming | None:
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
        fitted = _refined(crossings, radar, drift, direction * step)
        # Far from where it began a fit shows the right bursts with other integers.
        if fitted is None or abs(fitted[0].drift - drift) > 2.0 * _drift_reach(radar, slope):
            continue
        timing, tolerance = fitted
        share = 2.0 * tolerance / abs(timing.step)
        chance = _chance(len(timing.chirps), len(crossings.ramps), share, trials)
        if chance < least:
            best, least = timing, chance
    return best


def _refined(
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
