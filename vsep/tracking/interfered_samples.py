"""Samples of a frame that hold more than objects and noise, by what the objects leave of it."""

from typing import NamedTuple

import numpy as np
from scipy.special import gammainccinv

from vsep._typing import BoolArray, ComplexArray, FloatArray
from vsep.inference.bursts.sample_weights import louder_runs, usual_power

WINDOWS = (8, 32, 128)  # samples: a burst of about such a length raises the mean power in one
RAISED_CHANCE = 1e-7  # with which the mean power of noise in a window is more than allowed


class Examined(NamedTuple):
    """Noise power by the median, samples (P, N) that are louder, None if none is, and the power."""

    noise: float
    louder: BoolArray | None
    power: FloatArray


def examined(left: ComplexArray, missing: BoolArray | None = None) -> Examined:
    """Tell noise from what is louder.

    Parameters
    ----------
    left : (P, N) complex
        What the objects leave.
    missing : (P, N) bool, optional
        Samples that were never received.
    """
    power = left.real**2 + left.imag**2
    if missing is not None:
        power[missing] = 0.0
    noise = usual_power(power)
    return Examined(noise, louder_runs(power, noise), power)


def raised_rows(power: FloatArray, noise: float) -> BoolArray:
    """(P,) whether the mean of powers (P, N) in any window along a ramp is more than that of noise.

    A long weak burst raises no sample by much.
    """
    sums = np.zeros((len(power), power.shape[1] + 1))
    np.cumsum(power, axis=1, out=sums[:, 1:])
    raised = np.zeros(len(power), np.bool_)
    for length in {*WINDOWS, power.shape[1]}:
        if length > power.shape[1]:
            continue
        # the sum of that many exponential variables follows a Gamma law
        allowed = noise * float(gammainccinv(length, RAISED_CHANCE))
        raised |= (sums[:, length:] - sums[:, :-length]).max(axis=1) > allowed
    return raised
