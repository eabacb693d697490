"""Checks of a converted recording, each remark with advice."""

import math
from collections.abc import Iterator
from typing import Final

import numpy as np

from vsep._typing import ComplexArray
from vsep.files.frame import Frame
from vsep.recordings.settings import RecordingSettings
from vsep.signal.radar import SPEED_OF_LIGHT_MPS

RADAR_BANDS_HZ: Final = ((24.0e9, 24.25e9), (57.0e9, 71.0e9), (76.0e9, 81.0e9), (122e9, 141e9))
MIN_REACH_M: Final = 3.0
MAX_REACH_M: Final = 3000.0
MIRROR_SHARE: Final = 0.9  # of the strong cells: how alike both halves of the spectrum may be
COHERENT_SHARE: Final = 0.5  # of the energy: what a mean along an axis explains of static echoes


def advice(frame: Frame, settings: RecordingSettings) -> tuple[str, ...]:
    """Compare the values with each other and with the samples.

    Parameters
    ----------
    frame : Frame
        The converted recording.
    settings : RecordingSettings
        What was said of it.

    Returns
    -------
    tuple of str
        Empty if all looks plausible. Nothing in it is certain.
    """
    return (*_of_band(frame, settings), *_of_reach(frame), *_of_samples(frame, settings))


def _of_band(frame: Frame, settings: RecordingSettings) -> Iterator[str]:
    radar = frame.radar
    start = settings.start_frequency_hz
    sampled = (radar.num_samples - 1) / radar.sample_rate_hz
    end = radar.start_frequency_hz + radar.slope_hz_per_s * sampled
    bands = [band for band in RADAR_BANDS_HZ if band[0] <= start <= band[1]]
    swept = f"{abs(end - start) / 1e9:.3g} GHz"
    if not bands:
        yield (
            f"The ramps start at {start / 1e9:.6g} GHz, which is in no usual radar band; check "
            "start_frequency_hz."
        )
    elif not any(low <= end <= high for low, high in bands):
        low, high = bands[0]
        yield (
            f"The ramps sweep {swept} from {start / 1e9:.6g} to {end / 1e9:.6g} GHz, out of the "
            f"band from {low / 1e9:g} to {high / 1e9:g} GHz; check slope_hz_per_s, sample_rate_hz "
            "and num_samples."
        )
    elif abs(end - start) < 1e6:
        yield f"The ramps sweep {swept} only; check slope_hz_per_s, which is in hertz per second."


def _of_reach(frame: Frame) -> Iterator[str]:
    radar = frame.radar
    reach = radar.sample_rate_hz / abs(radar.slope_hz_per_s) * SPEED_OF_LIGHT_MPS / 2.0
    if not MIN_REACH_M <= reach <= MAX_REACH_M:
        yield (
            f"Beat frequencies up to the sample rate reach {reach:.3g} m; check sample_rate_hz and "
            "slope_hz_per_s."
        )


def _of_samples(frame: Frame, settings: RecordingSettings) -> Iterator[str]:
    received = frame.received
    along_ramps, along_samples = _coherent_share(received, 0), _coherent_share(received, 1)
    if along_samples > COHERENT_SHARE > 2.0 * along_ramps:
        yield (
            f"The samples of a ramp hardly differ: their mean is {along_samples:.0%} of the "
            f"energy. Are the axes swapped? There are {frame.radar.num_ramps} ramps of "
            f"{frame.radar.num_samples} samples."
        )
        return
    if settings.samples == "real" or frame.radar.num_samples < 16:
        return
    lower, upper, likeness = _halves(received)
    if likeness > MIRROR_SHARE:
        yield (
            "Positive and negative frequencies are mirror images; I and Q are not in their places "
            "(check format, axes and num_samples), or the samples are real."
        )
    elif frame.radar.lowest_beat == -0.5 and frame.radar.slope_hz_per_s * (lower - upper) > 0.0:
        share = max(lower, upper) / (lower + upper)
        if share > COHERENT_SHARE + 0.25:
            yield (
                f"{share:.0%} of the static energy lies at negative distances; sign "
                f"({settings.sign}) is perhaps the other one."
            )


def _coherent_share(received: ComplexArray, axis: int) -> float:
    """Share of the energy that is the mean along an axis."""
    if received.shape[axis] < 2:
        return math.nan
    mean = received.mean(axis=axis)
    total = np.sum(np.abs(received) ** 2)
    return float(np.sum(np.abs(mean) ** 2) * received.shape[axis] / total)


def _halves(received: ComplexArray) -> tuple[float, float, float]:
    """Energy at negative and at positive beat frequencies, and how alike the halves are.

    By the median over the ramps, which bursts do not move, from the second half of a ramp, where
    the receiver has settled, and without the lowest frequencies, where offsets live.
    """
    settled = received[:, received.shape[1] // 2 :]
    num_samples = settled.shape[1]
    spectra = np.fft.ifft(settled * np.hanning(num_samples), axis=1)
    power = np.median(np.abs(spectra) ** 2, axis=0)
    first, last = max(1, num_samples // 64), num_samples // 2
    upper, lower = power[first:last], power[-first:-last:-1]
    likeness = float(np.sum(np.sqrt(upper * lower)) / np.sqrt(upper.sum() * lower.sum()))
    return float(lower.sum()), float(upper.sum()), likeness
