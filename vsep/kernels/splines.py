"""What a chirp makes of cubic B-splines of the frequency: their modified responses.

A spline is a sum of truncated cubics ``max(f - knot, 0)^3 / 6``, whose modified responses are
iterated integrals of the kernel K: from the Fresnel integral H_0 on, integration by parts gives
``H_n = (x H_(n-1) + a H_(n-2)) / n`` at x = f - knot, with a = slope / (j 2 pi) and H_(-1) = K.
"""

import numpy as np

from vsep._arrays import ComplexArray, FloatArray
from vsep.kernels.compiler import compiled
from vsep.kernels.fresnel import fresnel_rest, side
from vsep.kernels.turns import turn


@compiled
def integrals(distances: FloatArray, rate: float, table: FloatArray, rows: ComplexArray) -> None:
    """Fill `rows` (5, M) with H_(-1) to H_3 at M distances of frequencies from knots.

    H_2 and H_1 are the derivatives of H_3. All are right up to one cubic polynomial of the
    distance, which fourth differences remove. Each loop does one thing, so that it runs in vector
    registers.
    """
    scale, direction = np.sqrt(2.0 / abs(rate)), side(rate)
    for m in range(len(distances)):
        rows[0, m] = turn(-0.25 * (distances[m] * scale) ** 2)
    for m in range(len(distances)):
        rows[1, m] = fresnel_rest(abs(distances[m]) * scale, table)
    for m in range(len(distances)):
        phase, rest, way = rows[0, m], rows[1, m], side(distances[m])
        # Times exp(j pi/4) / sqrt(2), for a positive rate; for a negative one all is conjugate.
        real, imag = 0.5 * (phase.real - phase.imag), 0.5 * (phase.real + phase.imag)
        flat_real = way * (0.5 - real * rest.real - imag * rest.imag)
        flat_imag = way * (real * rest.imag - imag * rest.real)
        rows[0, m] = complex(scale * real, direction * scale * imag)
        rows[1, m] = complex(flat_real, direction * flat_imag)
    a = -rate / (2.0 * np.pi)  # its imaginary part
    for n in range(1, 4):
        share = 1.0 / n
        for m in range(len(distances)):
            x, last, before = distances[m], rows[n, m], rows[n - 1, m]
            rows[n + 1, m] = complex(
                share * (x * last.real - a * before.imag),
                share * (x * last.imag + a * before.real),
            )


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
    rows = np.empty((5, len(knots)), dtype=np.complex128)
    for m in range(len(frequency)):
        integrals(frequency[m] - knots, slope[m], table, rows)
        for i in range(3):
            for k in range(len(knots)):
                result[i, m] += jumps[k] * rows[4 - i, k]
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
    rows = np.empty((5, len(knots)), dtype=np.complex128)
    cubics = rows[4]
    for m in range(len(frequency)):
        integrals(frequency[m] - knots, slope[m], table, rows)
        for k in range(len(knots) - 4):
            outer, middle = cubics[k] + cubics[k + 4], cubics[k + 1] + cubics[k + 3]
            result[m, k] = height * (outer - 4.0 * middle + 6.0 * cubics[k + 2])
    return result
