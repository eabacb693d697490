"""The mask of a frame's interfered samples, by the names that users call it."""

from typing import Final

from vsep._typing import BoolArray, ComplexArray
from vsep._validation import require_choice
from vsep.errors import InputError
from vsep.files.frame import Frame
from vsep.mitigation.masks.detectors import DETECTORS, detect_interference

TRUTH: Final = "truth"
MASK_NAMES: Final = (TRUTH, *DETECTORS)


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
        return detect_interference(name, received)
    mask = frame.perfect_mask
    if mask is None:
        raise InputError(
            f"{frame.name} holds neither truth_mask nor the truth of a simulation; choose a mask "
            f"among {', '.join(DETECTORS)}."
        )
    return mask
