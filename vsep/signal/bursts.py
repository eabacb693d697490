"""Bursts of one interferer in the victim's ramps, (38)-(41), before scaling.

With T_0 = T_p p - T-bar - T_pI p_I the interferer's ramp p_I reaches the mixer of ramp p at the
intermediate frequency f(t') = f_I + k_I T_0 - f_0 + (k_I - k) t'. Two models follow:

- multiplicative, (41) and (7): chirp times channel H_I times Gbar(f(t')). Taking H_I out of the
  convolution lets every path cross the band at the same time, as if it had no excess delay; this
  is Assumption 2 of the paper, good while k_I times the delay is far below the cut-off.
- convolution, (40): chirp times H_I, oversampled, through the filter; every path crosses when it
  does. Either the interferer's ramp has no edges (Assumption 1), or it has.
"""

import math
from dataclasses import dataclass

import numpy as np
from scipy.fft import fft, fftfreq, ifft, next_fast_len

from vsep._typing import BoolArray, ComplexArray, FloatArray, IntArray
from vsep.errors import InputError
from vsep.signal.filters import AntiAliasingFilter
from vsep.signal.radar import ChirpSequence, InterfererSequence
from vsep.signal.scene import Interferer, TrueBurst

# A burst whose course stays beyond this multiple of the cut-off frequency is left out.
_REACH = 2.0
# Beyond this multiple an interferer that switches on or off leaves no click above -60 dB.
_CLICK_REACH = 64.0
_MIN_OVERSAMPLING = 8
_MAX_GRID = 2**22


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class Passages:
    """Pairs of a victim's and an interferer's ramp that overlap in time."""

    #: (B,) p and p_I
    ramps: IntArray
    interferer_ramps: IntArray
    #: (B,) T_0 of (39): age of the interferer's ramp at the first sample of the victim's
    offsets_s: FloatArray
    #: (B,) f_I + k_I T_0 - f_0, intermediate frequency at the first sample
    start_frequencies_hz: FloatArray
    slope_hz_per_s: float  #: k_I - k

    def select(self, chosen: BoolArray) -> "Passages":
        """Return the passages that a (B,) mask chooses."""
        return Passages(
            ramps=self.ramps[chosen],
            interferer_ramps=self.interferer_ramps[chosen],
            offsets_s=self.offsets_s[chosen],
            start_frequencies_hz=self.start_frequencies_hz[chosen],
            slope_hz_per_s=self.slope_hz_per_s,
        )

    def stay_inside(self, limit_hz: float, duration_s: float) -> tuple[FloatArray, FloatArray]:
        """(B,) first and last fast time with a course within +-limit; first > last if never."""
        slopes = np.full(len(self.ramps), self.slope_hz_per_s)
        return _times_inside(self.start_frequencies_hz, slopes, limit_hz, duration_s)


def overlapping_passages(radar: ChirpSequence, sequence: InterfererSequence) -> Passages:
    """Find the interferer's ramps that are on during the samples of each of the victim's ramps."""
    duration = radar.sample_times_s[-1]
    period = sequence.ramp_period_s
    start = radar.ramp_times_s - sequence.time_offset_s
    first = np.ceil((start - sequence.ramp_duration_s) / period).astype(np.int64)
    count = int((duration + sequence.ramp_duration_s) / period) + 1
    if radar.num_ramps * count > _MAX_GRID:
        raise InputError(
            f"interferer ramp_period_s is {period:g} s, which puts {count} of its ramps into one "
            f"of the victim's; it must be so long that {_MAX_GRID // radar.num_ramps} fit."
        )
    index = first[:, None] + np.arange(count)
    offset = start[:, None] - period * index
    overlaps = (offset >= -duration) & (offset <= sequence.ramp_duration_s)
    ramps, column = np.nonzero(overlaps & (index >= 0) & (index < sequence.num_ramps))
    offsets = offset[ramps, column]
    carriers = sequence.start_frequency_hz - radar.ramp_frequencies_hz[ramps]
    return Passages(
        ramps=ramps,
        interferer_ramps=index[ramps, column],
        offsets_s=offsets,
        start_frequencies_hz=carriers + sequence.slope_hz_per_s * offsets,
        slope_hz_per_s=sequence.slope_hz_per_s - radar.slope_hz_per_s,
    )


def crossings(
    radar: ChirpSequence, sequence: InterfererSequence, anti_aliasing_filter: AntiAliasingFilter
) -> Passages:
    """Find the passages that make a burst in the models that neglect the interferer's ramp edges.

    The interferer must be on in the middle of the time for which the course is within twice the
    cut-off frequency and within the ramp; without a filter that is the middle of the ramp.
    """
    passages = overlapping_passages(radar, sequence)
    slopes = np.full(len(passages.ramps), passages.slope_hz_per_s)
    cutoffs = np.full(len(slopes), anti_aliasing_filter.cutoff_hz)
    courses = passages.start_frequencies_hz, slopes
    return passages.select(
        cross_while_on(radar, sequence.ramp_duration_s, passages.offsets_s, courses, cutoffs)
    )


def cross_while_on(
    radar: ChirpSequence,
    ramp_duration_s: float,
    offsets_s: FloatArray,
    courses: tuple[FloatArray, FloatArray],
    cutoffs_hz: FloatArray,
) -> BoolArray:
    """Whether an interferer's ramps are on while they cross the band, see `crossings`.

    Parameters
    ----------
    radar : ChirpSequence
        The victim.
    ramp_duration_s : float
        Of the interferer.
    offsets_s : float array
        Age of the interferer's ramp at the first sample of the victim's.
    courses : tuple of two float arrays
        Intermediate frequencies at the first sample, and slopes, in Hz and Hz/s.
    cutoffs_hz : float array
        Half-amplitude frequencies of the filter. All arrays broadcast.
    """
    duration = float(radar.sample_times_s[-1])
    first, last = _times_inside(*courses, _REACH * cutoffs_hz, duration)
    age = np.where(first <= last, 0.5 * (first + last), math.inf) + offsets_s
    return np.asarray((age >= 0.0) & (age <= ramp_duration_s))


def _times_inside(
    start_hz: FloatArray, slope: FloatArray, limit_hz: FloatArray | float, duration_s: float
) -> tuple[FloatArray, FloatArray]:
    """First and last fast time of courses within +-limit; first > last if never."""
    parallel = slope == 0.0
    divisor = np.where(parallel, 1.0, slope)
    centre, half = -start_hz / divisor, limit_hz / np.abs(divisor)
    never = np.where(np.abs(start_hz) <= limit_hz, 0.0, math.inf)
    first = np.where(parallel, never, np.maximum(centre - half, 0.0))
    return first, np.where(parallel, duration_s, np.minimum(centre + half, duration_s))


def true_bursts(
    radar: ChirpSequence, sequence: InterfererSequence, anti_aliasing_filter: AntiAliasingFilter
) -> tuple[TrueBurst, ...]:
    """List the crossings of the pass band, up to the half-amplitude frequency, during a ramp."""
    passages = crossings(radar, sequence, anti_aliasing_filter)
    limit = anti_aliasing_filter.cutoff_hz
    first, last = passages.stay_inside(limit, radar.sample_times_s[-1])
    inside = passages.select(first <= last)
    return tuple(
        TrueBurst(
            ramp=int(ramp), start_frequency_hz=float(start), slope_hz_per_s=inside.slope_hz_per_s
        )
        for ramp, start in zip(inside.ramps, inside.start_frequencies_hz, strict=True)
    )


def multiplicative_bursts(
    radar: ChirpSequence, interferer: Interferer, anti_aliasing_filter: AntiAliasingFilter
) -> ComplexArray:
    """Interference of one interferer by (7) with (39) and (41), (P, N).

    Raises `InputError` if both radars have the same slope.
    """
    sequence = interferer.sequence
    if sequence.slope_hz_per_s == radar.slope_hz_per_s:
        raise InputError(
            f"The interferer's slope is {sequence.slope_hz_per_s:g} Hz/s, that of the victim; the "
            "multiplicative model needs another one, a convolution model takes any."
        )
    passages = crossings(radar, sequence, anti_aliasing_filter)
    time = radar.sample_times_s
    slope = passages.slope_hz_per_s
    start = passages.start_frequencies_hz[:, None]
    envelope = anti_aliasing_filter.modified_response(start + slope * time, slope)
    chirp = np.exp(2j * np.pi * (start * time + 0.5 * slope * time**2))
    signal = np.zeros(radar.shape, dtype=np.complex128)
    bursts = chirp * envelope * _channel(interferer, passages, time)
    np.add.at(signal, passages.ramps, bursts)
    return signal


def convolved_bursts(
    radar: ChirpSequence,
    interferer: Interferer,
    anti_aliasing_filter: AntiAliasingFilter,
    *,
    with_edges: bool,
) -> ComplexArray:
    """Interference of one interferer by the convolution (40), (P, N).

    Parameters
    ----------
    radar, interferer, anti_aliasing_filter
        The victim, the other radar with its channel, and the filter that shapes its bursts.
    with_edges : bool
        Whether the interferer switches on and off; if not, its ramps are thought to last.

    Returns
    -------
    (P, N) complex
    """
    sequence = interferer.sequence
    if with_edges:
        passages = overlapping_passages(radar, sequence)
        limit = _CLICK_REACH * anti_aliasing_filter.cutoff_hz
        first, last = passages.stay_inside(limit, radar.sample_times_s[-1])
        passages = passages.select(first <= last)
    else:
        passages = crossings(radar, sequence, anti_aliasing_filter)
    signal = np.zeros(radar.shape, dtype=np.complex128)
    for index in range(len(passages.ramps)):
        passage = passages.select(np.arange(len(passages.ramps)) == index)
        grid = _grid(radar, interferer, passage, anti_aliasing_filter.cutoff_hz)
        chirp = _tapered_chirp(grid, passage) * _channel(interferer, passage, grid.times_s)[0]
        if with_edges:
            age = grid.times_s + passage.offsets_s
            chirp *= _on(age, sequence.ramp_duration_s, 1.0 / grid.rate_hz)
        # Padding by twice the memory keeps what a slow filter rings from wrapping around.
        num_bins = next_fast_len(len(chirp) + math.ceil(2.0 * grid.memory_s * grid.rate_hz))
        frequency = fftfreq(num_bins, 1.0 / grid.rate_hz)
        filtered = ifft(fft(chirp, num_bins) * anti_aliasing_filter.response(frequency))
        samples = filtered[grid.first :: grid.oversampling][: radar.num_samples]
        signal[passage.ramps[0]] += samples
    return signal


def _channel(interferer: Interferer, passages: Passages, time_s: FloatArray) -> ComplexArray:
    """(B, N) channel H_I along the interferer's course, with the constant phase of (39)."""
    sequence, channel = interferer.sequence, interferer.channel
    offset = passages.offsets_s[:, None]
    frequency = sequence.start_frequency_hz + sequence.slope_hz_per_s * (time_s + offset)
    ramp_time = sequence.ramp_period_s * passages.interferer_ramps[:, None]
    response = np.zeros(frequency.shape, dtype=np.complex128)
    for delay, doppler, weight in zip(
        channel.delays_s, channel.dopplers_hz, channel.weights, strict=True
    ):
        cycles = frequency * delay + doppler * ramp_time
        response += weight * np.exp(-2j * np.pi * cycles)
    cycles = (sequence.start_frequency_hz + 0.5 * sequence.slope_hz_per_s * offset) * offset
    return np.asarray(response * np.exp(2j * np.pi * cycles))


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class _Grid:
    """Oversampled time axis of one burst with guard times before and after the ramp."""

    times_s: FloatArray
    oversampling: int
    rate_hz: float
    first: int
    memory_s: float
    ramp_s: float
    # The chirp is whole up to this frequency and gone at 1.5 times this frequency.
    edge_hz: float


def _grid(
    radar: ChirpSequence, interferer: Interferer, passage: Passages, cutoff_hz: float
) -> _Grid:
    """Choose rate and guard so that all which the filter can pass or remember is on the grid."""
    ramp_s = float(radar.sample_times_s[-1])
    start, slope = float(passage.start_frequencies_hz[0]), passage.slope_hz_per_s
    spread = abs(interferer.sequence.slope_hz_per_s) * np.abs(interferer.channel.delays_s).max(
        initial=0.0
    )
    cutoff = cutoff_hz if math.isfinite(cutoff_hz) else radar.sample_rate_hz
    swept = min(max(abs(start), abs(start + slope * ramp_s)), _CLICK_REACH * cutoff_hz)
    edge = max(swept, 4.0 * cutoff + math.sqrt(40.0 * abs(slope))) + spread
    oversampling = max(_MIN_OVERSAMPLING, math.ceil(3.3 * edge / radar.sample_rate_hz))
    rate = oversampling * radar.sample_rate_hz
    memory = max(2.0 * ramp_s, 64.0 / cutoff)
    middle = abs(start + 0.5 * slope * ramp_s)
    sweep = math.inf if slope == 0.0 else (1.5 * edge + middle) / abs(slope)
    guard = min(memory, max(sweep - 0.5 * ramp_s, 0.0))
    first = math.ceil(guard * rate / oversampling) * oversampling
    length = 2 * first + radar.num_samples * oversampling
    if length > _MAX_GRID:
        raise InputError(
            f"The interferer sweeps {abs(slope):g} Hz/s, which takes {length} points to convolve; "
            f"at most {_MAX_GRID} are allowed."
        )
    return _Grid(
        times_s=(np.arange(length) - first) / rate,
        oversampling=oversampling,
        rate_hz=rate,
        first=first,
        memory_s=memory,
        ramp_s=ramp_s,
        edge_hz=edge,
    )


def _tapered_chirp(grid: _Grid, passage: Passages) -> ComplexArray:
    """(M,) chirp that fades out far beyond the band and far before and after the ramp."""
    start, slope = passage.start_frequencies_hz[0], passage.slope_hz_per_s
    time = grid.times_s
    outside = np.maximum(-time, time - grid.ramp_s)
    fade = _smooth_step(3.0 - 2.0 * np.abs(start + slope * time) / grid.edge_hz)
    fade *= _smooth_step(2.0 - 2.0 * outside / grid.memory_s)
    return np.asarray(fade * np.exp(2j * np.pi * (start * time + 0.5 * slope * time**2)))


def _smooth_step(position: FloatArray) -> FloatArray:
    """From 0 to 1 over the unit interval, with three derivatives that vanish at both ends."""
    x = np.clip(position, 0.0, 1.0)
    return np.asarray(x**4 * (35.0 - 84.0 * x + 70.0 * x**2 - 20.0 * x**3))


def _on(age_s: FloatArray, duration_s: float, step_s: float) -> FloatArray:
    """Share of every grid cell during which the interferer's ramp is on, (3)."""
    rise = np.clip(age_s / step_s + 0.5, 0.0, 1.0)
    fall = np.clip((duration_s - age_s) / step_s + 0.5, 0.0, 1.0)
    return np.asarray(rise * fall)
