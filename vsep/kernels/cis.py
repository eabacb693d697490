"""Fast complex exponentials ``exp(j 2 pi x)`` for all other kernels."""

import numpy as np

from vsep.kernels.compiler import compiled

# Taylor coefficients of sin(2 pi x)/x and cos(2 pi x) in x^2; |x| <= 1/8, error below 1e-16.
_S0, _S1, _S2, _S3, _S4, _S5, _S6, _S7 = (
    (-1) ** k * (2.0 * np.pi) ** (2 * k + 1) / float(np.prod(np.arange(1.0, 2 * k + 2)))
    for k in range(8)
)
_C1, _C2, _C3, _C4, _C5, _C6, _C7, _C8 = (
    (-1) ** k * (2.0 * np.pi) ** (2 * k) / float(np.prod(np.arange(1.0, 2 * k + 1)))
    for k in range(1, 9)
)


@compiled
def cis(cycles: float) -> complex:
    """Return ``exp(j 2 pi cycles)`` to rounding of `cycles`, without a branch.

    Examples
    --------
    >>> abs(cis(0.25) - 1j) < 1e-15
    True
    """
    # Argument reduction to |x| <= 1/8 of a cycle around the nearest quarter.
    quarter = np.rint(4.0 * cycles)
    remainder = cycles - 0.25 * quarter
    square = remainder * remainder
    # Horner's scheme in x^2 for sin(2 pi x) = x (S0 + S1 x^2 + ...)
    sine = _S6 + square * _S7
    sine = _S3 + square * (_S4 + square * (_S5 + square * sine))
    sine = remainder * (_S0 + square * (_S1 + square * (_S2 + square * sine)))
    # and for cos(2 pi x) = 1 + C1 x^2 + ...
    cosine = _C6 + square * (_C7 + square * _C8)
    cosine = _C3 + square * (_C4 + square * (_C5 + square * cosine))
    cosine = 1.0 + square * (_C1 + square * (_C2 + square * cosine))
    # Rotation back by the quarters: exchange of the parts, then signs.
    quadrant = int(quarter - 4.0 * np.floor(0.25 * quarter))
    swapped = quadrant % 2 == 1
    real = sine if swapped else cosine
    imag = cosine if swapped else sine
    return complex(
        -real if 1 <= quadrant <= 2 else real,
        -imag if quadrant >= 2 else imag,
    )
