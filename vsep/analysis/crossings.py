"""Bursts by when they cross the band, and the timing of the interferer that they follow.

Chirp j of an interferer with slope k_I and interval T_I reaches the mixer during the victim's ramp
i at the intermediate frequency ``f_I - f_0 + k_I (T_V i + t - T_I j - offset) - k t``. It is zero
at the crossing time

    t = drift i + step j + first,   drift = -k_I T_V / (k_I - k),   step = k_I T_I / (k_I - k).
"""

import math
from dataclasses import dataclass

import numpy as np

from vsep._typing import BoolArray, FloatArray, IntArray, frozen
from vsep.errors import InputError
from vsep.signal.radar import ChirpSequence, InterfererSequence


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
    #: the ramps for which it holds, from the first to before the second; None for all
    part: tuple[int, int] | None = None

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

    @property
    def merit(self) -> float:
        """Share of the predicted bursts that were found, among ramps and samples of those found.

        One for an interferer that is on all the time and whose bursts are all found. A step that
        is a fraction of the right one predicts bursts that are not there.
        """
        own, predicted = self.crossings, self.predicted()
        last = self.radar.num_samples - 1
        # A chirp that sweeps less than the victim's crosses in a part of the ramp only.
        low, high = max(own.samples.min(), 0.0), min(own.samples.max(), last)
        found = int(np.sum((own.samples >= low) & (own.samples <= high)))
        expected = (predicted.samples >= low - 1.0) & (predicted.samples <= high + 1.0)
        expected &= (predicted.ramps >= own.ramps.min()) & (predicted.ramps <= own.ramps.max())
        count = int(np.sum(expected))
        return min(found / count, 1.0) if count else 0.0

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
        for ramp in range(*(self.part or (0, num_ramps))):
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
