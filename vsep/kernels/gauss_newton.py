"""Damped Gauss-Newton steps in the two parameters of bursts."""

import numpy as np

from vsep._typing import FloatArray
from vsep.kernels.compiler import compiled

RIDGE = 1e-9  # relative, keeps the Newton step finite where the channel absorbs a parameter


@compiled
def newton_step(gradient: FloatArray, curvature: FloatArray) -> tuple[float, float]:
    """Solve for the two steps with a curvature (2, 2) that is ridged, by Cramer's rule.

    Without any curvature, as of a burst that has left the band, there is no step.
    """
    # Levenberg's ridge on the diagonal of the Fisher information.
    first, second = (1.0 + RIDGE) * curvature[0, 0], (1.0 + RIDGE) * curvature[1, 1]
    mixed = curvature[0, 1]
    determinant = first * second - mixed * mixed
    if determinant == 0.0:
        return 0.0, 0.0
    return (
        # F^-1 g by Cramer's rule.
        (second * gradient[0] - mixed * gradient[1]) / determinant,
        (first * gradient[1] - mixed * gradient[0]) / determinant,
    )


@compiled
def gauss_newton_steps(
    gradients: FloatArray,
    curvatures: FloatArray,
    slopes: FloatArray,
    longest: tuple[float, float],
) -> tuple[FloatArray, FloatArray]:
    """(T, 2) Gauss-Newton steps, and what each promises (T,).

    A step is no longer than ``longest[0]`` in the first parameter and ``longest[1]`` of the slope
    (T,) in the second.
    """
    steps, promises = np.empty(gradients.shape), np.empty(len(gradients))
    for i in range(len(gradients)):
        shift, stretch = newton_step(gradients[i], curvatures[i])
        # A step beyond the trust region is shortened, not turned.
        over = max(abs(shift) / longest[0], abs(stretch) / (longest[1] * abs(slopes[i])))
        scale = 1.0 / max(1.0, over)
        steps[i, 0], steps[i, 1] = scale * shift, scale * stretch
        # Gain of the quadratic model, g^T s / 2.
        promises[i] = 0.5 * scale * (gradients[i, 0] * shift + gradients[i, 1] * stretch)
    return steps, promises
