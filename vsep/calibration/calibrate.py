"""Calibration from recordings: burst detection, windows, response estimate.

All recordings are of one receiver: the same sample rate, antennas and slope difference.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from vsep._typing import ComplexArray
from vsep._validation import require_range
from vsep.calibration.burst_windows import (
    BurstWindow,
    cut_bursts,
    find_crossings,
    strongest_antenna,
)
from vsep.calibration.parametric import ParametricResponse, fit_parametric
from vsep.calibration.response_estimate import ResponseEstimate, estimate_response
from vsep.errors import InputError
from vsep.signal.clutter import MIN_RAMPS, static_clutter

SLOPE_ROUNDS = 3  # corrections of a slope difference that was not given; two settle it to 1e-5


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class Calibration:
    """Result of a calibration from recordings."""

    estimate: ResponseEstimate  #: the response, and how it fits every burst
    windows: tuple[BurstWindow, ...]  #: the bursts
    parametric: ParametricResponse  #: stand-in of the response


def calibrate(
    recordings: Sequence[ComplexArray], sample_rate_hz: float, slope_hz_per_s: float | None = None
) -> Calibration:
    """Estimate the complex response of a receiver from the bursts of recordings.

    Parameters
    ----------
    recordings : sequence of (A, P, N) complex
        In the paper's sign.
    sample_rate_hz : float
        f_s.
    slope_hz_per_s : float, optional
        Slope difference Delta k, interferer less victim, in the paper's sign. Without it, it is
        estimated: as the one whose response bends its phase as a Butterworth filter does.

    Raises
    ------
    InputError
        If a recording has too few ramps or bursts, or the recordings do not fit together.
    """
    for recording in recordings:
        _require_usable(recording, recordings[0])
    if slope_hz_per_s is not None:
        highest = 0.05 * sample_rate_hz**2 * 4.0
        require_range("abs(slope difference)", abs(slope_hz_per_s), 1e6, highest, "Hz/s")
    found = []
    for recording in recordings:
        moving = recording - static_clutter(recording)
        found.append(find_crossings(moving[strongest_antenna(moving)], sample_rate_hz))
    slopes = [each.slope_hz_per_s for crossings in found for each in crossings]
    if not slopes:
        raise InputError("No burst stands out of the recordings; calibration needs interference.")
    slope = float(np.median(slopes)) if slope_hz_per_s is None else slope_hz_per_s
    windows = tuple(
        window
        for recording, crossings in zip(recordings, found, strict=True)
        for window in cut_bursts(recording, crossings, slope / sample_rate_hz**2)
    )
    estimate = estimate_response(windows, sample_rate_hz, slope)
    for _ in range(SLOPE_ROUNDS if slope_hz_per_s is None else 0):
        bent = fit_parametric(estimate.response, sample_rate_hz, free_bend=True)
        slope = bent.corrected_slope(slope)
        estimate = estimate_response(windows, sample_rate_hz, slope)
    parametric = fit_parametric(estimate.response, sample_rate_hz)
    return Calibration(estimate=estimate, windows=windows, parametric=parametric)


def _require_usable(recording: ComplexArray, first: ComplexArray) -> None:
    if recording.ndim != 3:
        raise InputError(
            f"A recording has shape {recording.shape}; it must be (antennas, ramps, samples)."
        )
    if len(recording) != len(first):
        raise InputError(
            f"The recordings have {len(first)} and {len(recording)} antennas; one receiver's all "
            "have the same."
        )
    if recording.shape[1] < MIN_RAMPS:
        raise InputError(
            f"A recording has {recording.shape[1]} ramps; at least {MIN_RAMPS} are needed to "
            "tell what stands still from bursts."
        )
