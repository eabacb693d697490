"""Texts that say how ramps are dithered: a number for each ramp, or how they were drawn."""

from typing import Final

import numpy as np

from vsep.errors import InputError, shown

DRAWN: Final = "uniform"


def parse_starts(name: str, text: str, num_ramps: int) -> tuple[float, ...]:
    """Return the starts of the ramps that a text gives.

    Parameters
    ----------
    name : str
        Of the setting, for errors.
    text : str
        Numbers with commas between, or ``uniform REACH SEED``: drawn within plus and minus the
        reach by ``numpy.random.default_rng(SEED).uniform``.
    num_ramps : int
        How many there are.

    Raises
    ------
    InputError
        If it says neither.

    Examples
    --------
    >>> parse_starts("start_times_s", "0, 1e-6", 2)
    (0.0, 1e-06)
    >>> len(parse_starts("start_times_s", "uniform 1e-6 7", 4))
    4
    """
    words = text.split()
    try:
        if words[:1] == [DRAWN]:
            reach, seed = float(words[1]), int(words[2])
            drawn = np.random.default_rng(seed).uniform(-reach, reach, num_ramps)
            return tuple(drawn.tolist())
        starts = tuple(float(word) for word in text.split(","))
    except (ValueError, IndexError, OverflowError):
        raise InputError(
            f"{name} is {shown(text)}; it is a number for each ramp with commas between, or how "
            "they were drawn, as in uniform 1e-6 7."
        ) from None
    return starts
