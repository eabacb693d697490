"""Removal of static clutter: leakage and a receiver's settling transient."""

from typing import Final

import numpy as np

from vsep._typing import ComplexArray
from vsep.errors import InputError

MIN_RAMPS: Final = 8
"""Of fewer ramps a median does not tell what stands still from what moves or interferes."""


def static_clutter(received: ComplexArray) -> ComplexArray:
    """(..., 1, N) median over the ramps of (..., P, N): all that stands still, no bursts.

    Examples
    --------
    >>> import numpy as np
    >>> static_clutter(np.array([[1.0], [9.0], [1.0]]) + 2j)
    array([[1.+2.j]])
    """
    parts = np.asarray(received)
    median = np.median(parts.real, axis=-2, keepdims=True)
    return np.asarray(median + 1j * np.median(parts.imag, axis=-2, keepdims=True))


def remove_static_clutter(received: ComplexArray, name: str) -> ComplexArray:
    """(P, N) frame without what stands still.

    Parameters
    ----------
    received : (P, N) complex
        A frame.
    name : str
        What the sentence of an `InputError` calls it.

    Raises
    ------
    InputError
        If it has too few ramps for that.
    """
    num_ramps = np.shape(received)[-2]
    if num_ramps < MIN_RAMPS:
        raise InputError(
            f"{name} has {num_ramps} ramps; to remove clutter at least {MIN_RAMPS} are needed."
        )
    return np.asarray(received - static_clutter(received))
