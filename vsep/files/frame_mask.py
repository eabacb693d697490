"""Samples of a frame that are not to be used: masks by name, and ramps of the same slope."""

from dataclasses import replace
from typing import Final

import numpy as np

from vsep._typing import BoolArray, ComplexArray
from vsep._validation import require_choice
from vsep.analysis.parallel import parallel_ramps
from vsep.errors import InputError
from vsep.files.frame import Frame
from vsep.mitigation.masks.detectors import DETECTORS, detect_interference

TRUTH: Final = "truth"
MASK_NAMES: Final = (TRUTH, *DETECTORS)
SET_ASIDE: Final = "set-aside"


def frame_mask(
    frame: Frame, name: str | None = None, received: ComplexArray | None = None
) -> BoolArray:
    """Return which samples of a frame are interfered, or were never received.

    Parameters
    ----------
    frame : Frame
        The frame.
    name : str, optional
        "truth": the file's ``truth_mask``, or by the interference that its truth holds; otherwise
        one of `DETECTORS`. By default the truth where it is known, else "autoregressive".

    Returns
    -------
    (P, N) bool

    Raises
    ------
    InputError
        If the name is unknown, or the truth is asked for and not known.
    """
    if name is None:
        name = "autoregressive" if frame.perfect_mask is None else TRUTH
    found = _interfered(frame, name, frame.received if received is None else received)
    missing = frame.missing_rows(together=False)
    return found if missing is None else found | missing


def _interfered(frame: Frame, name: str, received: ComplexArray) -> BoolArray:
    require_choice("mask", name, MASK_NAMES)
    if name != TRUTH:
        return detect_interference(name, received, frame.radar.dither)
    mask = frame.perfect_mask
    if mask is None:
        raise InputError(
            f"{frame.name} holds neither truth_mask nor the truth of a simulation; choose a mask "
            f"among {', '.join(DETECTORS)}."
        )
    return mask


def set_aside_same_slope(frame: Frame) -> Frame:
    """Return a frame whose ramps with an interferer of the same slope are missing at all antennas.

    See `vsep.analysis.parallel`; what such an interferer does to a ramp cannot be told from
    objects, but the other ramps tell of them.

    Examples
    --------
    >>> from vsep.signal.radar import ChirpSequence
    >>> radar = ChirpSequence(start_frequency_hz=77e9, slope_hz_per_s=1e13, sample_rate_hz=5e6,
    ...                       ramp_period_s=3e-5, num_samples=64, num_ramps=16)
    >>> received = np.random.default_rng(0).normal(size=(2, 16, 64)).T @ np.array([1.0, 1.0j])
    >>> received[:, 5] += 10.0 * np.exp(2j * np.pi * 0.21 * np.arange(64))
    >>> taken = set_aside_same_slope(Frame(received=received.T, radar=radar))
    >>> np.flatnonzero(taken.missing[0].all(axis=1))
    array([5])
    """
    ramps = parallel_ramps(frame.received if frame.antennas is None else frame.antennas)
    if not ramps.any():
        return frame
    missing = np.zeros((frame.num_antennas, *frame.radar.shape), dtype=np.bool_)
    missing[:, ramps] = True
    return replace(frame, missing=missing if frame.missing is None else missing | frame.missing)
