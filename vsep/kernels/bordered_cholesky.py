"""Bordered Cholesky inverses of information matrices that grow by a parameter or an object.

With the inverse Cholesky factor R of the leading block, a next row a with corner c adds the row
``[-(R a)^T R, 1] / sqrt(c - |R a|^2)``. The first rows of R belong to the leading block whatever
follows, so that one R serves all numbers of objects.
"""

import numpy as np

from vsep._typing import FloatArray
from vsep.kernels.compiler import compiled

# What is left of a parameter's unit information is at least this: below it there is rounding.
_MIN_PIVOT = 1e-14


@compiled
def inverse_triangles(matrices: FloatArray) -> FloatArray:
    """Invert the Cholesky factors of symmetric matrices with a diagonal of about one.

    Parameters
    ----------
    matrices : (B, M, M) float
        The lower triangle counts.

    Returns
    -------
    (B, M, M) float
        R, lower triangular, with ``R^T R`` the inverse.
    """
    num_matrices, size = matrices.shape[:2]
    factors = np.zeros((num_matrices, size, size))
    solved = np.empty(size)
    for b in range(num_matrices):
        for i in range(size):
            pivot = matrices[b, i, i]
            for j in range(i):
                value = 0.0
                for k in range(j + 1):
                    value += factors[b, j, k] * matrices[b, i, k]  # R a, entry j
                solved[j] = value
                pivot -= value * value  # c - |R a|^2
            scale = 1.0 / np.sqrt(max(pivot, _MIN_PIVOT))
            for j in range(i):
                weight = scale * solved[j]
                for k in range(j + 1):
                    factors[b, i, k] -= weight * factors[b, j, k]  # -(R a)^T R / sqrt(pivot)
            factors[b, i, i] = scale
    return factors


@compiled
def _downdate(row: FloatArray, left: FloatArray) -> None:
    """Subtract the squares of a (Q, D) row of ``R a`` from (Q, Q, D) matrices."""
    for i in range(row.shape[0]):
        for j in range(i + 1):
            for d in range(row.shape[1]):
                # Schur complement of the last object's information
                left[i, j, d] -= row[i, d] * row[j, d]


@compiled
def _invert_triangle(matrices: FloatArray, factors: FloatArray, d: int) -> None:
    """Invert the Cholesky factor of one of (Q, Q, D) matrices, as `inverse_triangles` does."""
    for i in range(matrices.shape[0]):
        pivot = matrices[i, i, d]
        for k in range(i):
            factors[i, k, d] = 0.0
        for j in range(i):
            value = 0.0
            for k in range(j + 1):
                value += factors[j, k, d] * matrices[i, k, d]
            pivot -= value * value
            for k in range(j + 1):
                factors[i, k, d] -= value * factors[j, k, d]
        scale = 1.0 / np.sqrt(max(pivot, _MIN_PIVOT))
        for k in range(i):
            factors[i, k, d] *= scale
        factors[i, i, d] = scale


@compiled
def _add_squares(factors: FloatArray, row: FloatArray, total: FloatArray) -> None:
    """Add the squared lengths of factors times the columns of a (Q, D) row."""
    for i in range(row.shape[0]):
        for d in range(row.shape[1]):
            value = 0.0
            for j in range(i + 1):
                value += factors[i, j, d] * row[j, d]
            total[d] += value * value  # more variance of the parameters before


@compiled
def last_variances(
    reduced: FloatArray, moved: FloatArray, within: FloatArray, weights: FloatArray
) -> FloatArray:
    """Sum what one more object adds to variances: its own, and more of those before it.

    Parameters
    ----------
    reduced : (B, M, Q, D) float
        ``R a`` of the Q parameters of each of D objects that may come last.
    moved : (B, W, Q, D) float
        ``R^T R a``, those of the W parameters whose variances count, times their weights.
    within : (B, Q, Q, D) float
        Information about the parameters of the last object.
    weights : (Q, D) float
        Of the squared deviations of its parameters; zero for what does not count.

    Returns
    -------
    (B, D) float
    """
    num_matrices, size, num_own, num_last = reduced.shape
    total = np.zeros((num_matrices, num_last))
    left = np.empty((num_own, num_own, num_last))
    factor = np.zeros((num_own, num_own, num_last))
    for b in range(num_matrices):
        # Information of the last object less what the others explain
        left[:] = within[b]
        for m in range(size):
            _downdate(reduced[b, m], left)
        for d in range(num_last):
            _invert_triangle(left, factor, d)
        for i in range(num_own):
            for j in range(i + 1):
                for d in range(num_last):
                    # Its own variances: squared lengths of the columns of R
                    total[b, d] += weights[j, d] * factor[i, j, d] ** 2
        for m in range(moved.shape[1]):
            _add_squares(factor, moved[b, m], total[b])
    return total
