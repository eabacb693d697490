"""Modified responses of cubic B-splines of the frequency.

A spline is a sum of truncated cubics ``max(f - knot, 0)^3 / 6``, whose modified responses are
iterated integrals of the kernel K: from the Fresnel integral H_0 on, integration by parts gives
``H_n = (x H_(n-1) + a H_(n-2)) / n`` at x = f - knot, with a = slope / (j 2 pi) and H_(-1) = K.
"""

import numpy as np

from vsep._typing import ComplexArray, FloatArray
from vsep.kernels.cis import cis
from vsep.kernels.compiler import compiled
from vsep.kernels.fresnel import fresnel_tail, side


@compiled
def integrals(distances: FloatArray, rate: float, table: FloatArray, rows: FloatArray) -> None:
    """Fill `rows` (5, 2, M) with H_(-1) to H_3 at M distances of frequencies from knots.

    Real and imaginary parts stand in rows of their own. H_2 and H_1 are the derivatives of H_3. All
    are right up to one cubic polynomial of the distance, which fourth differences remove. Each loop
    does one thing, so that it runs in vector registers.
    """
    scale, direction = np.sqrt(2.0 / abs(rate)), side(rate)
    kernel_real, kernel_imag, flat_real, flat_imag = rows[0, 0], rows[0, 1], rows[1, 0], rows[1, 1]
    for m in range(len(distances)):
        phase = cis(-0.25 * (distances[m] * scale) ** 2)  # kernel exp(-j pi x^2 / slope)
        # Times exp(j pi/4) / sqrt(2), for a positive rate; for a negative one all is conjugate.
        kernel_real[m] = 0.5 * (phase.real - phase.imag)
        kernel_imag[m] = 0.5 * (phase.real + phase.imag)
    for m in range(len(distances)):
        tail = fresnel_tail(abs(distances[m]) * scale, table)  # F(inf) - F(x) without its phase
        flat_real[m], flat_imag[m] = tail.real, tail.imag
    for m in range(len(distances)):
        real, imag, way = flat_real[m], flat_imag[m], side(distances[m])
        # H_0: sign(x) (1/2 - kernel tail)
        flat_real[m] = way * (0.5 - kernel_real[m] * real - kernel_imag[m] * imag)
        flat_imag[m] = direction * way * (kernel_real[m] * imag - kernel_imag[m] * real)
    for m in range(len(distances)):
        kernel_real[m] *= scale
        kernel_imag[m] *= direction * scale
    a = -rate / (2.0 * np.pi)  # its imaginary part
    for n in range(1, 4):
        next_real, next_imag, share = rows[n + 1, 0], rows[n + 1, 1], 1.0 / n
        last_real, last_imag = rows[n, 0], rows[n, 1]
        before_real, before_imag = rows[n - 1, 0], rows[n - 1, 1]
        for m in range(len(distances)):
            # Re (x H_(n-1) + a H_(n-2)) / n
            next_real[m] = share * (distances[m] * last_real[m] - a * before_imag[m])
        for m in range(len(distances)):
            next_imag[m] = share * (distances[m] * last_imag[m] + a * before_real[m])  # Im


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
    rows = np.empty((5, 2, len(knots)))
    for m in range(len(frequency)):
        integrals(frequency[m] - knots, slope[m], table, rows)
        for i in range(3):
            for k in range(len(knots)):
                # sum of jumps times H_3, H_2, H_1
                result[i, m] += jumps[k] * complex(rows[4 - i, 0, k], rows[4 - i, 1, k])
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
    rows = np.empty((5, 2, len(knots)))
    real, imag = rows[4, 0], rows[4, 1]
    for m in range(len(frequency)):
        integrals(frequency[m] - knots, slope[m], table, rows)
        for k in range(len(knots) - 4):
            outer, middle = real[k] + real[k + 4], real[k + 1] + real[k + 3]
            # Fourth difference of H_3: a cubic B-spline's response
            value = outer - 4.0 * middle + 6.0 * real[k + 2]
            outer, middle = imag[k] + imag[k + 4], imag[k + 1] + imag[k + 3]
            result[m, k] = height * complex(value, outer - 4.0 * middle + 6.0 * imag[k + 2])
    return result
