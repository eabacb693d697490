"""Prediction errors of an autoregressive model pooled over the ramps.

The objects' lines can be predicted from the samples before and after; a burst cannot. The smaller
of both errors is taken, as a burst spoils the predictions of what follows it in either direction.
The model is fitted to what the last round left unflagged, the first one to samples of no more than
three times the median magnitude. The noise of the prediction is measured by a median: it fails once
half of the frame is interfered.
"""

import numpy as np

from vsep._typing import BoolArray
from vsep.mitigation.autoregressive import fit_coefficients, prediction_errors
from vsep.mitigation.masks.runs import closed, extended, grown
from vsep.mitigation.method import FrameArray

ORDER = 16
ROUNDS = 4
FIRST_MAGNITUDE = 3.0  # times the median
START = 14.0  # times the mean error power: noise alone exceeds it in one of a million samples
EXTEND = 4.0  # times the mean error power: how far a run reaches
MAX_GAP = 4  # samples below the threshold inside a run
MARGIN = 3  # samples flagged beside a run: there a burst fades into the noise


def prediction_mask(received: FrameArray) -> BoolArray:
    """Flag samples that neither their predecessors nor their successors predict.

    `received` (P, N): the frame; ramps of two samples at most are never flagged. Returns (P, N).
    """
    magnitude = np.abs(received)
    mask: BoolArray = magnitude > FIRST_MAGNITUDE * np.median(magnitude)
    # Every sample must be predicted from one side at least.
    order = min(ORDER, received.shape[1] // 2 - 1)
    if order < 1:
        return np.zeros_like(mask)
    for _ in range(ROUNDS):
        errors = prediction_errors(received, fit_coefficients(received, mask, order))
        power = np.fmin(np.abs(errors.forward) ** 2, np.abs(errors.backward) ** 2)
        unflagged = power if mask.all() else power[~mask]
        mean_power = np.median(unflagged) / np.log(2.0)
        mask = extended(power > START * mean_power, closed(power > EXTEND * mean_power, MAX_GAP))
    return grown(mask, MARGIN)
