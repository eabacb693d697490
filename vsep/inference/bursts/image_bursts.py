"""Images of bursts, which are modelled as bursts until the receiver's image factor is known.

The image of a chirp is a chirp of the opposite slope that crosses the band at the same time. Once a
frame is corrected it holds none; a burst that still stands for it would be made up for by others.
"""

from dataclasses import replace

import numpy as np

from vsep.inference.bursts.table import BurstTable
from vsep.inference.core.image_estimate import LARGEST
from vsep.inference.core.state import BurstComponents, SeparationState

SLOPE_MISMATCH = 0.3  # of the slope
CENTRE_MISMATCH = 0.1  # over the slope, in samples: a tenth of the band


def without_image_bursts(
    last: SeparationState, state: SeparationState, table: BurstTable
) -> SeparationState:
    """Return a state without images of its bursts where it has an image factor for the first time.

    Parameters
    ----------
    last, state : SeparationState
        Where the step started from, and what it has led to.
    table : BurstTable
        The bursts of the state, in its order.
    """
    before = last.receiver is not None and bool(np.any(last.receiver.image_factors))
    if before or state.receiver is None or not np.any(state.receiver.image_factors):
        return state
    images = np.array(
        [any(_is_image(burst, other) for other in state.bursts) for burst in state.bursts],
        dtype=np.bool_,
    )
    signal = state.interference_signal.copy()
    np.subtract.at(signal, table.rows[images], table.signals[images])
    kept = [burst for burst, image in zip(state.bursts, images, strict=True) if not image]
    return replace(state, bursts=tuple(kept), interference_signal=signal)


def _is_image(burst: BurstComponents, other: BurstComponents) -> bool:
    if (burst.ramp, burst.antenna) != (other.ramp, other.antenna):
        return False
    if burst.energy > LARGEST**2 * other.energy:
        return False
    if abs(burst.slope + other.slope) > SLOPE_MISMATCH * abs(other.slope):
        return False
    return abs(burst.centre - other.centre) < CENTRE_MISMATCH / abs(other.slope)
