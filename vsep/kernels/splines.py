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
def truncated_cubics(
    offsets: FloatArray, rate: float, table: FloatArray, terms: ComplexArray
) -> ComplexArray:
    """Fill (3, K) `terms` with H_3, H_2 and H_1 at distances (K,) from the knots.

    H_2 and H_1 are the derivatives of H_3. All are right up to one cubic polynomial of the
    distance, which fourth differences remove. Each loop does one thing, so that it runs in vector
    registers.
    """
    phases, rests = terms[1], terms[2]
    scale = np.sqrt(2.0 / abs(rate))
    for k in range(len(offsets)):
        phases[k] = turn(-0.25 * (offsets[k] * scale) ** 2)
    for k in range(len(offsets)):
        rests[k] = fresnel_rest(abs(offsets[k]) * scale, table)
    # For a positive rate; for a negative one all is conjugate.
    curvature = -abs(rate) / (2.0 * np.pi)  # imaginary part of a
    direction = side(rate)
    for k in range(len(offsets)):
        x, way, phase, rest = offsets[k], side(offsets[k]), phases[k], rests[k]
        # The phase times exp(j pi/4) / sqrt(2), and H_0 from it.
        real, imag = 0.5 * (phase.real - phase.imag), 0.5 * (phase.real + phase.imag)
        flat_real = way * (0.5 - real * rest.real - imag * rest.imag)
        flat_imag = way * (real * rest.imag - imag * rest.real)
        first_real = x * flat_real - curvature * scale * imag
        first_imag = x * flat_imag + curvature * scale * real
        second_real = 0.5 * (x * first_real - curvature * flat_imag)
        second_imag = 0.5 * (x * first_imag + curvature * flat_real)
        third_real = (x * second_real - curvature * first_imag) / 3.0
        third_imag = (x * second_imag + curvature * first_real) / 3.0
        terms[0, k] = complex(third_real, direction * third_imag)
        terms[1, k] = complex(second_real, direction * second_imag)
        terms[2, k] = complex(first_real, direction * first_imag)
    return terms


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
    terms = np.empty((3, len(knots)), dtype=np.complex128)
    for m in range(len(frequency)):
        truncated_cubics(frequency[m] - knots, slope[m], table, terms)
        for i in range(3):
            for k in range(len(knots)):
                result[i, m] += jumps[k] * terms[i, k]
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
    terms = np.empty((3, len(knots)), dtype=np.complex128)
    for m in range(len(frequency)):
        cubics = height * truncated_cubics(frequency[m] - knots, slope[m], table, terms)[0]
        for k in range(len(knots) - 4):
            outer, middle = cubics[k] + cubics[k + 4], cubics[k + 1] + cubics[k + 3]
            result[m, k] = outer - 4.0 * middle + 6.0 * cubics[k + 2]
    return result
