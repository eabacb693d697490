"""Objects fitted to the samples that hold no interference, before any burst is modelled.

With the places of the objects predicted, their weights are a linear fit. Samples that it leaves far
above the noise are interfered; the fit is repeated without them, on a majorised frame as in
`vsep.inference.objects.masked`. What remains says whether there is interference at all.
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy import ndimage
from scipy.special import gammainccinv

from vsep._typing import BoolArray, ComplexArray, FloatArray
from vsep.inference.bursts.sample_weights import sample_weights
from vsep.inference.core.state import SeparationState
from vsep.inference.objects.dithered import DitheredWorkspace
from vsep.inference.objects.object_only import ObjectSettings
from vsep.inference.objects.workspace import ObjectThreshold, ObjectWorkspace
from vsep.signal.dithered_atoms import RampDither
from vsep.units import from_db

FITS = 3  # of the weights alone, at the predicted places, where samples are left out
MOST_REFINEMENTS = 12  # of places and weights ...
SETTLED = 0.97  # ... as long as each leaves less than this share of the noise power before
MOST_INTERFERED = 0.4  # of the samples: beyond, the median does not tell the noise
WINDOWS = (8, 32, 128)  # samples: a burst of about such a length raises the mean power in one
RAISED_CHANCE = 1e-7  # with which the mean power of noise in a window is more than allowed
LOUDER = 1.5  # times the last frame's noise: something may cover most of the samples
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
    interfered = _unexplained(received, missing)
    if interfered.any():
        for _ in range(FITS):
            state = _fitted(settings, received, state, ~(interfered | missing), refined=False)
        interfered = _unexplained(received - state.object_signal, missing)
    for _ in range(MOST_REFINEMENTS):
        if interfered.mean() > MOST_INTERFERED:
            break
        used = ~(interfered | missing)
        state = _fitted(settings, received, state, used, refined=True)
        left = np.where(missing, 0.0, received - state.object_signal)
        before, noise = noise, _noise_power(left[used])
        interfered = _unexplained(left, missing)
        quiet = noise * predicted.noise_precision < LOUDER
        is_clean = quiet and not (interfered.any() or _is_raised(left, noise))
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
    threshold = ObjectThreshold(float(from_db(settings.threshold_db)), state.relative_noise)
    dithered = isinstance(settings.model.migration, RampDither)
    work = (DitheredWorkspace if dithered else ObjectWorkspace)(
        state.objects,
        majorised,
        state.noise_precision / length,
        threshold=threshold,
        next_id=state.next_component_id,
        num_antennas=settings.model.num_antennas,
        migration=settings.model.migration,
    )
    if refined:
        work.update_components()
    return replace(state, objects=work.components(), object_signal=work.signal)


def _unexplained(left: ComplexArray, missing: BoolArray) -> BoolArray:
    """(P, N) samples far above the median power of what is left."""
    nothing = np.zeros_like(left)
    weights = sample_weights(np.where(missing, 0.0, left), nothing, nothing, fitted=True)
    if weights is None:
        return np.zeros(left.shape, np.bool_)
    return np.asarray(weights.values == 0.0)


def _noise_power(samples: ComplexArray) -> float:
    """Mean power of noise by its median, which louder samples hardly raise."""
    return float(np.median(samples.real**2 + samples.imag**2) / np.log(2.0))


def _is_raised(left: ComplexArray, noise: float) -> bool:
    """Whether the mean power in any window along a ramp is more than that of noise.

    A long weak burst raises no sample by much.
    """
    power: FloatArray = left.real**2 + left.imag**2
    for length in (*WINDOWS, left.shape[1]):
        if length > left.shape[1]:
            continue
        means = ndimage.uniform_filter1d(power, length, axis=1, mode="nearest")
        inner = means[:, length // 2 : left.shape[1] - (length - 1) // 2]
        # the sum of that many exponential variables follows a Gamma law
        if inner.max() > noise * float(gammainccinv(length, RAISED_CHANCE)) / length:
            return True
    return False
