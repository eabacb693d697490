"""Objects of a sequence that accelerate: predicted, fitted, and taken off the frame.

Their Doppler frequencies are predicted by how they changed or, after one frame, by their
curvatures. All predicted objects are fitted to the samples that are no louder than noise allows,
and every one that accelerates is moved to where it explains most beside the others. What is left is
a frame of objects that do not accelerate.
"""

from dataclasses import replace
from typing import Final, NamedTuple

import numpy as np

from vsep._typing import BoolArray, ComplexArray, FloatArray
from vsep.inference.accelerating import AcceleratingFit, accelerating_fits, without_fits
from vsep.inference.core.state import ObjectComponents, SeparationState
from vsep.signal.atoms import line_factors
from vsep.signal.chirped_atoms import (
    ChirpedPoint,
    best_chirped_point,
    chirped_factors,
    chirped_products,
    chirped_signals,
    refined,
)
from vsep.signal.template import SignalModel
from vsep.tracking.interfered_samples import examined

ROUNDS: Final = 3  # of the fit of all weights, and of the places of those that accelerate
FITS: Final = 2  # of the weights in a round, where samples are left out
FADED: Final = 0.5  # of the power before: an object that is not where it was predicted
REACH_CELLS: Final = 2.5  # in which it is looked for
RIDGE: Final = 1e-9  # of a unit-norm atom: objects at one place


class TakenOff(NamedTuple):
    """Objects that accelerate, and what they leave."""

    fits: list[AcceleratingFit]
    predicted: SeparationState  #: of the other objects


def taken_off(received: ComplexArray, predicted: SeparationState, model: SignalModel) -> TakenOff:
    """Fit the objects that accelerate to a frame.

    Parameters
    ----------
    received : (A P, N) complex
        The frame.
    predicted : SeparationState
        See `vsep.tracking.prediction.predicted_state`.
    model : SignalModel
        Size of the frame; objects stay in their range cells.
    """
    objects = predicted.objects
    rest = replace(predicted, objects=without_fits(objects))
    fits = accelerating_fits(objects, model.num_antennas)
    if not fits:
        return TakenOff([], rest)
    rows = received.reshape(model.num_antennas, *model.shape)
    used = _quiet(rows)
    points = np.stack([objects.beats, objects.dopplers, _curvatures(objects)], axis=1)
    bent = np.flatnonzero(_curvatures(objects))
    weights = np.zeros((len(points), len(rows)), dtype=np.complex128)
    for number in range(ROUNDS):
        weights = _fitted_weights(rows, points, used, weights)
        signals = chirped_signals(points, weights, model.shape)
        left = np.where(used, rows - signals.sum(axis=0), 0.0)
        for index, fit in zip(bent, fits, strict=True):
            own = left + signals[index]
            place = refined(ChirpedPoint(*points[index]), own)
            power = float(np.sum(abs(chirped_products(place, own)) ** 2))
            if number == 0 and power < FADED * float(np.sum(abs(fit.amplitudes) ** 2)):
                place = best_chirped_point(place.beat, points[index, 1], own, REACH_CELLS)
            points[index] = place
        used = _quiet(rows - signals.sum(axis=0))
    weights = _fitted_weights(rows, points, used, weights)
    new = [
        fit._replace(point=ChirpedPoint(*points[index]), amplitudes=weights[index])
        for index, fit in zip(bent, fits, strict=True)
    ]
    return TakenOff(new, rest)


def _curvatures(objects: ObjectComponents) -> FloatArray:
    return np.zeros(objects.num_components) if objects.curvatures is None else objects.curvatures


def _quiet(rows: ComplexArray) -> BoolArray:
    """Tell the samples (A, P, N) that are no louder than the usual ones."""
    louder = examined(rows.reshape(-1, rows.shape[-1])).louder
    return np.ones(rows.shape, np.bool_) if louder is None else ~louder.reshape(rows.shape)


def _fitted_weights(
    rows: ComplexArray, points: FloatArray, used: BoolArray, weights: ComplexArray
) -> ComplexArray:
    """Weights (K, A) of atoms at points (K, 3) by least squares, on majorised frames."""
    across = line_factors(points[:, 0], rows.shape[2])
    along = chirped_factors(points[:, 1], points[:, 2], rows.shape[1])
    gram = (across.conj() @ across.T) * (along.conj() @ along.T) + RIDGE * np.eye(len(points))
    for _ in range(1 if used.all() else FITS):
        signal = (weights.T[:, None, :] * along.T) @ across
        left = np.where(used, rows - signal, 0.0) / used.mean()
        products = np.einsum("apk,kp->ka", left @ across.conj().T, along.conj())
        weights = weights + np.linalg.solve(gram, products)
    return weights
