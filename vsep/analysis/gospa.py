"""GOSPA metric between sets of estimated and true lines, with its components.

Rahmathullah, Garcia-Fernandez and Svensson, "Generalized optimal sub-pattern assignment metric",
FUSION 2017, with alpha = 2: over all partial assignments gamma of estimates to truths

    GOSPA^p = min_gamma sum_{(i, j) in gamma} d_ij^p + c^p / 2 (|X| - |gamma| + |Y| - |gamma|).

Distances are in resolution cells, 1/N cycles per sample and 1/P cycles per ramp, and go around the
unit circle. The paper leaves cut-off and order open; one cell and order 1 are the defaults here.
"""

from dataclasses import dataclass

import numpy as np
from scipy.optimize import linear_sum_assignment

from vsep._typing import FloatArray, IntArray
from vsep._validation import require_range
from vsep.errors import InputError
from vsep.units import wrap_frequency

DEFAULT_CUTOFF = 1.0  # resolution cells
DEFAULT_ORDER = 1.0


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class Gospa:
    """The metric, its three parts and the assignment behind it."""

    value: float  #: GOSPA, in resolution cells
    #: the three addends of ``value ** order``
    localisation: float
    missed: float
    false: float
    #: truths and estimates that stay alone
    num_missed: int
    num_false: int
    #: (A,) the assigned pairs, in the order of the truths
    true_indices: IntArray
    found_indices: IntArray
    distances: FloatArray  #: (A,) their distances, all below the cut-off


def cell_distances(true: FloatArray, found: FloatArray, shape: tuple[int, int]) -> FloatArray:
    """Euclidean distances between lines in resolution cells, around the unit circle.

    Parameters
    ----------
    true : (L, 2) float
        Normalised beat and Doppler frequencies.
    found : (K, 2) float
        The same of the estimates.
    shape : tuple of int
        (P, N).

    Returns
    -------
    (L, K) float

    Examples
    --------
    >>> import numpy as np
    >>> true, found = np.array([[0.49, 0.0]]), np.array([[-0.5, 0.0]])
    >>> cell_distances(true, found, (1, 100)).round(9)
    array([[1.]])
    """
    num_ramps, num_samples = shape
    offsets = wrap_frequency(found[None, :, :] - true[:, None, :])
    return np.asarray(np.hypot(offsets[..., 0] * num_samples, offsets[..., 1] * num_ramps))


def gospa(
    distances: FloatArray, *, cutoff: float = DEFAULT_CUTOFF, order: float = DEFAULT_ORDER
) -> Gospa:
    """GOSPA with alpha = 2 from the distances of all pairs.

    A pair as far apart as the cut-off costs as much as one missed truth and one false estimate, so
    the best full assignment of distances clipped at the cut-off, without its clipped pairs, is the
    best partial assignment.

    Parameters
    ----------
    distances : (L, K) float
        Of L truths to K estimates; either may be zero.
    cutoff : float
        c, in the unit of the distances.
    order : float
        p, at least 1.

    Raises
    ------
    InputError
        If cut-off or order are out of range, or a distance is negative or undefined.

    Examples
    --------
    >>> import numpy as np
    >>> result = gospa(np.array([[0.1, 5.0]]))
    >>> round(result.value, 3), result.num_missed, result.num_false
    (0.6, 0, 1)
    """
    require_range("GOSPA cutoff", cutoff, 1e-12, 1e12)
    require_range("GOSPA order", order, 1.0, 100.0)
    if not np.all(distances >= 0.0):
        raise InputError("A distance is negative or undefined; all must be zero or more.")
    # In units of the cut-off, so that no power of it under- or overflows.
    costs = np.minimum(distances / cutoff, 1.0) ** order
    rows, columns = linear_sum_assignment(costs)
    near = distances[rows, columns] < cutoff
    rows, columns = rows[near], columns[near]
    num_true, num_found = distances.shape
    num_missed, num_false = num_true - len(rows), num_found - len(rows)
    localisation = float(np.sum(costs[rows, columns]))
    total = localisation + 0.5 * (num_missed + num_false)
    scale = cutoff**order
    return Gospa(
        value=cutoff * float(total ** (1.0 / order)),
        localisation=scale * localisation,
        missed=0.5 * scale * num_missed,
        false=0.5 * scale * num_false,
        num_missed=num_missed,
        num_false=num_false,
        true_indices=np.asarray(rows, dtype=np.int64),
        found_indices=np.asarray(columns, dtype=np.int64),
        distances=np.asarray(distances[rows, columns], dtype=np.float64),
    )
