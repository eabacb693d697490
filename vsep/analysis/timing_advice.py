"""Settings of this radar's ramps that let the fewest bursts of another radar in.

The other radar's chirp reaches the mixer at the intermediate frequency
``f_0 - f_I - k_I u + (k - k_I) t`` at the time t of a ramp that starts u after the chirp. It is in
the sampled band while this is at most half the sample rate. Both radars' clocks run freely, so that
everything is the mean over the time offset between them, and the worst of it.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from vsep._typing import FloatArray
from vsep._validation import require_range
from vsep.analysis.crossings import InterfererTiming
from vsep.errors import InputError
from vsep.signal.radar import ChirpSequence

NUM_OFFSETS: Final = 64
MOST_CANDIDATES: Final = 20_000
_MOST_CHIRPS = 4096  # of the other radar that overlap one ramp


@dataclass(frozen=True, kw_only=True, slots=True)
class OtherRadar:
    """Timing of another radar.

    Parameters
    ----------
    slope_hz_per_s : float
        Of its chirps.
    ramp_period_s : float
        From one chirp to the next.
    start_frequency_hz : float, optional
        Of its chirps; where it is not known the middle of its sweep is taken for that of this
        radar's, the worst case.
    ramp_duration_s : float, optional
        While its chirp is on; all the time by default.

    Raises
    ------
    InputError
        If a value is out of its range.
    """

    slope_hz_per_s: float
    ramp_period_s: float
    start_frequency_hz: float | None = None
    ramp_duration_s: float | None = None

    def __post_init__(self) -> None:
        """Check the times."""
        require_range("ramp_period_s", self.ramp_period_s, 1e-7, 1.0, "s")
        if self.ramp_duration_s is not None:
            require_range("ramp_duration_s", self.ramp_duration_s, 1e-9, self.ramp_period_s, "s")

    @classmethod
    def of_timing(cls, timing: InterfererTiming) -> "OtherRadar":
        """Return the radar that a timing tells; its frequency and duration are not known."""
        return cls(slope_hz_per_s=timing.slope_hz_per_s, ramp_period_s=timing.ramp_period_s)


@dataclass(frozen=True, kw_only=True, slots=True)
class Exposure:
    """What a setting of this radar's ramps lets in."""

    radar: ChirpSequence  #: this radar, as it would be
    sample_share: float  #: of the samples that are hit, the mean over the offset
    ramp_share: float  #: of the ramps that are hit, the mean over the offset
    worst_ramp_share: float  #: at the worst offset


def exposure(
    radar: ChirpSequence, others: Sequence[OtherRadar], num_offsets: int = NUM_OFFSETS
) -> Exposure:
    """Compute what this radar would receive of others.

    Parameters
    ----------
    radar : ChirpSequence
        This radar.
    others : sequence of OtherRadar
        Their offsets are independent of each other.
    num_offsets : int
        Offsets of each over which means are taken.
    """
    clean_ramps, clean_worst, clean_samples = 1.0, 1.0, 1.0
    for other in others:
        lengths = _lengths_s(radar, other, num_offsets)
        hit = (lengths > 0.0).any(axis=2)
        sampled_s = radar.num_samples / radar.sample_rate_hz
        share = float(np.mean(np.minimum(lengths.sum(axis=2), sampled_s))) / sampled_s
        clean_ramps *= 1.0 - float(hit.mean())
        clean_worst *= 1.0 - float(hit.mean(axis=1).max())
        clean_samples *= 1.0 - share
    return Exposure(
        radar=radar,
        sample_share=1.0 - clean_samples,
        ramp_share=1.0 - clean_ramps,
        worst_ramp_share=1.0 - clean_worst,
    )


def exposures(
    radar: ChirpSequence,
    others: Sequence[OtherRadar],
    *,
    slopes_hz_per_s: Sequence[float],
    ramp_periods_s: Sequence[float],
    start_frequencies_hz: Sequence[float],
) -> Iterator[Exposure]:
    """Compute the exposure of every combination; ramps longer than their period are left out.

    Parameters
    ----------
    radar : ChirpSequence
        This radar; the number of samples stays, so that the slope also changes the range cell.
    others : sequence of OtherRadar
        The other radars.
    slopes_hz_per_s, ramp_periods_s, start_frequencies_hz : sequence of float
        What is tried: the idle time is a part of the period.

    Raises
    ------
    InputError
        If there are too many combinations.
    """
    count = len(slopes_hz_per_s) * len(ramp_periods_s) * len(start_frequencies_hz)
    if count > MOST_CANDIDATES:
        raise InputError(f"{count} settings are to be tried; at most {MOST_CANDIDATES} are.")
    sampled_s = radar.num_samples / radar.sample_rate_hz
    for start in start_frequencies_hz:
        for slope in slopes_hz_per_s:
            for period in ramp_periods_s:
                if period >= sampled_s and slope != 0.0:
                    changed = replace(
                        radar,
                        start_frequency_hz=start,
                        slope_hz_per_s=slope,
                        ramp_period_s=period,
                        lowest_beat=-0.5,
                    )
                    yield exposure(changed, others)


def _lengths_s(radar: ChirpSequence, other: OtherRadar, num_offsets: int) -> FloatArray:
    """Return the times (offsets, ramps, chirps) for which a chirp is in the band of a ramp."""
    sampled_s = radar.num_samples / radar.sample_rate_hz
    period, slope = other.ramp_period_s, other.slope_hz_per_s
    on_s = period if other.ramp_duration_s is None else other.ramp_duration_s
    start_hz = other.start_frequency_hz
    if start_hz is None:
        middle_hz = radar.start_frequency_hz + 0.5 * radar.slope_hz_per_s * sampled_s
        start_hz = middle_hz - 0.5 * slope * on_s
    chirps = np.arange(-int(np.ceil(sampled_s / period)), 1)
    if len(chirps) > _MOST_CHIRPS:
        raise InputError(
            f"{len(chirps)} chirps of the other radar overlap a ramp; at most {_MOST_CHIRPS} may."
        )
    offsets = period * np.arange(num_offsets) / num_offsets
    starts = radar.ramp_period_s * np.arange(radar.num_ramps)
    since = np.mod(starts - offsets[:, None], period)[..., None] + period * chirps
    at_zero_hz = radar.start_frequency_hz - start_hz - slope * since
    difference = radar.slope_hz_per_s - slope
    half_band = 0.5 * radar.sample_rate_hz
    low, high = np.maximum(0.0, -since), np.minimum(sampled_s, on_s - since)
    if difference == 0.0:
        return np.asarray(
            np.where(np.abs(at_zero_hz) < half_band, np.maximum(high - low, 0.0), 0.0)
        )
    crossing = -at_zero_hz / difference
    reach = half_band / abs(difference)
    low, high = np.maximum(low, crossing - reach), np.minimum(high, crossing + reach)
    return np.asarray(np.maximum(high - low, 0.0))
