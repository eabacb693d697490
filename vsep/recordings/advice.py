"""Checks of a converted recording, each remark with advice."""

import math
from collections.abc import Iterator
from typing import Final

import numpy as np

from vsep._typing import ComplexArray
from vsep.files.frame import Frame
from vsep.recordings.migration import migration_remark
from vsep.recordings.sampling import MIRROR_SHARE, halves
from vsep.recordings.settings import REAL, RecordingSettings
from vsep.signal.radar import SPEED_OF_LIGHT_MPS

RADAR_BANDS_HZ: Final = ((24.0e9, 24.25e9), (57.0e9, 71.0e9), (76.0e9, 81.0e9), (122e9, 141e9))
MIN_REACH_M: Final = 3.0
MAX_REACH_M: Final = 3000.0
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
    every = received if frame.antennas is None else frame.antennas
    yield from migration_remark(every, frame.radar)
    if settings.samples == REAL or frame.radar.num_samples < 16:
        return
    if halves(received, frame.radar.slope_hz_per_s).likeness > MIRROR_SHARE:
        yield (
            "Positive and negative frequencies are mirror images; I and Q are not in their places "
            "(check format, axes and num_samples), or the samples are real."
        )


def _coherent_share(received: ComplexArray, axis: int) -> float:
    """Share of the energy that is the mean along an axis."""
    if received.shape[axis] < 2:
        return math.nan
    mean = received.mean(axis=axis)
    total = np.sum(np.abs(received) ** 2)
    return float(np.sum(np.abs(mean) ** 2) * received.shape[axis] / total)
