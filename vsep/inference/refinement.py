"""How object components move: the cost (70) of one of them, and a joint step of all, (67).

The cost of moving one component is ``J(zeta) = -log D + lambda^2 |q|^2 / D`` with
``D = lambda + gamma - lambda^2 v^H C v``, ``v = Phi^H phi(zeta)`` and ``q = phi^H (r - Phi mu)``,
where Phi, C and mu belong to the *other* components. Its derivatives need only moments
``sum (j 2 pi n)^a (j 2 pi p)^b ...`` of the residual.
"""

from dataclasses import dataclass

import numpy as np
from scipy.linalg import LinAlgError

from vsep._arrays import BoolArray, ComplexArray, FloatArray
from vsep.inference.sbl import ActiveSet
from vsep.signal.atoms import (
    Factors,
    gram,
    gram_between,
    line_factors,
    moved_atoms,
    project,
)

NO_GAIN = 1e-6  # nats of log evidence: a step that promises less is not tried
MAX_STEP_CELLS = 0.25  # longest Newton step, in resolution cells 1/N and 1/P
# (beat, Doppler) derivative orders of the rows of a jet: value, gradient, Hessian
_JET_ORDERS = ((0, 0), (1, 0), (0, 1), (2, 0), (1, 1), (0, 2))


@dataclass(frozen=True, slots=True, eq=False)
class CostJet:
    """Value, gradient (2,) and Hessian (2, 2) of (70) at one point (beat, doppler)."""

    value: float
    gradient: FloatArray
    hessian: FloatArray


def _derivative_columns(frequency: float, length: int) -> ComplexArray:
    """(3, M) unit-norm line centred at mid-ramp, with its first and second derivative."""
    centred = np.arange(length) - 0.5 * (length - 1)
    rotation = -2j * np.pi * centred
    line = np.exp(rotation * frequency) / np.sqrt(length)
    return np.stack([line, rotation * line, rotation**2 * line])


def cost_jet(
    point: FloatArray,
    precision: float,
    residual: ComplexArray,
    others: ActiveSet,
    other_factors: Factors,
) -> CostJet:
    """Cost (70) of one component with analytic gradient and Hessian.

    Parameters
    ----------
    point : (2,) float
        Beat and Doppler frequency.
    precision : float
        Prior precision gamma of the component; zero for a new one.
    residual : (P, N) complex
        Received signal minus the interference estimate.
    others : ActiveSet
        Posterior of the L other components.
    other_factors : tuple of (L, N) and (L, P) complex
        Their beat and Doppler factors.
    """
    num_ramps, num_samples = residual.shape
    beat_columns = _derivative_columns(point[0], num_samples)
    doppler_columns = _derivative_columns(point[1], num_ramps)
    # moments[a, b]: a-th beat and b-th Doppler derivative of phi^H r
    moments = (residual @ beat_columns.conj().T).T @ doppler_columns.conj().T
    if len(others):
        beat_products = other_factors[0].conj() @ beat_columns.T
        doppler_products = other_factors[1].conj() @ doppler_columns.T
        moments = moments - np.einsum(
            "la,lb,l->ab", beat_products.conj(), doppler_products.conj(), others.amplitudes
        )
        # rows: v, v_beat, v_doppler, v_beat_beat, v_beat_doppler, v_doppler_doppler
        jet = np.stack([beat_products[:, a] * doppler_products[:, b] for a, b in _JET_ORDERS])
        weighted = jet[:3] @ others.covariance.T
        overlap = (jet.conj() @ weighted.T).real
    else:
        overlap = np.zeros((6, 3))
    noise_precision = others.noise_precision
    return _assemble_jet(moments, overlap, noise_precision, precision)


def _assemble_jet(
    moments: ComplexArray, overlap: FloatArray, noise_precision: float, precision: float
) -> CostJet:
    """Put value, gradient and Hessian of ``-log D + lambda^2 |q|^2 / D`` together."""
    squared = noise_precision**2
    inner = moments[0, 0]
    first = np.array([moments[1, 0], moments[0, 1]])
    second = np.array([[moments[2, 0], moments[1, 1]], [moments[1, 1], moments[0, 2]]])
    power = squared * abs(inner) ** 2
    power_first = 2.0 * squared * (inner.conjugate() * first).real
    power_second = (
        2.0 * squared * (np.outer(first, first.conj()).real + (inner.conjugate() * second).real)
    )
    schur = max(noise_precision + precision - squared * overlap[0, 0], 1e-12 * noise_precision)
    schur_first = -2.0 * squared * overlap[1:3, 0]
    crossed = overlap[1:3, 1:3]
    curved = np.array([[overlap[3, 0], overlap[4, 0]], [overlap[4, 0], overlap[5, 0]]])
    schur_second = -2.0 * squared * (curved + 0.5 * (crossed + crossed.T))
    ratio = power / schur
    gradient = (power_first - (1.0 + ratio) * schur_first) / schur
    hessian = (
        power_second
        - (1.0 + ratio) * schur_second
        - (np.outer(power_first, schur_first) + np.outer(schur_first, power_first)) / schur
        + (1.0 + 2.0 * ratio) * np.outer(schur_first, schur_first) / schur
    ) / schur
    return CostJet(float(ratio - np.log(schur)), gradient, hessian)


def refine_point(
    point: FloatArray,
    precision: float,
    residual: ComplexArray,
    others: ActiveSet,
    other_factors: Factors,
    *,
    max_steps: int,
) -> FloatArray:
    """Climb (70) by safeguarded Newton steps; the cost never falls.

    Where the Hessian is not negative definite the step follows the gradient, scaled by the
    curvature of an isolated line.
    """
    shape = np.array(residual.shape[::-1], dtype=np.float64)
    free = shape > 1  # a single ramp has no Doppler frequency
    longest = MAX_STEP_CELLS / shape
    current = cost_jet(point, precision, residual, others, other_factors)
    for _ in range(max_steps):
        step = _newton_step(current, free, shape)
        step *= min(1.0, float(np.min(longest / np.maximum(np.abs(step), 1e-300))))
        if current.gradient @ step < 2.0 * NO_GAIN:
            break
        for _ in range(4):
            trial_point = point + step
            trial = cost_jet(trial_point, precision, residual, others, other_factors)
            if trial.value >= current.value:
                break
            step = 0.25 * step
        else:
            return point
        point, current = trial_point, trial
    return point


def _newton_step(jet: CostJet, free: BoolArray, shape: FloatArray) -> FloatArray:
    step = np.zeros(2)
    hessian, gradient = jet.hessian[np.ix_(free, free)], jet.gradient[free]
    determinant = hessian[0, 0] if len(gradient) == 1 else np.linalg.det(hessian)
    concave = hessian[0, 0] < 0 and (len(gradient) == 1 or determinant > 0)
    if concave:
        step[free] = -np.linalg.solve(hessian, gradient)
    else:
        curvature = np.abs(np.diagonal(hessian)) + shape[free] ** 2
        step[free] = gradient / curvature
    return step


@dataclass(frozen=True, slots=True, eq=False)
class PlacedComponents:
    """Points (L, 2) of the objects, with the factors of all columns and their posterior.

    The first L columns are the objects. Further ones, the background, keep their place while the
    objects move; the factorised separator has none, the joint one has the interference there.
    """

    points: FloatArray
    factors: Factors
    active: ActiveSet

    @property
    def background(self) -> Factors:
        """Factors of the columns that do not move."""
        count = len(self.points)
        return self.factors[0][count:], self.factors[1][count:]


def place_components(
    points: FloatArray,
    precisions: FloatArray,
    residual: ComplexArray,
    noise_precision: float,
    background: Factors | None = None,
) -> PlacedComponents:
    """Posterior of all columns with the objects at the given points.

    Parameters
    ----------
    points : (L, 2) float
        Beats and Dopplers.
    precisions : (L + M,) float
        Prior precisions of the objects, then of the background.
    residual : (P, N) complex
        Received signal minus what is not among the columns.
    noise_precision : float
        lambda.
    background : tuple of (M, N) and (M, P) complex, optional
        Separable columns that do not move.
    """
    num_ramps, num_samples = residual.shape
    factors = line_factors(points[:, 0], num_samples), line_factors(points[:, 1], num_ramps)
    if background is not None:
        factors = (
            np.concatenate([factors[0], background[0]]),
            np.concatenate([factors[1], background[1]]),
        )
    active = ActiveSet(gram(*factors), project(residual, *factors), precisions, noise_precision)
    return PlacedComponents(points, factors, active)


def joint_slopes(placed: PlacedComponents, residual: ComplexArray) -> tuple[FloatArray, FloatArray]:
    """Gradient of (67) by all beats, then (for several ramps) all Dopplers, and its curvature.

    The gradient is ``2 lambda Re{ alpha_i^* dphi_i^H (r - D w) - sum_j C_ji dphi_i^H d_j }`` over
    all columns D with weights w; the curvature is the Fisher information with those weights as
    nuisance, ``2 lambda Re{ B^H (I - lambda D C D^H) B }`` with the weighted derivatives B.
    """
    active, count = placed.active, len(placed.points)
    objects = placed.factors[0][:count], placed.factors[1][:count]
    amplitudes = active.amplitudes[:count]
    moved = moved_atoms(objects, amplitudes)
    crossed = gram_between(placed.factors, moved)
    pull = project(residual, *moved) - crossed.conj().T @ active.amplitudes
    # The uncertainty's pull acts on the derivatives of the atoms without their weights.
    weights = np.tile(amplitudes, len(pull) // count)
    moving = np.tile(np.arange(count), len(pull) // count)
    bare = crossed / weights
    pull = pull - np.einsum("ji,ji->i", active.covariance[:, moving], bare.conj())
    gradient = 2.0 * active.noise_precision * pull.real
    explained = active.noise_precision * crossed.conj().T @ active.covariance @ crossed
    return gradient, 2.0 * active.noise_precision * (gram(*moved) - explained).real


def joint_step(placed: PlacedComponents, residual: ComplexArray) -> PlacedComponents:
    """One damped Gauss-Newton step of all objects together; the joint cost never falls.

    Moving one component at a time converges slowly where several share a resolution cell; the
    Fisher information knows their coupling.
    """
    shape, active, count = residual.shape, placed.active, len(placed.points)
    if count < 2 or not np.all(active.amplitudes):
        return placed
    gradient, curvature = joint_slopes(placed, residual)
    try:
        step = np.linalg.solve(curvature, gradient)
    except LinAlgError:
        return placed  # coincident components: nothing to gain from a joint step
    if gradient @ step < 2.0 * NO_GAIN:
        return placed
    moves = np.zeros((count, 2))
    moves[:, : len(step) // count] = step.reshape(-1, count).T
    longest = float(np.max(np.abs(moves) * np.array(shape[::-1])))
    moves *= min(1.0, MAX_STEP_CELLS / max(longest, 1e-300))
    cost = active.cost()
    for _ in range(3):
        trial = place_components(
            placed.points + moves,
            active.precisions,
            residual,
            active.noise_precision,
            placed.background,
        )
        if trial.active.cost() >= cost:
            return trial
        moves = 0.25 * moves
    return placed
