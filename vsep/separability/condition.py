"""Condition (27) in both readings, for numbers of objects and delays of the first one."""

from collections.abc import Sequence

import numpy as np

from vsep._typing import FloatArray
from vsep.separability.objects import ObjectTable
from vsep.units import to_db

_TINY = 1e-300


def conditions(
    table: ObjectTable, met: FloatArray, counts: Sequence[int]
) -> tuple[FloatArray, FloatArray]:
    """Evaluate both readings of (27) at SIR 0 dB.

    Parameters
    ----------
    table : ObjectTable
        Lines of all objects.
    met : (B, U) float
        ``|phi^H U Psi beta|^2`` over the energy of the interference.
    counts : sequence of int
        Numbers of objects.

    Returns
    -------
    whole_db, weakest_db : (B, number of counts, D) float
    """
    num_others, powers = table.num_others, np.abs(table.amplitudes) ** 2
    met = np.maximum(met, _TINY)
    others, last = met[:, :num_others], met[:, num_others:]
    # Row number n belongs to n other objects.
    total = _leading(np.cumsum(others, axis=1), 0.0)
    weakest = _leading(np.minimum.accumulate(powers[:num_others] / others, axis=1), np.inf)
    whole_db, weakest_db = [], []
    for count in counts:
        energy, own = _own_projections(table, count - 1)
        whole = own / (energy * (total[:, count - 1, None] + last))
        each = np.minimum(weakest[:, count - 1, None], powers[num_others:] / last) / energy
        whole_db.append(to_db(whole))
        weakest_db.append(to_db(each))
    return np.stack(whole_db, axis=1), np.stack(weakest_db, axis=1)


def _leading(values: FloatArray, first: float) -> FloatArray:
    """Put a column in front."""
    return np.concatenate([np.full((len(values), 1), first), values], axis=1)


def _own_projections(table: ObjectTable, num_others: int) -> tuple[FloatArray, FloatArray]:
    """(D,) energies of the object signal, and of its projections Phi^H Phi alpha."""
    weights = table.amplitudes[:num_others, None]
    last = table.amplitudes[table.num_others :]
    among = table.products.among[0, 0, :num_others, 0, :num_others]
    across = table.products.across[0, 0, :num_others, 0]
    projected = among @ weights + across * last
    # Atoms have unit norm.
    at_last = np.sum(across.conj() * weights, axis=0) + last
    energy = np.sum(weights.conj() * projected, axis=0) + last.conj() * at_last
    return energy.real, np.sum(np.abs(projected) ** 2, axis=0) + np.abs(at_last) ** 2
