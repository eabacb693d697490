"""Dense posteriors and moments of the reference, and how it maximises the costs (70) and (71).

The paper leaves the optimiser open ("any established constrained optimization algorithm"); these
are the steps of the estimator, written without anything of its kernels.
"""

from collections.abc import Callable
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from vsep._typing import ComplexArray, FloatArray
from vsep.inference.bursts.chirp_refinement import HALVINGS, MAX_SHIFT, MAX_STRETCH
from vsep.inference.bursts.chirp_refinement import NO_GAIN as NO_CHIRP_GAIN
from vsep.inference.bursts.chirp_search import slope_bank
from vsep.kernels.candidates import ABSORBED_SHARE, CANDIDATE_PEAKS, NEW_COMPONENT_STEPS
from vsep.kernels.gauss_newton import RIDGE
from vsep.kernels.newton_ascent import MAX_STEP_CELLS, NO_GAIN, TRIALS
from vsep.kernels.object_cost import MIN_SCHUR
from vsep.signal.template import SignalModel

MIN_LEFT = 1e-9  # of a column's energy: what the others must leave of it to be told apart


@lru_cache(maxsize=4)
def channel_atoms(model: SignalModel) -> ComplexArray:
    """(N, K) matrix Psi of all K grid bins."""
    cycles = np.outer(np.arange(model.num_samples), np.arange(model.num_grid_bins))
    atoms = np.exp(-2j * np.pi * cycles / model.num_grid_bins) / np.sqrt(model.num_samples)
    return np.asarray(atoms)


def object_atoms(points: FloatArray, shape: tuple[int, ...]) -> ComplexArray:
    """(PN, L) matrix Phi(zeta), (10), of points (L, 2): beat and Doppler frequencies."""
    p, n = np.indices(shape).reshape(2, -1)
    beats, dopplers = np.reshape(points, (-1, 2)).T
    cycles = np.outer(n, beats) + np.outer(p, dopplers)
    return np.asarray(np.exp(-2j * np.pi * cycles) / np.sqrt(shape[0] * shape[1]))


class Dictionary(NamedTuple):
    """Active columns (M, K) of a source, Phi or U Psi, and their prior precisions gamma (K,)."""

    atoms: ComplexArray
    precisions: FloatArray

    def without(self, index: int) -> "Dictionary":
        """Return the dictionary as if a column were not there."""
        return Dictionary(np.delete(self.atoms, index, axis=1), np.delete(self.precisions, index))


class WeightPosterior(NamedTuple):
    """q(w) = CN(w | mean, covariance), (57) and (60)."""

    mean: ComplexArray
    covariance: ComplexArray


def weight_posterior(
    dictionary: Dictionary, residual: ComplexArray, noise_precision: float
) -> WeightPosterior:
    """Posterior of the weights given the residual of the other source, (58)-(59) or (61)-(62)."""
    atoms, precisions = dictionary
    adjoint = atoms.conj().T
    precision_matrix = noise_precision * adjoint @ atoms + np.diag(precisions)
    covariance: ComplexArray = np.asarray(np.linalg.inv(precision_matrix))  # (59)
    return WeightPosterior(noise_precision * covariance @ (adjoint @ residual), covariance)  # (58)


def log_evidence(dictionary: Dictionary, residual: ComplexArray, noise_precision: float) -> float:
    """Cost (67) of zeta or (71) of theta: ``log|C| + lambda^2 r^H A C A^H r``."""
    mean, covariance = weight_posterior(dictionary, residual, noise_precision)
    fit = noise_precision * np.vdot(dictionary.atoms.conj().T @ residual, mean).real
    return float(np.linalg.slogdet(covariance)[1] + fit)


def moments(
    candidates: ComplexArray, others: Dictionary, residual: ComplexArray, noise_precision: float
) -> tuple[FloatArray, FloatArray]:
    """1/rho (23) and omega^2/rho (24) of candidate columns (M, Q) beside other columns."""
    mean, covariance = weight_posterior(others, residual, noise_precision)
    energy = noise_precision * np.sum(np.abs(candidates) ** 2, axis=0)  # lambda phi^H phi
    overlaps = others.atoms.conj().T @ candidates  # Phi^H phi
    explained = np.sum(overlaps.conj() * (covariance @ overlaps), axis=0).real
    inverse_rho = energy - noise_precision**2 * explained  # (23)
    innovation = candidates.conj().T @ (residual - others.atoms @ mean)  # omega / (lambda rho)
    apart = inverse_rho > MIN_LEFT * energy
    omega_over_rho = noise_precision * innovation  # (24)
    ratio = np.where(apart, np.abs(omega_over_rho) ** 2 / np.where(apart, inverse_rho, 1.0), 0.0)
    return inverse_rho, ratio


def gauss_newton_step(
    dictionary: Dictionary,
    derivatives: ComplexArray,
    residual: ComplexArray,
    noise_precision: float,
) -> tuple[FloatArray, FloatArray]:
    """Gradient (Q,) of (67) or (71) by Q parameters, and the Gauss-Newton step (Q,).

    With B = dA w the gradient is ``2 lambda Re{B^H (r - A w) - tr(C A^H dA)}``; the curvature, the
    Fisher information with the weights as nuisance, is ``2 lambda Re{B^H (I - lambda A C A^H) B}``.
    `derivatives` (Q, M, K) are dA by each parameter. Without any curvature there is no step.
    """
    atoms = dictionary.atoms
    mean, covariance = weight_posterior(dictionary, residual, noise_precision)
    moved = (derivatives @ mean).T  # B
    spread = np.einsum("ij,mj,qmi->q", covariance, atoms.conj(), derivatives).real
    gradient = (moved.conj().T @ (residual - atoms @ mean)).real - spread
    kept = moved - noise_precision * atoms @ (covariance @ (atoms.conj().T @ moved))
    curvature = (moved.conj().T @ kept).real
    curvature[np.diag_indices(len(curvature))] *= 1.0 + RIDGE
    if np.linalg.det(curvature) == 0.0:
        return 2.0 * noise_precision * gradient, np.zeros_like(gradient)
    return 2.0 * noise_precision * gradient, np.linalg.solve(curvature, gradient)


def first_that_gains(
    cost: Callable[[FloatArray], float], step: FloatArray, max_trials: int
) -> FloatArray | None:
    """Return a step, a quarter of it, ... with which the cost does not fall; None if there is none.

    `cost` is a function of the step.
    """
    before = cost(np.zeros_like(step))
    for _ in range(max_trials):
        if cost(step) >= before:
            return step
        step = 0.25 * step
    return None


@lru_cache(maxsize=4)
def chirp_dictionary(model: SignalModel) -> tuple[FloatArray, ComplexArray, FloatArray]:
    """All theta (M, 2) of the coarse grid, their templates (M, N) and the templates' energies."""
    bank = slope_bank(model)
    valid = bank.grid.inverse_energy > 0.0
    slopes, centres = np.broadcast_arrays(bank.slopes[:, None], bank.centres[None])
    parameters = np.stack([-slopes * centres, slopes], axis=2)[valid]
    atoms = model.template(parameters[:, 0].copy(), parameters[:, 1].copy())
    return parameters, atoms, np.sum(np.abs(atoms) ** 2, axis=1)


def initial_chirp(row: ComplexArray, model: SignalModel) -> FloatArray:
    """(71) of a single component on the coarse grid: theta of the largest |a^H r|^2 / |a|^2."""
    parameters, atoms, energies = chirp_dictionary(model)
    scores = np.abs(atoms.conj() @ row) ** 2 / energies
    return np.asarray(parameters[np.argmax(scores)])


def refine_chirp(
    theta: FloatArray,
    bins: list[int],
    precisions: FloatArray,
    row: ComplexArray,
    noise_precision: float,
    model: SignalModel,
) -> FloatArray:
    """Theta from (71) by one damped Gauss-Newton step in (frequency at the centre, slope)."""
    if not bins:
        return theta
    start, slope = theta
    centre = float(np.clip(-start / slope, 0, model.num_samples - 1))
    atoms = channel_atoms(model)[:, bins]
    jet = model.template_jet(start, slope, centre)
    columns = Dictionary(jet[0][:, None] * atoms, precisions)
    derivatives = jet[1][:, :, None] * atoms  # dA = dU Psi
    gradient, step = gauss_newton_step(columns, derivatives, row, noise_precision)
    longest = np.array([2.0 * MAX_SHIFT * model.normalised_cutoff, MAX_STRETCH * abs(slope)])
    step /= max(1.0, float(np.max(np.abs(step) / longest)))

    def after(step: FloatArray) -> FloatArray:
        return np.asarray(theta + np.array([step[0] - step[1] * centre, step[1]]))

    def cost(step: FloatArray) -> float:
        moved = model.template(*after(step)[:, None])[0]
        return log_evidence(Dictionary(moved[:, None] * atoms, precisions), row, noise_precision)

    if 0.5 * gradient @ step < NO_CHIRP_GAIN:
        return theta
    found = first_that_gains(cost, step, HALVINGS)
    return theta if found is None else after(found)


class ObjectCost(NamedTuple):
    """Cost (70) of one component, gradient and Hessian by beat and, of several ramps, Doppler."""

    value: float
    gradient: FloatArray
    hessian: FloatArray


def object_cost(
    zeta: FloatArray,
    precision: float,
    others: tuple[Dictionary, WeightPosterior],
    frame: ComplexArray,
    noise_precision: float,
) -> ObjectCost:
    """(70): ``lambda^2 |phi^H (r - Phi mu)|^2 / D - log D``, the Schur complement D being 1/c'.

    ``D = lambda + gamma - lambda^2 phi^H Phi C Phi^H phi``, with Phi, C, mu those of the others.
    """
    (atoms, _), (mean, covariance) = others
    axes = 2 if frame.shape[0] > 1 else 1
    by = -2j * np.pi * np.indices(frame.shape)[::-1].reshape(2, -1)[:axes]  # d phi = by * phi
    atom = object_atoms(zeta, frame.shape)[:, 0]
    jet = [atom, by * atom, by[:, None] * by * atom]  # phi and its first and second derivatives
    q, q_1, q_2 = (each.conj() @ (frame.ravel() - atoms @ mean) for each in jet)
    v, v_1, v_2 = (each.conj() @ atoms for each in jet)
    square, weighted = noise_precision**2, covariance @ v.conj()
    power = square * abs(q) ** 2
    power_1 = 2.0 * square * (np.conj(q) * q_1).real
    power_2 = 2.0 * square * (np.conj(q) * q_2 + np.outer(q_1.conj(), q_1)).real
    schur = noise_precision + precision - square * float((v @ weighted).real)
    schur = max(schur, MIN_SCHUR * noise_precision)
    schur_1 = -2.0 * square * (v_1 @ weighted).real
    schur_2 = -2.0 * square * (v_2 @ weighted + v_1 @ covariance @ v_1.conj().T).real
    ratio = power / schur
    cross = np.outer(power_1, schur_1)
    bend = (1.0 + 2.0 * ratio) / schur * np.outer(schur_1, schur_1)
    return ObjectCost(
        value=float(ratio - np.log(schur)),
        gradient=(power_1 - (1.0 + ratio) * schur_1) / schur,
        hessian=(power_2 - (1.0 + ratio) * schur_2 - (cross + cross.T) / schur + bend) / schur,
    )


def refine_object(
    zeta: FloatArray,
    precision: float,
    others: Dictionary,
    frame: ComplexArray,
    noise_precision: float,
    max_steps: int = 1,
) -> FloatArray:
    """Zeta of one component from (70) by Newton steps, along the gradient where not concave."""
    fixed = others, weight_posterior(others, frame.ravel(), noise_precision)
    for _ in range(max_steps):
        _, gradient, hessian = object_cost(zeta, precision, fixed, frame, noise_precision)
        sizes = np.array(frame.shape[::-1])[: len(gradient)]
        if np.all(np.linalg.eigvalsh(hessian) < 0.0):
            step: FloatArray = -np.asarray(np.linalg.solve(hessian, gradient))
        else:  # scaled by the curvature of an isolated line
            step = gradient / (np.abs(np.diag(hessian)) + sizes**2)
        step *= min(1.0, MAX_STEP_CELLS / max(float(np.max(np.abs(step) * sizes)), 1e-300))

        def after(step: FloatArray, start: FloatArray = zeta) -> FloatArray:
            return np.asarray(start + np.pad(step, (0, 2 - len(step))))

        def cost(step: FloatArray) -> float:
            return object_cost(after(step), precision, fixed, frame, noise_precision).value

        if gradient @ step < 2.0 * NO_GAIN:
            break
        found = first_that_gains(cost, step, TRIALS)
        if found is None:
            break
        zeta = after(found)
    return zeta


def new_object(
    objects: Dictionary, frame: ComplexArray, noise_precision: float, threshold: float
) -> FloatArray:
    """Zeta of a possible new component from (70), gamma = 0: a refined peak of the periodogram.

    A peak that runs into an existing component is given up for the next one.
    """
    mean, _ = weight_posterior(objects, frame.ravel(), noise_precision)
    num_ramps, num_samples = frame.shape
    size = (2 * num_ramps if num_ramps > 1 else 1, 2 * num_samples)
    unexplained = frame - (objects.atoms @ mean).reshape(frame.shape)
    power = np.abs(np.fft.ifft2(unexplained, s=size)) ** 2
    best, best_ratio = np.zeros(2), 0.0
    for _ in range(CANDIDATE_PEAKS):
        row, column = np.unravel_index(int(np.argmax(power)), size)
        around = np.arange(-2, 3)
        power[np.ix_((row + around) % size[0], (column + around) % size[1])] = 0.0
        peak = np.array([column / size[1], row / size[0]])
        top = refine_object(peak, 0.0, objects, frame, noise_precision, NEW_COMPONENT_STEPS)
        for zeta in (top, peak):
            atom = object_atoms(zeta, frame.shape)
            inverse_rho, ratio = moments(atom, objects, frame.ravel(), noise_precision)
            if inverse_rho[0] < ABSORBED_SHARE * noise_precision:
                continue
            if ratio[0] > threshold:
                return zeta
            if ratio[0] > best_ratio:
                best, best_ratio = zeta, float(ratio[0])
    return best


def refine_jointly(
    objects: Dictionary, points: FloatArray, frame: ComplexArray, noise_precision: float
) -> FloatArray:
    """All zeta from (67) by one damped Gauss-Newton step of all components together.

    Not a step of the paper: the robust schedule adds it, and tests compare it with this.
    """
    count, axes = len(points), 2 if frame.shape[0] > 1 else 1
    if count < 2:
        return points
    sizes = np.array(frame.shape[::-1])
    by = -2j * np.pi * (np.indices(frame.shape)[::-1].reshape(2, -1) - (sizes[:, None] - 1.0) / 2.0)
    derivatives = np.zeros((axes * count, frame.size, count), dtype=complex)
    for axis in range(axes):
        for index in range(count):
            derivatives[axis * count + index, :, index] = by[axis] * objects.atoms[:, index]
    gradient, step = gauss_newton_step(objects, derivatives, frame.ravel(), noise_precision)
    if gradient @ step < 2.0 * NO_GAIN:
        return points
    steps = np.zeros((count, 2))
    steps[:, :axes] = step.reshape(axes, count).T
    steps *= min(1.0, MAX_STEP_CELLS / np.max(np.abs(steps) * sizes))

    def cost(steps: FloatArray) -> float:
        moved = Dictionary(object_atoms(points + steps, frame.shape), objects.precisions)
        return log_evidence(moved, frame.ravel(), noise_precision)

    found = first_that_gains(cost, steps, 3)
    return points if found is None else points + found
