"""What a chirp makes of cubic B-splines of the frequency: their modified responses.

A spline is a sum of truncated cubics ``max(f - knot, 0)^3 / 6``, whose modified responses are
iterated integrals of the kernel K: from the Fresnel integral H_0 on, integration by parts gives
``H_n = (x H_(n-1) + a H_(n-2)) / n`` at x = f - knot, with a = slope / (j 2 pi) and H_(-1) = K.
"""

import numpy as np

from vsep._arrays import ComplexArray, FloatArray
from vsep.kernels.compiler import compiled
from vsep.kernels.fresnel import side, signed_rest
from vsep.kernels.turns import turn

THIRD = 1.0 / 3.0  # dividing a complex number costs more than all the rest of a cubic


@compiled
def truncated_cubic(
    x: float, rate: float, scale: float, table: FloatArray
) -> tuple[complex, complex, complex]:
    """Return H_3 at a distance from the knot, and its first two derivatives H_2 and H_1.

    `scale` is ``sqrt(2 / |rate|)``. They are right up to one cubic polynomial of the distance,
    which fourth differences remove.
    """
    direction = side(rate)
    factor = complex(0.5, 0.5 * direction)  # exp(j pi/4 sgn slope) / sqrt(2)
    curvature = complex(0.0, -rate / (2.0 * np.pi))
    phase = factor * turn(-0.25 * direction * (x * scale) ** 2)
    rest = signed_rest(x * scale, table)
    if direction > 0.0:
        rest = rest.conjugate()
    flat = 0.5 * side(x) - phase * rest
    second = x * flat + curvature * scale * phase
    first = 0.5 * (x * second + curvature * flat)
    return THIRD * (x * first + curvature * second), first, second


@compiled
def spline_terms(
    frequency: FloatArray,
    slope: FloatArray,
    knots: FloatArray,
    jumps: ComplexArray,
    table: FloatArray,
) -> ComplexArray:
    """Return the modified response of one spline and its two derivatives by the frequency.

    Parameters
    ----------
    frequency, slope : (M,) float
        Where to evaluate; the slope is not zero.
    knots : (K,) float
    jumps : (K,) complex
        Of the spline's third derivative at the knots.
    table : array
        `SMOOTH`.

    Returns
    -------
    (3, M) complex
        Value, first and second derivative.
    """
    result = np.zeros((3, len(frequency)), dtype=np.complex128)
    for m in range(len(frequency)):
        scale = np.sqrt(2.0 / abs(slope[m]))
        for k in range(len(knots)):
            value, first, second = truncated_cubic(frequency[m] - knots[k], slope[m], scale, table)
            result[0, m] += jumps[k] * value
            result[1, m] += jumps[k] * first
            result[2, m] += jumps[k] * second
    return result


@compiled
def bspline_terms(
    frequency: FloatArray, slope: FloatArray, knots: FloatArray, table: FloatArray
) -> ComplexArray:
    """(M, K - 4) modified responses of all cubic B-splines on equidistant knots.

    Parameters
    ----------
    frequency, slope : (M,) float
        Where to evaluate; the slope is not zero.
    knots : (K,) float
    table : array
        `SMOOTH`.
    """
    height = 1.0 / (knots[1] - knots[0]) ** 3
    result = np.empty((len(frequency), len(knots) - 4), dtype=np.complex128)
    cubics = np.empty(len(knots), dtype=np.complex128)
    for m in range(len(frequency)):
        scale = np.sqrt(2.0 / abs(slope[m]))
        for k in range(len(knots)):
            cubics[k] = height * truncated_cubic(frequency[m] - knots[k], slope[m], scale, table)[0]
        for k in range(len(knots) - 4):
            outer, middle = cubics[k] + cubics[k + 4], cubics[k + 1] + cubics[k + 3]
            result[m, k] = outer - 4.0 * middle + 6.0 * cubics[k + 2]
    return result
