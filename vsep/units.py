"""Decibels and normalised frequencies."""

import math
from typing import Any

import numpy as np

from vsep._typing import FloatArray


def wrap_frequency(frequency: FloatArray) -> FloatArray:
    """Wrap a normalised frequency (cycles per sample or per ramp) into [-1/2, 1/2).

    Examples
    --------
    >>> import numpy as np
    >>> wrap_frequency(np.array([0.5, 0.75, -0.5, 0.25]))
    array([-0.5 , -0.25, -0.5 ,  0.25])
    """
    wrapped: FloatArray = (frequency + 0.5) % 1.0 - 0.5
    return wrapped


def to_db(power_ratio: Any) -> Any:
    """Return 10 log10 of a power ratio; zero and below map to -400 dB instead of -inf."""
    if isinstance(power_ratio, float):  # one of the many of a step
        return 10.0 * math.log10(max(power_ratio, 1e-40))
    return 10.0 * np.log10(np.maximum(power_ratio, 1e-40))


def from_db(level_db: Any) -> Any:
    """Return the power ratio of a level in dB."""
    if isinstance(level_db, float):
        return 10.0 ** (level_db / 10.0)
    return 10.0 ** (np.asarray(level_db, dtype=np.float64) / 10.0)
