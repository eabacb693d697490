"""Frames of a raw capture, told by moving echoes.

Between frames the sensor pauses: what moves goes on with another phase, which the ramps before do
not tell.
"""

from typing import Final

import numpy as np

from vsep._typing import ComplexArray, FloatArray
from vsep.recordings.missing_samples import prediction_error

LENGTHS: Final = range(8, 4097)  # ramps of a channel in a frame
FEWEST_FRAMES: Final = 3
_COURSES = 24  # range cells with the strongest moving echoes
_ORDER = 4  # of the prediction from ramp to ramp
_TELLING = 6.0  # how many times the usual its error is where a frame begins
_MOVING = 4.0  # times the median: variance of a cell with a moving echo


def frame_length(spectra: ComplexArray) -> int | None:
    """Return the ramps of a frame, where moving echoes tell them.

    Parameters
    ----------
    spectra : (ramps, channels, cells) complex
        Range spectra of a whole capture.

    Returns
    -------
    int or None
        A divisor of the number of ramps; None for one frame, fewer than three, or where nothing
        moves.
    """
    count = len(spectra)
    lengths = [each for each in LENGTHS if count % each == 0 and count // each >= FEWEST_FRAMES]
    if not lengths:
        return None
    courses = spectra.reshape(count, -1).T
    moving = courses - courses.mean(axis=1, keepdims=True)
    power = np.mean(np.abs(moving) ** 2, axis=1)
    strongest = np.argsort(-power)[:_COURSES]
    strongest = strongest[power[strongest] > _MOVING * np.median(power)]
    if not len(strongest):
        return None
    normed = moving[strongest] / np.sqrt(power[strongest])[:, None]
    error = prediction_error(normed, _ORDER)
    usual = float(np.median(error))
    if usual <= 0.0:
        return None
    jumps = {each: _least_jump(error, each) / usual for each in lengths}
    told = [each for each in lengths if jumps[each] > _TELLING]
    return min(told, default=None)


def _least_jump(error: FloatArray, length: int) -> float:
    """Return the median error of a frame's first ramp, of the odd or the even frames."""
    starts = error[length - _ORDER :: length]
    parts = (starts[::2], starts[1::2])
    return float(min(np.median(part) for part in parts if len(part)))
