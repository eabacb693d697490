"""Settling transient of a receiver: equal in all ramps, strongest where they begin, and no line.

A receiver with a high-pass answers the start of every ramp with a decaying signal t(n). Lines at
zero Doppler frequency, which stand still as well, last for the whole ramp: what t is, the mean over
the ramps tells where it lies far above its level later in the ramp. With the power q(n) of that
mean, taken as falling, and its later level l,

    t(n) = (1 - l / q(n)) mean of r(n, p) over p,  zero where q(n) < 2 l.

Objects at zero Doppler frequency keep what of them is in the rest of the ramp; once they are
estimated, the mean is that of what they leave.
"""

from dataclasses import replace
from typing import Final

import numpy as np
from scipy.optimize import isotonic_regression

from vsep._typing import BoolArray, ComplexArray, FloatArray
from vsep.inference.core.receiver import ReceiverErrors, no_errors
from vsep.signal.clutter import MIN_RAMPS, static_clutter
from vsep.signal.template import SignalModel

FEWEST_SAMPLES: Final = 64
PART: Final = 8  # of a ramp: where it is strongest, and the parts with which that is compared
EVIDENT: Final = 16.0  # ratio of powers that no few lines make
SETTLED_AFTER: Final = 4  # part of a ramp by which a receiver has settled
ABOVE_LEVEL: Final = 2.0  # times the later level: less is no transient


def initial_errors(
    received: ComplexArray, model: SignalModel, missing: BoolArray | None
) -> ReceiverErrors | None:
    """Errors of a receiver that settles in every ramp; None where that is not evident.

    Parameters
    ----------
    received : (A P, N) complex
        The frame.
    model : SignalModel
        Size of the frame.
    missing : (A P, N) bool or None
        Samples that were not received.
    """
    if model.num_ramps < MIN_RAMPS or model.num_samples < FEWEST_SAMPLES or missing is not None:
        return None
    rows = received.reshape(model.num_antennas, *model.shape)
    # A mean is quickly made; a median has no bursts.
    if not is_evident(rows.mean(axis=1), EVIDENT / 4.0):
        return None
    still = static_clutter(rows)[:, 0]
    if not is_evident(still, EVIDENT):
        return None
    none = no_errors(model.num_ramps, model.num_antennas)
    return replace(none, transients=transient_of(still))


def is_evident(still: ComplexArray, ratio: float) -> bool:
    """Whether what stands still (A, N) is stronger where ramps begin than anywhere later."""
    size = still.shape[1] // PART
    power = np.mean(np.abs(still[:, : size * PART]) ** 2, axis=0).reshape(PART, size).mean(axis=1)
    return bool(power[0] > ratio * power[PART // SETTLED_AFTER :].max())


def transient_of(still: ComplexArray) -> ComplexArray:
    """Transient (A, N) of what stands still (A, N), a mean over the ramps.

    Examples
    --------
    >>> n = np.arange(128)
    >>> still = 100.0 * np.exp(-n / 8.0) + np.exp(0.3j * n)
    >>> found = transient_of(still[None])[0]
    >>> bool(abs(found[0] - 101.0) < 0.1), int(np.flatnonzero(found)[-1]) < 40
    (True, True)
    """
    return np.array([_gain(np.abs(own) ** 2) * own for own in still])


def _gain(power: FloatArray) -> FloatArray:
    """(N,) share of the power of a mean that is the transient's."""
    level = float(np.mean(power[len(power) // SETTLED_AFTER :]))
    falling = isotonic_regression(power, increasing=False).x
    return np.where(falling > ABOVE_LEVEL * level, 1.0 - level / np.maximum(falling, 1e-300), 0.0)
