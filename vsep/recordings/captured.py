"""Samples of a recording as they were read, before they become a frame."""

from dataclasses import dataclass
from typing import Any

from numpy.typing import NDArray

from vsep._typing import BoolArray


@dataclass(frozen=True, slots=True, eq=False)
class Captured:
    """Samples of one frame as a file holds them.

    Parameters
    ----------
    samples : (ramps, antennas, samples) complex or real
        Ramps of all transmitters in turn.
    missing : (ramps, antennas, samples) bool or None
        Which of them were never received; None where all were.
    remarks : tuple of str
        What was found out, with advice.
    unit : float
        Value of a converter's least significant bit; zero where it is not known.
    is_unsigned : bool
        Whether no value is negative.
    kept : tuple of int or None
        Which receivers of the file these are; None for all.
    is_doubtful : bool
        Whether I and Q are hardly in their places, so that nothing follows from them.
    """

    samples: NDArray[Any]
    missing: BoolArray | None = None
    remarks: tuple[str, ...] = ()
    unit: float = 0.0
    is_unsigned: bool = False
    kept: tuple[int, ...] | None = None
    is_doubtful: bool = False
