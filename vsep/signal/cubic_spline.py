"""A clamped cubic spline of complex values with compact support.

`scipy.interpolate` offers one too, but importing it takes longer than all the rest of vsep.
"""

import numpy as np
from scipy.linalg import solve_banded

from vsep._typing import ComplexArray, FloatArray


class CubicSpline:
    """Interpolant with two continuous derivatives, of slope zero at both ends and zero beyond.

    Parameters
    ----------
    knots : (M,) float
        Strictly ascending, at least two.
    values : (M,) complex
        Values at the knots.

    Examples
    --------
    >>> import numpy as np
    >>> spline = CubicSpline(np.array([0.0, 1.0, 2.0]), np.array([0.0, 1.0, 0.0]))
    >>> spline.jet(np.array([0.5, 1.0, 3.0]))[0].real
    array([0.5, 1. , 0. ])
    """

    def __init__(self, knots: FloatArray, values: ComplexArray) -> None:
        self.knots = knots
        self._values = np.asarray(values, dtype=np.complex128)
        self._curvatures = _curvatures(knots, self._values)

    def jet(self, position: FloatArray) -> tuple[ComplexArray, ComplexArray, ComplexArray]:
        """Evaluate the spline and its first two derivatives, zero outside of the knots."""
        clipped = np.clip(position, self.knots[0], self.knots[-1])
        piece = np.searchsorted(self.knots[1:-1], clipped, side="right")
        width = self.knots[piece + 1] - self.knots[piece]
        right = (clipped - self.knots[piece]) / width
        left = 1.0 - right
        low, high = self._values[piece], self._values[piece + 1]
        bend_low, bend_high = self._curvatures[piece], self._curvatures[piece + 1]
        inside = clipped == position
        value = left * low + right * high
        value += ((left**3 - left) * bend_low + (right**3 - right) * bend_high) * width**2 / 6.0
        first = (high - low) / width
        first += (
            ((3.0 * right**2 - 1.0) * bend_high - (3.0 * left**2 - 1.0) * bend_low) * width / 6.0
        )
        second = left * bend_low + right * bend_high
        value, first, second = np.where(inside, (value, first, second), 0.0)
        return value, first, second


def _curvatures(knots: FloatArray, values: ComplexArray) -> ComplexArray:
    """(M,) second derivatives at the knots, from the tridiagonal system of continuous slopes."""
    width = np.diff(knots)
    chord = np.diff(values) / width
    bands = np.zeros((3, len(knots)))
    bands[0, 1:] = width
    bands[1, :-1] += 2.0 * width
    bands[1, 1:] += 2.0 * width
    bands[2, :-1] = width
    # Slope zero at both ends: the chords beyond them count as flat.
    turn = np.diff(np.concatenate([[0.0], chord, [0.0]]))
    return np.asarray(solve_banded((1, 1), bands, 6.0 * turn), dtype=np.complex128)
