"""Energies of rows, summed over antennas where there are several."""

import numpy as np

from vsep._typing import ComplexArray, FloatArray


def squared_norms(rows: ComplexArray) -> FloatArray:
    """(P,) energies of the rows of a (P, N) array, or (A, P) of an (A, P, N) array."""
    return np.asarray(np.vecdot(rows, rows).real)


def sum_of_antennas(powers: FloatArray) -> FloatArray:
    """(B, N) of powers (B, N) or (A, B, N)."""
    return np.asarray(powers.sum(axis=0)) if powers.ndim == 3 else powers


def row_energies(rows: ComplexArray) -> FloatArray:
    """(B,) energies of the rows of B ramps, (B, N) or, summed over antennas, (A, B, N).

    Examples
    --------
    >>> row_energies(np.array([[3.0, 4.0j], [0.0, 1.0]])).tolist()
    [25.0, 1.0]
    """
    energies = squared_norms(rows)
    return np.asarray(energies.sum(axis=0)) if rows.ndim == 3 else energies
