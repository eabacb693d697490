"""The detectors of interfered samples by the names that users call them."""

from collections.abc import Callable
from typing import Final

from vsep._typing import BoolArray, frozen
from vsep._validation import require_choice
from vsep.mitigation.masks.amplitude import amplitude_mask
from vsep.mitigation.masks.prediction import prediction_mask
from vsep.mitigation.masks.residual import residual_mask
from vsep.mitigation.method import FrameArray, checked_frame
from vsep.signal.dithered_atoms import RampDither

DETECTORS: Final[dict[str, Callable[[FrameArray], BoolArray]]] = {
    "amplitude": amplitude_mask,
    "autoregressive": prediction_mask,
    "residual": residual_mask,
}


def detect_interference(
    name: str, received: FrameArray, dither: RampDither | None = None
) -> BoolArray:
    """Find the interfered samples of a frame.

    Parameters
    ----------
    name : str
        One of `DETECTORS`.
    received : (P, N) complex
        The frame.
    dither : RampDither, optional
        How its ramps were dithered; the residual's objects see it.

    Returns
    -------
    (P, N) bool
        True where a sample is interfered; read-only.

    Raises
    ------
    InputError
        If the name is unknown or the frame cannot be used.

    Examples
    --------
    >>> import numpy as np
    >>> frame = np.exp(-0.2j * np.pi * np.arange(64))[None]
    >>> frame[0, 30:40] += 50.0 * np.exp(1j * np.arange(10) ** 2)
    >>> mask = detect_interference("autoregressive", frame)
    >>> bool(mask[0, 30:40].all()), bool(mask[0, :20].any())
    (True, False)
    """
    require_choice("mask", name, DETECTORS)
    if dither is not None and name == "residual":
        return frozen(residual_mask(checked_frame(received), dither))
    return frozen(DETECTORS[name](checked_frame(received)))
