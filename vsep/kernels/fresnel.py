"""Fresnel integrals, and the modified response of a raised cosine in terms of them.

With ``F(x) = C(x) + j S(x)`` and x >= 0 the tail is

    F(inf) - F(x) = exp(j pi x^2 / 2) W(x),   W(x) = (1 + j)/2 w(sqrt(pi)/2 (1 + j) x),

w being the Faddeeva function. W has no oscillation: polynomials on equal pieces of 1/(1 + x)
reproduce it to 1e-15.
"""

import numpy as np
from scipy.special import wofz

from vsep._typing import ComplexArray, FloatArray
from vsep.kernels.cis import cis
from vsep.kernels.compiler import compiled

PIECES = 512
DEGREE = 4


def _smooth_table() -> FloatArray:
    """(PIECES, DEGREE + 1, 2) coefficients of W by ascending powers, from -1 to 1 on each piece."""
    # Chebyshev nodes of each piece
    nodes = np.cos(np.pi * (np.arange(DEGREE + 1) + 0.5) / (DEGREE + 1))
    place = (np.arange(PIECES)[:, None] + 0.5 * (1.0 + nodes)) / PIECES
    argument = 0.5 * np.sqrt(np.pi) * (1.0 + 1.0j) * (1.0 / place - 1.0)
    values = (0.5 + 0.5j) * wofz(argument)  # W(x)
    powers = nodes[:, None] ** np.arange(DEGREE + 1)
    coefficients = np.linalg.solve(powers, values.T).T
    return np.stack([coefficients.real, coefficients.imag], axis=2)


SMOOTH = _smooth_table()


@compiled
def fresnel_tail(distance: float, table: FloatArray) -> complex:
    """Smooth part W of the Fresnel integral, for a distance of at least zero; `table` is SMOOTH."""
    place = PIECES / (1.0 + distance)  # equal pieces of 1/(1 + x)
    piece = min(int(place), PIECES - 1)
    local = 2.0 * (place - piece) - 1.0
    real, imag = table[piece, DEGREE, 0], table[piece, DEGREE, 1]
    for power in range(DEGREE - 1, -1, -1):
        real = real * local + table[piece, power, 0]  # Horner's scheme
        imag = imag * local + table[piece, power, 1]
    return complex(real, imag)


@compiled
def signed_tail(position: float, table: FloatArray) -> complex:
    """Tail of the integral beyond a place on either side of zero, with the sign of that side."""
    tail = fresnel_tail(abs(position), table)
    return tail if position >= 0.0 else -tail


@compiled
def side(distance: float) -> float:
    """Return the sign of a distance, plus one at zero."""
    return 1.0 if distance >= 0.0 else -1.0


@compiled
def _edge_tails(
    frequency: float, rate: float, inner: float, outer: float, table: FloatArray
) -> tuple[complex, complex, complex]:
    """Sum what the edges add to the flat part and to the taper's two exponentials."""
    inverse = 1.0 / abs(rate)
    # Limits of Fresnel integrals: x = (e - f) sqrt(2/|slope|)
    scale = np.sqrt(2.0 * inverse)
    shift = 0.5 * rate / (outer - inner)
    flat = rising = falling = 0.0j
    for edge in range(4):
        outward = 1.0 if edge < 2 else -1.0
        distance = outward * (inner if edge % 2 else outer) - frequency
        # exp(j pi (e - f)^2 / |slope|), the same for all three
        phase = outward * cis(0.5 * distance * distance * inverse)
        flat += phase * signed_tail(distance * scale, table)
        rising += phase * signed_tail((distance - shift) * scale, table)
        falling += phase * signed_tail((distance + shift) * scale, table)
    if rate > 0.0:  # a positive slope has the conjugate kernel
        return flat.conjugate(), rising.conjugate(), falling.conjugate()
    return flat, rising, falling


@compiled
def _taper_steps(frequency: float, shift: float, inner: float, outer: float) -> complex:
    """Phase of the rising exponential within the shifted tapers, and zero elsewhere."""
    right = side(outer - frequency - shift) - side(inner - frequency - shift)
    left = side(-inner - frequency - shift) - side(-outer - frequency - shift)
    at_inner = cis(-0.5 * inner / (outer - inner))
    return right * at_inner + left * at_inner.conjugate()


@compiled
def raised_cosine_terms(
    frequency: FloatArray, slope: FloatArray, inner: float, outer: float, table: FloatArray
) -> ComplexArray:
    """Evaluate the modified response of a raised cosine and its two derivatives by the frequency.

    The response is one half inside of +-outer, one half more inside of +-inner, and in each taper
    the cosine's two exponentials, which shift the Fresnel integrals' limits by half the slope over
    the taper's width. An edge e of these intervals adds the phase ``exp(-j pi (e - f)^2 / slope)``
    times smooth functions, the same phase for all of them.

    Parameters
    ----------
    frequency : (B, M) float
        Where to evaluate.
    slope : (B, 1) float
        Not zero.
    inner, outer : float
        End of the flat part and of the taper.
    table : array
        `SMOOTH`.

    Returns
    -------
    (3, B, M) complex
        Value, first and second derivative.
    """
    result = np.empty((3, *frequency.shape), dtype=np.complex128)
    per_cycle = 0.5 / (outer - inner)
    angular = 2.0 * np.pi * per_cycle
    for b in range(frequency.shape[0]):
        rate = slope[b, 0]
        shift = rate * per_cycle
        # exp(j pi sgn(slope) / 4) / sqrt(2) / 2 in front of every integral
        kernel = complex(0.25, 0.25 * side(rate))
        common = 0.125 * cis(0.5 * per_cycle * shift)
        for m in range(frequency.shape[1]):
            f = frequency[b, m]
            flat, rising, falling = _edge_tails(f, rate, inner, outer, table)
            # Limits of the integrals at infinity: constants between the edges
            steps = side(outer - f) + side(inner - f) - side(-inner - f) - side(-outer - f)
            value = 0.25 * steps - kernel * flat
            taper = cis(per_cycle * f)
            rising *= 0.5 * kernel
            rising += common * taper * _taper_steps(f, shift, inner, outer)
            falling *= 0.5 * kernel
            falling += common * (taper * _taper_steps(f, -shift, inner, outer)).conjugate()
            # Gbar; each taper is a pair of exponentials, so derivatives multiply by +-j angular.
            result[0, b, m] = value + rising + falling
            result[1, b, m] = 1j * angular * (rising - falling)
            result[2, b, m] = -angular * angular * (rising + falling)
    return result
