"""Residual of a line-spectral fit to the samples that are not flagged: accurate, and slow.

The masked estimator explains the objects without the flagged samples; what the frame then holds
above the noise is interference. The first mask is that of the prediction errors.
"""

import numpy as np
from scipy.ndimage import uniform_filter1d

from vsep._typing import BoolArray
from vsep.inference.core.run import run
from vsep.inference.objects.masked import MaskedSeparator
from vsep.kernels.moving_atoms import STATIONARY
from vsep.mitigation.masks.prediction import prediction_mask
from vsep.mitigation.masks.runs import closed, extended, grown
from vsep.mitigation.method import FrameArray
from vsep.signal.dithered_atoms import RampDither
from vsep.signal.filters import NoFilter
from vsep.signal.template import SignalModel

ROUNDS = 3
ITERATIONS = 40  # of a fit; the mask needs no more accuracy
AVERAGED = 5  # neighbouring samples whose mean power is compared
START = 4.0  # times the noise power: five samples of noise average this once in 2e5
EXTEND = 2.0  # times the noise power: how far a run reaches
MAX_GAP = 2
MARGIN = 1


def residual_mask(received: FrameArray, dither: RampDither | None = None) -> BoolArray:
    """Flag samples that the objects fitted to the other samples do not explain.

    `received` (P, N): the frame; it must not be zero everywhere; `dither`: how its ramps were
    dithered. Returns (P, N). Raises
    `InputError` if the frame cannot be fitted: a ramp shorter than eight samples, no signal.
    """
    num_ramps, num_samples = received.shape
    # Neither sampling rate nor filter plays a part in a fit of objects.
    model = SignalModel(
        num_ramps=num_ramps,
        num_samples=num_samples,
        sample_rate_hz=1e6,
        anti_aliasing_filter=NoFilter(),
        migration=dither or STATIONARY,
    )
    frame = model.check(np.asarray(received, dtype=np.complex128))
    mask = prediction_mask(frame)
    for _ in range(ROUNDS):
        estimator = MaskedSeparator(model=model, mask=mask, max_iterations=ITERATIONS)
        state = run(estimator, frame).state
        power = np.abs(state.corrected(frame) - state.object_signal) ** 2 * state.noise_precision
        power = uniform_filter1d(power, AVERAGED, axis=1, mode="nearest")
        last, mask = mask, extended(power > START, closed(power > EXTEND, MAX_GAP))
        mask = grown(mask, MARGIN)
        if np.array_equal(mask, last):
            break
    return mask
