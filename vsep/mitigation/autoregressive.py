"""Autoregressive models of a frame: what they predict, and gaps filled by them.

All ramps share one model ``x[n] = sum_k c_k x[n - k] + e[n]``, k from 1 to the order, as the
objects' beat frequencies are the same in all of them. Lines satisfy the mirrored, conjugated model
as well; prediction runs both ways.
"""

from functools import partial
from typing import NamedTuple

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from vsep._typing import BoolArray, ComplexArray, FloatArray
from vsep._validation import require_range
from vsep.mitigation.direct import DirectMitigation
from vsep.mitigation.entry import time_domain_entry
from vsep.mitigation.method import FrameArray

ORDER = 8  # of the repair: higher orders follow the noise and sometimes fail badly
_RIDGE = 1e-9  # of the mean energy: keeps the normal equations solvable without changing them


def autoregressive(order: int = ORDER) -> DirectMitigation:
    """Make interpolation by a model of `order` coefficients, 1 to 256, pooled over the ramps."""
    require_range("order", order, 1, 256)
    return DirectMitigation("autoregressive", partial(predicted_gaps, order=order))


def fit_coefficients(received: FrameArray, mask: BoolArray, order: int) -> ComplexArray:
    """Fit one model to every stretch of ``order + 1`` clean samples, forwards and backwards.

    `received` (P, N): the frame; `mask` (P, N): True where a sample is not to be used; `order`:
    less than N. Returns (order,): coefficients c_1 ...; zero where no stretch is long enough.
    """
    windows = sliding_window_view(np.where(mask, 0.0, received), order + 1, axis=1)
    clean = ~sliding_window_view(mask, order + 1, axis=1).any(axis=2)
    stretches = windows[clean]
    if len(stretches) == 0:
        return np.zeros(order, dtype=np.complex128)
    both = np.concatenate([stretches, stretches[:, ::-1].conj()])
    latest, earlier = both[:, -1], both[:, -2::-1]
    gram = earlier.conj().T @ earlier
    ridge = _RIDGE * np.trace(gram).real / order + np.finfo(np.float64).tiny
    gram[np.diag_indices(order)] += ridge
    return np.asarray(np.linalg.solve(gram, earlier.conj().T @ latest))


class PredictionErrors(NamedTuple):
    """Errors (P, N) of the predictions from earlier and from later samples; NaN where too few."""

    forward: ComplexArray
    backward: ComplexArray


def prediction_errors(received: FrameArray, coefficients: ComplexArray) -> PredictionErrors:
    """Predict every sample from the `order` ones before it, and from those after it."""
    forward = _forward_errors(received, coefficients)
    # Backwards the model is that of the conjugated ramp in reversed time.
    backward = _forward_errors(received[:, ::-1].conj(), coefficients)[:, ::-1].conj()
    return PredictionErrors(forward, backward)


def _forward_errors(received: FrameArray, coefficients: ComplexArray) -> ComplexArray:
    order = len(coefficients)
    errors = np.full(received.shape, np.nan, dtype=np.complex128)
    windows = sliding_window_view(received, order + 1, axis=1)
    errors[:, order:] = windows @ np.concatenate([-coefficients[::-1], [1.0]])
    return errors


def predicted_gaps(received: FrameArray, mask: BoolArray, order: int = ORDER) -> FrameArray:
    """Fill the gaps so that the prediction errors of the whole ramp are least.

    The least-squares interpolation of Janssen, Veldhuis and Vries, with forward and backward errors
    and a model fitted once to the clean samples. A ramp without a clean sample becomes zero.

    Examples
    --------
    >>> frame = np.exp(-2j * np.pi * 0.1 * np.arange(32))[None]
    >>> mask = (np.arange(32) // 4 == 3)[None]
    >>> bool(np.allclose(predicted_gaps(np.where(mask, 5.0, frame), mask), frame, atol=1e-5))
    True
    """
    repaired = np.where(mask, received.dtype.type(0), received)
    num_samples = received.shape[1]
    order = min(order, num_samples - 1)
    if order == 0:
        return repaired
    weights = _error_energy(fit_coefficients(received, mask, order), num_samples)
    for ramp in np.flatnonzero(mask.any(axis=1)):
        flagged, clean = np.flatnonzero(mask[ramp]), np.flatnonzero(~mask[ramp])
        within = weights[np.ix_(flagged, flagged)]
        pull = weights[np.ix_(flagged, clean)] @ received[ramp, clean]
        repaired[ramp, flagged] = -np.linalg.solve(within, pull)
    return repaired


def _error_energy(coefficients: ComplexArray, num_samples: int) -> ComplexArray:
    """(N, N) matrix H with x^H H x the energy of all prediction errors of a ramp x."""
    order = len(coefficients)
    row = np.concatenate([-coefficients[::-1], [1.0]])
    predictor = np.zeros((num_samples - order, num_samples), dtype=np.complex128)
    for start in range(num_samples - order):
        predictor[start, start : start + order + 1] = row
    forward = predictor.conj().T @ predictor
    energy = forward + forward[::-1, ::-1].conj()
    ridge: FloatArray = _RIDGE * np.trace(energy).real / num_samples * np.eye(num_samples)
    return np.asarray(energy + ridge)


ENTRIES = (
    time_domain_entry(
        "autoregressive",
        "Autoregressive interpolation",
        40,
        "Gaps are filled by an autoregressive model pooled over the ramps.",
        autoregressive,
    ),
)
