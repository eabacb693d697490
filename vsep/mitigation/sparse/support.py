"""Least squares on a support: the part that greedy methods and debiasing share.

The Gram matrix of two sets of cells is the spectrum of the mask at their differences, so that one
FFT of the mask gives all of it; for large supports conjugate gradients need no matrix at all.
"""

import numpy as np

from vsep._typing import BoolArray
from vsep.mitigation.sparse.operators import Samples, SensingOperator

_RELATIVE_RESIDUAL = 1e-7  # of conjugate gradients: below the noise by far


def least_squares(
    operator: SensingOperator,
    measured: Samples,
    support: BoolArray,
    *,
    first: Samples | None = None,
    max_iterations: int = 60,
) -> Samples:
    """Minimise ||y - A x|| over spectra that are zero outside of a support.

    Conjugate gradients on the normal equations. The eigenvalues of A^H A lie in [0, 1] and those
    of a sparse support far from zero, so a few ten iterations do.

    Parameters
    ----------
    operator : SensingOperator
        A.
    measured : complex
        y, in the operator's form.
    support : bool
        Cells that may differ from zero, in the operator's form.
    first : complex, optional
        Where to start; zero if left out.
    max_iterations : int
        At most this many masked residual updates.

    Returns
    -------
    complex
        The spectrum x.
    """
    zero = np.zeros(1, dtype=measured.dtype)
    solution = np.zeros(support.shape, dtype=measured.dtype)
    if first is not None:
        solution = np.where(support, first, zero)
    gradient = np.where(support, operator.adjoint(measured - operator.forward(solution)), zero)
    direction = gradient
    power = float(np.vdot(gradient, gradient).real)
    limit = _RELATIVE_RESIDUAL**2 * float(np.vdot(measured, measured).real)
    for _ in range(max_iterations):
        if power <= limit:
            break
        image = operator.forward(direction)
        step = power / float(np.vdot(image, image).real)
        solution = solution + step * direction
        gradient = gradient - step * np.where(support, operator.adjoint(image), zero)
        previous, power = power, float(np.vdot(gradient, gradient).real)
        direction = gradient + (power / previous) * direction
    return solution
