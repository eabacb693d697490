"""Samples at a converter's full scale, which say how much there was at least."""

from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from vsep._typing import BoolArray

FEWEST: Final = 4
"""Words at an end of the range from which it is clipping; fewer may be the largest that came."""

NEAR_FULL_SCALE: Final = 1.0 - 2.0**-11
"""Of a frame of words: the largest word of 12 bits, and all that lie above."""


def saturated_words(words: NDArray[Any], bits: int) -> BoolArray | None:
    """Find words at either end of the range of a converter.

    Parameters
    ----------
    words : (W,) int
        Signed words.
    bits : int
        Of the converter.

    Returns
    -------
    (W,) bool or None
        None where fewer than four words lie at each end.

    Examples
    --------
    >>> saturated_words(np.array([2047, 5, 2047, 2047, 2047, -2048]), 12)
    array([ True, False,  True,  True,  True, False])
    """
    half = 2 ** (bits - 1)
    ends = [words >= half - 1, words <= -half]
    clipped = [end for end in ends if np.count_nonzero(end) >= FEWEST]
    return np.asarray(np.logical_or.reduce(clipped)) if clipped else None


def num_saturated(samples: NDArray[Any]) -> int:
    """Return how many samples of a frame of words lie at full scale, one."""
    parts = np.maximum(np.abs(samples.real), np.abs(samples.imag))
    return int(np.count_nonzero(parts >= NEAR_FULL_SCALE))


def remark_of_saturated(saturated: BoolArray) -> str:
    """Say how many samples (ramps, antennas, samples) are saturated."""
    ramps = int(np.count_nonzero(saturated.any(axis=(1, 2))))
    return (
        f"{np.count_nonzero(saturated)} samples ({saturated.mean():.2%}) in {ramps} of "
        f"{len(saturated)} ramps are saturated: they have words at the converter's full scale."
    )
