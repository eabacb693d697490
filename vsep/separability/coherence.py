"""Coherence of the two bases: the largest cosine between span Phi and span U Psi.

The atoms are made orthonormal one after another, the first object last. Its place in the Gram
matrix of what lies within span U Psi is then a border around that of the others, whose eigenvalues
are found once: the largest one of the whole solves a scalar equation.
"""

from collections.abc import Sequence

import numpy as np

from vsep._typing import ComplexArray, FloatArray
from vsep.separability.products import Products

# An atom of which less energy is left beside the others counts as one of their span.
_DEPENDENT = 1e-12
# Steps towards the root; each doubles the number of digits, from one or two on.
_STEPS = 12
_TINY = 1e-300


def coherences(own: Products, spans: Products, counts: Sequence[int]) -> FloatArray:
    """Find the largest cosines for numbers of objects.

    `own`: of the lines, B is 1; `spans`: of their parts within span U Psi; `counts`: numbers of
    objects. Returns (B, number of counts, D).
    """
    whitening = _whitening(own.among[0, 0, :, 0])
    overlap = whitening @ own.across[0, 0, :, 0]
    among = whitening @ spans.among[:, 0, :, 0] @ whitening.conj().T
    across = whitening @ spans.across[:, 0, :, 0]
    within = spans.within[:, 0, 0].real
    squares = [
        _of_some(among[:, :m, :m], across[:, :m], within, overlap[:m])
        for m in (count - 1 for count in counts)
    ]
    return np.asarray(np.sqrt(np.clip(np.stack(squares, axis=1), 0.0, 1.0)))


def largest_bordered(among: ComplexArray, border: ComplexArray, corner: FloatArray) -> FloatArray:
    """Find the largest eigenvalues of Hermitian matrices with one row and column more.

    `among` (B, M, M); `border` (B, M, D): D different columns to put at the right; `corner` (B, D).
    Returns (B, D).

    Examples
    --------
    >>> import numpy as np
    >>> largest_bordered(np.zeros((1, 1, 1)), np.full((1, 1, 1), 2.0), np.zeros((1, 1))).round(9)
    array([[2.]])
    """
    if among.shape[1] == 0:
        return corner
    strengths, directions = np.linalg.eigh(among)
    shares = np.abs(directions.conj().swapaxes(1, 2) @ border) ** 2
    top, rest = strengths[:, -1:], strengths[:, :-1, None]
    root = _two_by_two(top, corner, shares[:, -1])
    # What the others add to the corner is convex in the root: from below, its tangent never
    # leads beyond.
    for _ in range(_STEPS):
        gap = np.maximum(root[:, None] - rest, _TINY)
        terms = shares[:, :-1] / gap
        slope = 1.0 + np.sum(terms / gap, axis=1)
        level = corner + np.sum(terms, axis=1) + (slope - 1.0) * root
        root = _two_by_two(top, level / slope, shares[:, -1] / slope)
    return root


def _two_by_two(first: FloatArray, second: FloatArray, square: FloatArray) -> FloatArray:
    """Larger eigenvalue of a matrix of two rows."""
    half = 0.5 * (first - second)
    return np.asarray(0.5 * (first + second) + np.sqrt(half * half + square))


def _of_some(
    among: ComplexArray, across: ComplexArray, within: FloatArray, overlap: ComplexArray
) -> FloatArray:
    """Squares of the cosines with some of the other objects, all of them orthonormal."""
    left = 1.0 - np.sum(np.abs(overlap) ** 2, axis=0)
    scale = np.where(left > _DEPENDENT, 1.0 / np.sqrt(np.maximum(left, _DEPENDENT)), 0.0)
    known = among @ overlap
    border = (across - known) * scale
    corner = within - np.sum((overlap.conj() * (2.0 * across - known)).real, axis=1)
    return largest_bordered(among, border, corner * scale**2)


def _whitening(gram: ComplexArray) -> ComplexArray:
    """Lower triangular matrix that makes atoms orthonormal one after another."""
    factor = np.zeros_like(gram)
    for row in range(len(gram)):
        solved = factor[:row, :row] @ gram[:row, row]
        left = gram[row, row].real - np.sum(np.abs(solved) ** 2)
        if left > _DEPENDENT:
            factor[row, :row] = -(solved.conj() @ factor[:row, :row]) / np.sqrt(left)
            factor[row, row] = 1.0 / np.sqrt(left)
    return factor
