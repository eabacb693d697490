"""Jets of modified responses: values with their derivatives by the frequency."""

from typing import NamedTuple

import numpy as np

from vsep._typing import ComplexArray, FloatArray
from vsep.errors import InputError


class ResponseJet(NamedTuple):
    """Modified response with its first two derivatives by the frequency."""

    value: ComplexArray  #: gbar
    first: ComplexArray  #: dGbar/df in 1/Hz
    second: ComplexArray  #: d^2 Gbar/df^2 in 1/Hz^2; dGbar/d(Delta k) is ``-0.25j / pi`` times this


def nonparallel(slope_hz_per_s: FloatArray | float) -> FloatArray:
    """Return the slope differences as an array, or raise `InputError` if one of them is zero."""
    slope = np.asarray(slope_hz_per_s, dtype=np.float64)
    if not slope.all():
        raise InputError(
            "The slope difference is 0 Hz/s; it must not be zero, parallel chirps have no burst."
        )
    return slope
