"""Objects fitted to the samples that hold no interference, before any burst is modelled.

With the places of the objects predicted, their weights are a linear fit. Samples that it leaves far
above the noise are interfered; the fit is repeated without them, on a majorised frame as in
`vsep.inference.objects.masked`. What remains says whether there is interference at all.
"""

from dataclasses import dataclass, replace

import numpy as np

from vsep._typing import BoolArray, ComplexArray
from vsep.inference.bursts.sample_weights import usual_power
from vsep.inference.core.state import SeparationState
from vsep.inference.objects.dithered import object_workspace
from vsep.inference.objects.nearby import nearby_workspace, pays_together
from vsep.inference.objects.object_only import ObjectSettings
from vsep.tracking.clean_frame import LOUDER
from vsep.tracking.interfered_samples import examined, raised_rows

FITS = 2  # of the weights alone, at the predicted places, where samples are left out
MOST_REFINEMENTS = 12  # of places and weights ...
SETTLED = 0.97  # ... as long as each leaves less than this share of the noise power before
MOST_INTERFERED = 0.4  # of the samples: beyond, the median does not tell the noise
DROWNED = 10.0  # times: the objects that are there are not those that were predicted


@dataclass(frozen=True, slots=True, eq=False)
class CleanFit:
    """Objects of a frame by its clean samples.

    Parameters
    ----------
    state : SeparationState
        With objects, object signal and noise precision.
    interfered : (P, N) bool
        Samples that hold more than objects and noise.
    is_clean : bool
        Whether nothing speaks for interference.
    is_usable : bool
        Whether enough samples are clean, and explained, for the fit to be trusted.
    """

    state: SeparationState
    interfered: BoolArray
    is_clean: bool
    is_usable: bool


def fit_clean_samples(
    settings: ObjectSettings, received: ComplexArray, predicted: SeparationState
) -> CleanFit:
    """Fit predicted objects to the samples of a frame that are not interfered.

    Parameters
    ----------
    settings : ObjectSettings
        Model and thresholds.
    received : (A P, N) complex
        The frame.
    predicted : SeparationState
        See `vsep.tracking.prediction.predicted_state`.
    """
    missing = np.zeros(received.shape, np.bool_) if settings.missing is None else settings.missing
    state, noise, is_clean = predicted, np.inf, False
    interfered = _interfered(received, missing)
    if interfered.any():
        for _ in range(FITS):
            state = _fitted(settings, received, state, ~(interfered | missing), refined=False)
        left = received - state.object_signal
        interfered = _interfered(left, missing)
        noise = _noise_power(left[~(interfered | missing)])
    for _ in range(MOST_REFINEMENTS):
        if interfered.mean() > MOST_INTERFERED:
            break
        used = ~(interfered | missing)
        state = _fitted(settings, received, state, used, refined=True)
        left = np.where(missing, 0.0, received - state.object_signal)
        before, noise = noise, _noise_power(left[used])
        interfered = _interfered(left, missing)
        quiet = noise * predicted.noise_precision < LOUDER
        is_clean = quiet and not (
            interfered.any() or raised_rows(left.real**2 + left.imag**2, noise).any()
        )
        if is_clean or noise > SETTLED * before:
            break
    drowned = not 0.0 < noise * predicted.noise_precision < DROWNED
    is_usable = not drowned and interfered.mean() <= MOST_INTERFERED
    if noise > 0.0:
        state = replace(state, noise_precision=1.0 / noise)
    return CleanFit(state, interfered, is_clean=is_clean, is_usable=is_usable)


def _fitted(
    settings: ObjectSettings,
    received: ComplexArray,
    state: SeparationState,
    used: BoolArray,
    *,
    refined: bool,
) -> SeparationState:
    """Fit the weights, and the places with them if wanted; nothing is added."""
    steps = settings.row_steps(used)  # w
    length = float(steps.mean())
    # r' = Phi alpha + w M (r - Phi alpha)
    majorised = state.object_signal + steps * np.where(used, received - state.object_signal, 0.0)
    threshold = settings.object_threshold(state.relative_noise)
    model, work = settings.model, None
    noise_precision = state.noise_precision / length
    if refined and pays_together(state, model):
        begun = replace(state, noise_precision=noise_precision)
        work = nearby_workspace(begun, majorised, model, threshold, estimates_noise=False)
    if work is None:
        work = object_workspace(state, majorised, noise_precision, model, threshold)
        if refined:
            work.update_components()
    return replace(state, objects=work.components(), object_signal=work.signal)


def _interfered(left: ComplexArray, missing: BoolArray) -> BoolArray:
    """(P, N) samples far above the median power of what is left."""
    louder = examined(left, missing).louder
    return np.zeros(left.shape, np.bool_) if louder is None else louder


def _noise_power(samples: ComplexArray) -> float:
    """Mean power of noise by its median, which louder samples hardly raise."""
    return usual_power(samples.real**2 + samples.imag**2) if len(samples) else np.nan
