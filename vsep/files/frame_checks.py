"""Checks of what a frame file holds, each refused in one sentence."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from vsep.errors import InputError

# The estimators form fourth powers of the signal; within these magnitudes none of them leaves the
# range of 64-bit numbers, 1e-308 to 1e308, also with the gain of a large frame.
_MIN_PEAK = 1e-60
_MAX_PEAK = 1e60


def require_signal(name: str, stored: NDArray[Any]) -> None:
    """Refuse what is no complex frame."""
    if stored.ndim not in (1, 2, 3):
        raise InputError(
            f"{name}: received has shape {stored.shape}; it must be (ramps, samples), (samples,) "
            "for a single ramp, or (antennas, ramps, samples)."
        )
    if stored.dtype.kind != "c":
        raise InputError(
            f"{name}: received has type {stored.dtype}; complex samples (I + jQ) are needed, real "
            "ones become complex by a Hilbert transform along the ramp."
        )


def require_antenna(name: str, antenna: int, num_antennas: int) -> None:
    """Refuse an antenna that the file does not hold."""
    if num_antennas == 0:
        raise InputError(f"{name}: received holds no antenna; at least one is needed.")
    if not 0 <= antenna < num_antennas:
        raise InputError(
            f"{name}: antenna is {antenna}; it must lie between 0 and {num_antennas - 1}, the last "
            "of the file."
        )


def require_usable(name: str, received: NDArray[Any]) -> None:
    """Refuse samples that are not finite, all zero, or whose powers would overflow."""
    finite = np.isfinite(received)
    if not finite.all():
        count = received.size - np.count_nonzero(finite)
        raise InputError(
            f"{name}: {count} of {received.size} samples of received are NaN or infinite; all must "
            "be finite."
        )
    peak = float(np.abs(received).max())
    if peak == 0.0:
        raise InputError(f"{name}: received is zero everywhere; a frame with a signal is needed.")
    if not _MIN_PEAK <= peak <= _MAX_PEAK:
        raise InputError(
            f"{name}: the largest magnitude in received is {peak:g}; it must lie between "
            f"{_MIN_PEAK:g} and {_MAX_PEAK:g}."
        )
