"""Samples that were never received, and ramps that begin elsewhere than the file does.

A capture card fills lost packets with zeros. A converter's noise makes single zeros, never a long
run of them.
"""

from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from vsep._typing import BoolArray, ComplexArray, FloatArray

LEAST_RUN: Final = 32  # words
LEAST_SAMPLES: Final = 16  # complex samples
QUIET_SHARE: Final = 0.5  # of zeros outside of runs, where a converter sees hardly any noise
_ORDER = 8  # of the prediction within a ramp
_MOST_FITTED = 2**16  # samples from which a prediction is learnt
_TELLING = 8.0  # how many times the usual the prediction's error is where a ramp begins


def zero_runs(values: NDArray[Any], least: int = LEAST_RUN) -> BoolArray | None:
    """Find runs of exact zeros.

    Parameters
    ----------
    values : (W,) array
        Words or samples in the order in which they came.
    least : int
        Length from which a run counts.

    Returns
    -------
    (W,) bool or None
        None where there is none, or where zeros are what the converter mostly gives.

    Examples
    --------
    >>> words = np.ones(100)
    >>> words[40:80] = 0
    >>> int(zero_runs(words).sum()), zero_runs(words[:60])
    (40, None)
    """
    zero = np.concatenate([[False], values == 0, [False]])
    edges = np.flatnonzero(zero[1:] != zero[:-1])
    starts, ends = edges[::2], edges[1::2]
    long = ends - starts >= least
    if not long.any():
        return None
    steps = np.zeros(values.size + 1, dtype=np.int64)
    steps[starts[long]] += 1
    steps[ends[long]] -= 1
    runs = np.cumsum(steps[:-1]) > 0
    others = values[~runs]
    if others.size == 0 or np.mean(others == 0) > QUIET_SHARE:
        return None
    return np.asarray(runs)


def leading_zeros(words: NDArray[Any]) -> int:
    """Return how many words at the start are zero."""
    present = np.flatnonzero(words)
    return int(present[0]) if present.size else 0


def remark_of_missing(missing: BoolArray) -> str:
    """Say how much is missing and what becomes of it."""
    ramps = int(np.count_nonzero(missing.any(axis=(1, 2))))
    return (
        f"{np.count_nonzero(missing)} samples ({missing.mean():.1%}) in {ramps} of "
        f"{len(missing)} ramps were lost: runs of exact zeros, packets that are not in the "
        "file, or words at full scale. The frame file names them as missing, and estimators leave "
        "them out."
    )


def prediction_error(courses: NDArray[Any], order: int) -> FloatArray:
    """Power of what so many samples before a sample do not tell of it, by one linear prediction.

    Parameters
    ----------
    courses : (R, W) complex or real
        Samples of receivers in the order in which they came; the mean over them counts.
    order : int
        Of the prediction, far fewer than W.

    Returns
    -------
    (W - order,) float
        From the first sample on that has so many before it.
    """
    windows = np.lib.stride_tricks.sliding_window_view(courses, order + 1, axis=-1)
    step = -(-windows.shape[0] * windows.shape[1] // _MOST_FITTED)
    fitted = windows[:, ::step].reshape(-1, order + 1)
    past, present = fitted[:, :order], fitted[:, order]
    gram = past.conj().T @ past
    gram += np.eye(order) * (1e-9 * np.trace(gram).real + 1e-300)
    weights = np.linalg.solve(gram, past.conj().T @ present)
    error = np.abs(windows[..., order] - windows[..., :order] @ weights) ** 2
    return np.asarray(error.mean(axis=0))


def samples_before_ramp(samples: ComplexArray, num_samples: int) -> int:
    """Return how many samples precede the first start of a ramp.

    Where a ramp begins, the samples before predict nothing: the error of a linear prediction,
    folded over the ramp's length, has a peak there.

    Parameters
    ----------
    samples : (W,) complex or real
        Samples of one receiver after the other.
    num_samples : int
        Of a ramp.

    Returns
    -------
    int
        Zero also where the samples do not tell.
    """
    count = samples.size // num_samples
    if count < 4 or num_samples < 4 * _ORDER:
        return 0
    error = prediction_error(samples[None, : min(count * num_samples, 2**16 + _ORDER)], _ORDER)
    whole = len(error) // num_samples
    if whole < 3:
        return 0
    folded = np.median(error[: whole * num_samples].reshape(whole, num_samples), axis=0)
    around = np.mean([np.roll(folded, -shift) for shift in range(_ORDER)], axis=0)
    usual = float(np.median(around))
    place = int(np.argmax(around))
    if usual <= 0.0 or around[place] < _TELLING * usual:
        return 0
    # The first sample that is predicted badly
    loud = np.roll(folded, -place)[:_ORDER] > _TELLING * usual
    return (place + int(np.argmax(loud)) + _ORDER) % num_samples
