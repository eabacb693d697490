"""Waveforms of interference that is no chirps, by how it spreads over the ramp.

The victim sweeps through the band of the other radar, so that its power over fast time is the other
one's spectrum, smoothed by the pass band: flat with steep edges of OFDM, the squared sinc of a chip
of a phase code. A carrier that is stepped is in the pass band for a short while in every step.
"""

import math
from collections.abc import Callable
from typing import Final

import numpy as np
from scipy import ndimage

from vsep._typing import BoolArray, ComplexArray, FloatArray
from vsep.signal.radar import ChirpSequence

GAP: Final = 0.1  # of the mean power between the first and the last loud sample: next to nothing
IN_GAPS: Final = 0.27  # of the samples in between; of noise it is 0.1
LOUD: Final = 0.1  # of the largest mean power
FLOOR: Final = 0.01  # of the largest mean power, which skirts of the filter reach
AVERAGED: Final = 3  # samples
BAND: Final = 0.5  # of the sample rate, the usual pass band
WIDTHS: Final = 1.12 ** np.arange(32) / 32.0  # of the bands that are tried, in ramps
SURE_NATS: Final = 5.0  # by which one spectrum must explain the powers better than the other


def noise_waveform(
    rows: ComplexArray, noise_like: BoolArray, noise: float, radar: ChirpSequence
) -> str | None:
    """Name of the waveform in `vsep.parameters.WAVEFORMS`; None where nothing tells.

    Parameters
    ----------
    rows : (R, N) complex
        What the objects leave of the ramps with such interference.
    noise_like : (R, N) bool
        Where it is.
    noise : float
        Noise power of a sample.
    radar : ChirpSequence
        The victim.
    """
    power = rows.real**2 + rows.imag**2
    if _share_in_gaps(power) > IN_GAPS:
        return "stepped"
    profile = _aligned_mean(power, noise_like)
    floor = max(FLOOR * float(np.nanmax(profile)), noise)
    profile = profile - noise + floor
    passage = BAND * radar.sample_rate_hz**2 / abs(radar.slope_hz_per_s)  # samples
    independent = BAND * len(rows)
    flat, code = (
        independent * _best_fit(profile, floor, shape, passage) for shape in (_flat, _squared_sinc)
    )
    if abs(flat - code) < SURE_NATS:
        return None
    return "ofdm" if flat > code else "phase-coded"


def _share_in_gaps(power: FloatArray) -> float:
    """Share of the samples between the first and the last loud ones that hold next to nothing."""
    around = ndimage.uniform_filter1d(power, AVERAGED, axis=1)
    loud = around > LOUD * around.max(axis=1, keepdims=True)
    inside = np.logical_or.accumulate(loud, axis=1)
    inside &= np.logical_or.accumulate(loud[:, ::-1], axis=1)[:, ::-1]
    counts = inside.sum(axis=1)
    means = np.where(inside, power, 0.0).sum(axis=1) / counts
    return float(np.median(np.sum(inside & (power < GAP * means[:, None]), axis=1) / counts))


def _aligned_mean(power: FloatArray, noise_like: BoolArray) -> FloatArray:
    """(2 N,) mean power around the middle of the interference of every ramp; NaN without any."""
    num_samples = power.shape[1]
    held = np.where(noise_like, power, 0.0)
    middles = held @ np.arange(num_samples) / np.maximum(held.sum(axis=1), 1e-300)
    aligned = np.full((len(power), 2 * num_samples), np.nan)
    for row, values, middle in zip(aligned, power, middles, strict=True):
        first = num_samples - round(float(middle))
        row[first : first + num_samples] = values
    counts = np.sum(np.isfinite(aligned), axis=0)
    sums = np.nansum(aligned, axis=0)
    return np.where(counts > 0, sums / np.maximum(counts, 1), np.nan)


def _flat(offsets: FloatArray) -> FloatArray:
    return (np.abs(offsets) < 0.5).astype(np.float64)


def _squared_sinc(offsets: FloatArray) -> FloatArray:
    return np.asarray(np.sinc(offsets) ** 2)


def _best_fit(
    profile: FloatArray,
    noise: float,
    shape: Callable[[FloatArray], FloatArray],
    passage: float,
) -> float:
    """Largest log likelihood of mean powers, exponential laws, over width and middle."""
    known = np.isfinite(profile)
    values = profile[known]
    half = len(profile) // 2
    samples = np.arange(len(profile), dtype=np.float64)
    best = -math.inf
    for width in WIDTHS * half:
        smoothed = ndimage.uniform_filter1d(
            shape((samples - half) / width), max(round(passage), 1), mode="constant"
        )
        for shift in np.arange(-3, 4) * max(width / 24.0, 1.0):
            expected = np.roll(smoothed, round(float(shift)))[known]
            level = max(float(np.sum(values - noise)), 0.0) / max(float(expected.sum()), 1e-300)
            mean = noise + level * expected
            best = max(best, float(-np.sum(np.log(mean) + values / mean)))
    return best
