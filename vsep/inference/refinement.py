"""How object components move: the cost (70) of one of them, and a joint step of all, (67)."""

from dataclasses import dataclass

import numpy as np
from scipy.linalg import LinAlgError

from vsep._arrays import ComplexArray, FloatArray
from vsep.inference.antennas import (
    SharedSet,
    as_shared_columns,
    climb_shared,
    project_all,
    shared_slopes,
)
from vsep.inference.sbl import ActiveSet
from vsep.kernels import climbing, lines
from vsep.kernels.climbing import MAX_STEP_CELLS, NO_GAIN
from vsep.kernels.lines import Columns, CostJet
from vsep.kernels.shared_cost import shared_cost_jet
from vsep.signal.atoms import (
    Factors,
    gram,
    gram_between,
    line_factors,
    moved_atoms,
    project,
)


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
    residual : (P, N) or (A, P, N) complex
        Received signal minus the interference estimate, of one antenna or several.
    others : ActiveSet
        Posterior of the L other components.
    other_factors : tuple of (L, N) and (L, P) complex
        Their beat and Doppler factors.
    """
    if isinstance(others, SharedSet):
        columns = as_shared_columns(others, other_factors)
        return shared_cost_jet(point[0], point[1], precision, residual, columns)
    return lines.cost_jet(
        point[0], point[1], precision, residual, as_columns(others, other_factors)
    )


def as_columns(active: ActiveSet, factors: Factors) -> Columns:
    """Return what the kernels take of an active set."""
    return Columns(*factors, active.covariance, active.amplitudes, active.noise_precision)


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
    curvature of an isolated line. Arguments as for `cost_jet`.
    """
    if isinstance(others, SharedSet):
        shared = as_shared_columns(others, other_factors)
        return climb_shared(point, precision, residual, shared, max_steps=max_steps)[0]
    start = cost_jet(point, precision, residual, others, other_factors)
    moved, columns = point.copy(), as_columns(others, other_factors)
    climbing.climb(moved, start, max_steps, precision, residual, columns)
    return moved


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
    residual : (P, N) or (A, P, N) complex
        Received signal minus what is not among the columns, of one antenna or several.
    noise_precision : float
        lambda.
    background : tuple of (M, N) and (M, P) complex, optional
        Separable columns that do not move.
    """
    num_ramps, num_samples = residual.shape[-2:]
    factors = line_factors(points[:, 0], num_samples), line_factors(points[:, 1], num_ramps)
    if background is not None:
        factors = (
            np.concatenate([factors[0], background[0]]),
            np.concatenate([factors[1], background[1]]),
        )
    if residual.ndim == 3:
        products = project_all(residual, factors)
        shared = SharedSet(gram(*factors), products, precisions, noise_precision)
        return PlacedComponents(points, factors, shared)
    active = ActiveSet(gram(*factors), project(residual, *factors), precisions, noise_precision)
    return PlacedComponents(points, factors, active)


def joint_slopes(placed: PlacedComponents, residual: ComplexArray) -> tuple[FloatArray, FloatArray]:
    """Gradient of (67) by all beats, then (for several ramps) all Dopplers, and its curvature.

    The gradient is ``2 lambda Re{ alpha_i^* dphi_i^H (r - D w) - sum_j C_ji dphi_i^H d_j }`` over
    all columns D with weights w; the curvature is the Fisher information with those weights as
    nuisance, ``2 lambda Re{ B^H (I - lambda D C D^H) B }`` with the weighted derivatives B.
    """
    active, count = placed.active, len(placed.points)
    if isinstance(active, SharedSet):
        return shared_slopes(active, placed.factors, residual)
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
    shape, active, count = residual.shape[-2:], placed.active, len(placed.points)
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
