"""Interferers by what they send: sequences of unequal chirps, and waveforms that are no chirps.

A sequence of unequal chirps is a sequence of one ramp for every chirp. Of the others the victim
mixes its own chirp with a signal that keeps to its band: at the intermediate frequency it is noise
for as long as the victim sweeps through that band,

    x(t') = sum_l h_l E(t' + T_0 - tau_l) e^(-j pi k t'^2),

with the complex envelope E about f_0, the age T_0 of (39) and the paths of the channel; x passes
the anti-aliasing filter on an oversampled grid.
"""

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Final

import numpy as np
from scipy import fft

from vsep._typing import ComplexArray, FloatArray
from vsep.signal.bursts import Passages, crossings
from vsep.signal.filters import AntiAliasingFilter
from vsep.signal.radar import ChirpSequence
from vsep.signal.scene import Interferer

Envelope = Callable[[FloatArray], ComplexArray]

UNEQUAL_CHIRPS: Final = ("hopping-chirps", "up-and-down-chirps", "two-profiles")
NO_CHIRPS: Final = ("stepped", "phase-coded", "ofdm")
HOP: Final = 0.4  # of a ramp: by how much starts that hop move the crossing at most
SECOND_PROFILE: Final = 2.0  # times the slope difference of the first
SUPPORT: Final = 0.25  # of a ramp, in which the victim sweeps through the bandwidth of a code
STEP_BANDS: Final = 8.0  # pass bands that the victim sweeps through during a frequency step
CODE_CHIPS: Final = 1023  # of a phase code, which repeats
OFDM_SYMBOLS: Final = 64  # of a pattern of symbols, which repeats
OFDM_CARRIERS: Final = 128
MEMORY: Final = 16.0  # of the filter, in 1/cutoff
REACH: Final = 1.5  # bandwidths on either side of the carrier, beyond which a code has faded out


def chirp_parts(
    radar: ChirpSequence, interferer: Interferer, anti_aliasing_filter: AntiAliasingFilter
) -> tuple[Interferer, ...]:
    """Interferers of equal chirps that together send what one sends; none if it sends no chirps.

    Parameters
    ----------
    radar : ChirpSequence
        The victim.
    interferer : Interferer
        Up and down chirps, and those of two profiles, take turns and have the same frequency where
        the first of them crosses the band. Starts that hop are uniform, so that the crossing moves
        by up to `HOP` of a ramp.
    anti_aliasing_filter : AntiAliasingFilter
        Says what a crossing is.

    Returns
    -------
    tuple of Interferer
    """
    if interferer.waveform not in UNEQUAL_CHIRPS:
        return () if interferer.waveform in NO_CHIRPS else (interferer,)
    own, channel = interferer.sequence, interferer.channel
    difference = own.slope_hz_per_s - radar.slope_hz_per_s
    age_s = 0.5 * own.ramp_duration_s
    passages = crossings(radar, own, anti_aliasing_filter)
    if len(passages.ramps):
        age_s = float(passages.offsets_s[0]) + _crossing_s(passages)
    rng = np.random.default_rng(interferer.seed)
    hops_s = rng.uniform(-HOP, HOP, own.num_ramps) * radar.num_samples / radar.sample_rate_hz
    parts = []
    for index in range(own.num_ramps):
        slope, hop_hz = own.slope_hz_per_s, 0.0
        if interferer.waveform == "hopping-chirps":
            hop_hz = -difference * float(hops_s[index])
        elif index % 2 and interferer.waveform == "up-and-down-chirps":
            slope = -slope
        elif index % 2:
            slope = radar.slope_hz_per_s + SECOND_PROFILE * difference
        late_s = own.ramp_period_s * index
        sequence = replace(
            own,
            start_frequency_hz=own.start_frequency_hz
            + (own.slope_hz_per_s - slope) * age_s
            + hop_hz,
            slope_hz_per_s=slope,
            num_ramps=1,
            time_offset_s=own.time_offset_s + late_s,
        )
        turned = channel.weights * np.exp(-2j * np.pi * channel.dopplers_hz * late_s)
        parts.append(Interferer(sequence=sequence, channel=replace(channel, weights=turned)))
    return tuple(parts)


def noise_like_signal(
    radar: ChirpSequence, interferer: Interferer, anti_aliasing_filter: AntiAliasingFilter
) -> ComplexArray:
    """Interference of one interferer that sends no chirps, (P, N).

    It is on while the ramps of its sequence are, and its band lies where the first of them would
    cross that of the victim. A phase code has a chip rate, OFDM a bandwidth of `SUPPORT` of what
    the victim sweeps through in a ramp; a stepped carrier follows the slope of the sequence and
    begins every step with a phase of its own.
    """
    signal = np.zeros(radar.shape, dtype=np.complex128)
    passages = crossings(radar, interferer.sequence, anti_aliasing_filter)
    if len(passages.ramps) == 0:
        return signal
    cutoff_hz = min(anti_aliasing_filter.cutoff_hz, radar.sample_rate_hz)
    steepness, ramp_s = abs(radar.slope_hz_per_s), radar.num_samples / radar.sample_rate_hz
    bandwidth_hz = SUPPORT * steepness * ramp_s
    if interferer.waveform == "stepped":
        bandwidth_hz = STEP_BANDS * 2.0 * cutoff_hz
    reach_hz = REACH * bandwidth_hz + 4.0 * cutoff_hz
    oversampling = math.ceil(3.3 * reach_hz / radar.sample_rate_hz)
    rate_hz = oversampling * radar.sample_rate_hz
    guard = math.ceil(MEMORY * radar.sample_rate_hz / cutoff_hz) * oversampling
    time = (np.arange(guard + radar.num_samples * oversampling) - guard) / rate_hz
    num_bins = fft.next_fast_len(len(time) + guard)
    response = anti_aliasing_filter.response(fft.fftfreq(num_bins, 1.0 / rate_hz))
    envelope = _envelope(radar, interferer, passages, bandwidth_hz, rate_hz)
    starts_hz = radar.ramp_frequencies_hz
    for index, ramp in enumerate(passages.ramps):
        age = time + passages.offsets_s[index]
        # The ramp starts that much higher than the first one that is interfered.
        late_hz = starts_hz[ramp] - starts_hz[passages.ramps[0]]
        if interferer.waveform == "stepped":
            line_hz = passages.start_frequencies_hz[index] + passages.slope_hz_per_s * time
        else:
            line_hz = radar.slope_hz_per_s * (_crossing_s(passages) - time) - late_hz
        near = np.clip(3.0 * (1.0 - np.abs(line_hz) / reach_hz), 0.0, 1.0)
        near *= (age >= 0.0) & (age <= interferer.sequence.ramp_duration_s)
        mixed = near * np.exp(-1j * np.pi * radar.slope_hz_per_s * time**2)
        if radar.start_frequencies_hz:
            offset_hz = starts_hz[ramp] - radar.start_frequency_hz
            mixed *= np.exp(-2j * np.pi * offset_hz * time)
        mixed *= _through_channel(interferer, envelope, age, radar.start_frequency_hz)
        filtered = fft.ifft(fft.fft(mixed, num_bins) * response)
        signal[ramp] += filtered[guard : len(time) : oversampling]
    return signal


def _crossing_s(passages: Passages) -> float:
    """Fast time at which the first passage crosses the middle of the band."""
    slope = passages.slope_hz_per_s
    return 0.0 if slope == 0.0 else -float(passages.start_frequencies_hz[0]) / slope


def _through_channel(
    interferer: Interferer, envelope: Envelope, age: FloatArray, carrier_hz: float
) -> ComplexArray:
    """Sum over the paths, each later by its delay."""
    channel, total = interferer.channel, np.zeros(len(age), dtype=np.complex128)
    for delay, weight in zip(channel.delays_s, channel.weights, strict=True):
        turned = weight * np.exp(-2j * np.pi * ((carrier_hz * delay) % 1.0))
        total += turned * envelope(age - delay)
    return total


def _envelope(
    radar: ChirpSequence,
    interferer: Interferer,
    passages: Passages,
    bandwidth_hz: float,
    rate_hz: float,
) -> Envelope:
    """E as a function of the age of the interferer's ramp."""
    rng = np.random.default_rng(interferer.seed)
    own = interferer.sequence
    if interferer.waveform == "stepped":
        step_s = bandwidth_hz / abs(radar.slope_hz_per_s)
        first_hz = own.start_frequency_hz - radar.start_frequency_hz
        phases = rng.uniform(0.0, 1.0, CODE_CHIPS)

        def stepped(age: FloatArray) -> ComplexArray:
            number = np.floor(age / step_s)
            frequency = first_hz + own.slope_hz_per_s * step_s * (number + 0.5)
            cycles = frequency * (age - number * step_s)
            cycles += phases[number.astype(np.int64) % CODE_CHIPS]
            return np.asarray(np.exp(2j * np.pi * cycles))

        return stepped
    if interferer.waveform == "phase-coded":
        table = _phase_code(bandwidth_hz, rate_hz, rng)
    else:
        table = _ofdm(bandwidth_hz, rate_hz, rng)
    first_hz = float(radar.ramp_frequencies_hz[passages.ramps[0]]) - radar.start_frequency_hz
    carrier_hz = radar.slope_hz_per_s * _crossing_s(passages) + first_hz

    def coded(age: FloatArray) -> ComplexArray:
        place = np.rint(age * rate_hz).astype(np.int64) % len(table)
        return np.asarray(table[place] * np.exp(2j * np.pi * carrier_hz * age))

    return coded


def _phase_code(chip_rate_hz: float, rate_hz: float, rng: np.random.Generator) -> ComplexArray:
    """One period of a random binary phase code, at a sample rate."""
    chips = rng.choice([-1.0, 1.0], CODE_CHIPS)
    size = round(CODE_CHIPS * rate_hz / chip_rate_hz)
    chosen = np.minimum(np.arange(size) * chip_rate_hz / rate_hz, CODE_CHIPS - 1).astype(np.int64)
    return np.asarray(chips[chosen], dtype=np.complex128)


def _ofdm(bandwidth_hz: float, rate_hz: float, rng: np.random.Generator) -> ComplexArray:
    """One period of symbols of QPSK on all subcarriers, without guard intervals."""
    size = round(OFDM_CARRIERS * rate_hz / bandwidth_hz)
    values = np.exp(0.5j * np.pi * rng.integers(0, 4, (OFDM_SYMBOLS, OFDM_CARRIERS)))
    spectra = np.zeros((OFDM_SYMBOLS, size), dtype=np.complex128)
    spectra[:, np.arange(OFDM_CARRIERS) - OFDM_CARRIERS // 2] = values
    return np.asarray(fft.ifft(spectra, axis=1, norm="ortho").ravel())
