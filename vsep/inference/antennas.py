"""Objects that several antennas see: one place and one prior for all, a weight for each.

The columns and their prior precisions are the same at every antenna, so that the weights of all
have one covariance; antennas multiply what is learnt of places and precisions. Nothing is assumed
of how the weights of one object belong together: neither where the antennas are nor how they are
calibrated. Sparse Bayesian learning of Sec. III-C with several snapshots, as D. Wipf and B. Rao
(IEEE Trans. Signal Processing 55(7), 2007) have it.
"""

import numpy as np

from vsep._arrays import BoolArray, ComplexArray, FloatArray
from vsep.inference.sbl import ActiveSet, converged_precision
from vsep.kernels.climbing import NO_GAIN, TRIALS, newton_or_gradient_step
from vsep.kernels.lines import LEAST_SCHUR, Columns, CostJet
from vsep.kernels.shared_cost import shared_cost_jet
from vsep.signal.atoms import (
    Factors,
    gram,
    gram_between,
    line_factors,
    moved_atoms,
    project,
    synthesize,
)


class SharedSet(ActiveSet):
    """Weight posterior of columns that A antennas share; ``projections`` is (K, A).

    ``covariance`` (K, K) is that of the weights at one antenna, ``amplitudes`` (K, A) has all.
    """

    @property
    def num_antennas(self) -> int:
        """Number of antennas A."""
        return int(self.projections.shape[1])

    def refresh(self) -> None:
        """Recompute covariance and means, (58)-(59)."""
        super().refresh()
        if len(self) == 0:
            self.amplitudes = np.zeros(self.projections.shape, dtype=np.complex128)

    def without(self, index: int) -> "SharedSet":
        """Posterior of the other components as if component `index` were not there."""
        keep = np.arange(len(self)) != index
        return SharedSet(
            self.gram[np.ix_(keep, keep)],
            self.projections[keep],
            self.precisions[keep],
            self.noise_precision,
        )

    def cost(self) -> float:
        """Log evidence of the non-linear parameters, (67) summed over the antennas."""
        fit = np.vdot(self.projections, self.amplitudes).real
        return self.num_antennas * self.log_determinant + self.noise_precision * float(fit)

    def trace(self) -> float:
        """tr(A C A^H) of all antennas."""
        return self.num_antennas * super().trace()


def project_all(signals: ComplexArray, factors: Factors) -> ComplexArray:
    """(L, A) inner products of the signals (A, P, N) with every atom."""
    return np.stack([project(signal, *factors) for signal in signals], axis=1)


def synthesize_all(amplitudes: ComplexArray, factors: Factors) -> ComplexArray:
    """Object signals (A, P, N) of the weights (L, A)."""
    return np.stack([synthesize(weights, *factors) for weights in amplitudes.T])


def as_shared_columns(active: ActiveSet, factors: Factors) -> Columns:
    """Return what the kernels take; they keep the weights of one antenna together."""
    amplitudes = np.ascontiguousarray(active.amplitudes.T)
    return Columns(*factors, active.covariance, amplitudes, active.noise_precision)


def climb_shared(
    point: FloatArray, precision: float, residual: ComplexArray, others: Columns, *, max_steps: int
) -> tuple[FloatArray, CostJet]:
    """Climb the cost of one component by safeguarded Newton steps; the cost never falls.

    Parameters
    ----------
    point : (2,) float
        Where to start.
    precision : float
        Prior precision of the component.
    residual : (A, P, N) complex
        Received signals minus the interference estimate.
    others : Columns
        The other components.
    max_steps : int
        Steps at most.

    Returns
    -------
    (2,) float and CostJet
        Where it ended, and the cost there.
    """
    moved = point.copy()
    current = shared_cost_jet(moved[0], moved[1], precision, residual, others)
    for _ in range(max_steps):
        step = np.array(newton_or_gradient_step(current, residual.shape[2], residual.shape[1]))
        if current.by_beat * step[0] + current.by_doppler * step[1] < 2.0 * NO_GAIN:
            break
        for length in 0.25 ** np.arange(TRIALS):
            beat, doppler = moved + length * step
            trial = shared_cost_jet(beat, doppler, precision, residual, others)
            if trial.value >= current.value:
                break
        else:
            break
        moved, current = np.array([beat, doppler]), trial
    return moved, current


def update_shared(
    points: FloatArray,
    active: SharedSet,
    residual: ComplexArray,
    threshold: float,
) -> tuple[FloatArray, FloatArray, BoolArray, FloatArray]:
    """Loop of Algorithm 3: move, test and re-weigh or prune every component in turn.

    Parameters
    ----------
    points : (L, 2) float
        Beat and Doppler frequencies.
    active : SharedSet
        Posterior of their weights.
    residual : (A, P, N) complex
        Received signals minus the interference estimate.
    threshold : float
        T, linear; the sum of the antennas' ratios is compared with it.

    Returns
    -------
    points : (L, 2) float
    precisions : (L,) float
    kept : (L,) bool
    ratios : (L,) float
        Activation ratio of each when its turn came.
    """
    shape = residual.shape[1:]
    points, precisions = points.copy(), active.precisions.copy()
    kept, ratios = np.ones(len(points), dtype=np.bool_), np.zeros(len(points))
    beat_lines, doppler_lines = frame_factors(points, shape)
    correlations, products = active.gram.copy(), active.projections.copy()
    for index in range(len(points)):
        others = np.flatnonzero(kept & (np.arange(len(points)) != index))
        posterior = SharedSet(
            correlations[np.ix_(others, others)],
            products[others],
            precisions[others],
            active.noise_precision,
        )
        columns = as_shared_columns(posterior, (beat_lines[others], doppler_lines[others]))
        moved, jet = climb_shared(
            points[index], float(precisions[index]), residual, columns, max_steps=1
        )
        if jet.inverse_rho > LEAST_SCHUR * active.noise_precision:
            ratios[index] = jet.power / jet.inverse_rho
        if ratios[index] <= threshold:
            kept[index] = False
            continue
        rho = 1.0 / jet.inverse_rho
        points[index] = moved
        precisions[index] = converged_precision(rho, ratios[index] * rho / active.num_antennas)
        own = frame_factors(points[index : index + 1], shape)
        beat_lines[index], doppler_lines[index] = own[0][0], own[1][0]
        correlations[:, index] = gram_between((beat_lines, doppler_lines), own)[:, 0]
        correlations[index] = correlations[:, index].conj()
        products[index] = project_all(residual, own)[0]
    return points, precisions, kept, ratios


def frame_factors(points: FloatArray, shape: tuple[int, ...]) -> Factors:
    """Beat (L, N) and Doppler (L, P) factors of points (L, 2) in frames of shape (P, N)."""
    return line_factors(points[:, 0], shape[1]), line_factors(points[:, 1], shape[0])


def shared_slopes(
    active: SharedSet, factors: Factors, residual: ComplexArray
) -> tuple[FloatArray, FloatArray]:
    """Gradient of (67), summed over the antennas, by beats, then Dopplers, and its curvature.

    The gradient is ``2 lambda Re{ sum_a alpha_ia^* dphi_i^H (r_a - Phi alpha_a) - A sum_j C_ji
    dphi_i^H phi_j }``; the curvature is the Fisher information with all weights as nuisance.

    Parameters
    ----------
    active : SharedSet
        Posterior of the weights.
    factors : (L, N) and (L, P) complex
        The components.
    residual : (A, P, N) complex
        Received signals minus the interference estimate.
    """
    count = len(active)
    moved = moved_atoms(factors, np.ones(count, dtype=np.complex128))
    crossed = gram_between(factors, moved)
    moving = np.tile(np.arange(count), len(moved[0]) // count)
    weights = active.amplitudes[moving]
    innovation = project_all(residual, moved) - crossed.conj().T @ active.amplitudes
    pull = np.sum(weights.conj() * innovation, axis=1)
    spread = np.einsum("ji,ji->i", active.covariance[:, moving], crossed.conj())
    gradient = 2.0 * active.noise_precision * (pull - active.num_antennas * spread).real
    explained = active.noise_precision * crossed.conj().T @ active.covariance @ crossed
    together = weights.conj() @ weights.T
    curvature = 2.0 * active.noise_precision * (together * (gram(*moved) - explained)).real
    return gradient, curvature
