"""Newton ascent on the cost (70), and the loop of Algorithm 3 over all components."""

from typing import NamedTuple

import numpy as np

from vsep._typing import BoolArray, ComplexArray, FloatArray
from vsep.kernels.compiler import compiled
from vsep.kernels.complex_parts import ComplexParts, split, write_row
from vsep.kernels.line_spectra import Columns, ComplexPartColumns, columns_as_parts
from vsep.kernels.moving_atoms import is_moving
from vsep.kernels.object_cost import MIN_SCHUR, AtomFit, CostJet, atom_fit, cost_jet

NO_GAIN = 1e-6  # nats of log evidence: a step that promises less is not tried
MAX_STEP_CELLS = 0.25  # longest Newton step, in resolution cells 1/N and 1/P
TRIALS = 4  # lengths that are tried of one step, each a quarter of the one before


@compiled
def newton_or_gradient_step(jet: CostJet, num_samples: int, num_ramps: int) -> tuple[float, float]:
    """Newton step, or one along the gradient where the cost is not concave; never too long.

    A single ramp has no Doppler frequency. The curvature of an isolated line scales the gradient.
    """
    if num_ramps == 1:
        curvature = -jet.by_beat_beat  # -d^2 J / d phi^2, positive at a maximum
        if curvature <= 0.0:
            curvature = abs(curvature) + num_samples**2
        beat, doppler = jet.by_beat / curvature, 0.0
    else:
        # Concave iff the first entry is negative and the determinant of the Hessian positive.
        determinant = jet.by_beat_beat * jet.by_doppler_doppler - jet.by_beat_doppler**2
        if jet.by_beat_beat < 0.0 and determinant > 0.0:
            # Newton step -H^-1 g by Cramer's rule.
            beat = jet.by_beat_doppler * jet.by_doppler - jet.by_doppler_doppler * jet.by_beat
            doppler = jet.by_beat_doppler * jet.by_beat - jet.by_beat_beat * jet.by_doppler
            beat, doppler = beat / determinant, doppler / determinant
        else:
            # Gradient step, scaled by |J_ii| plus the curvature of an isolated line.
            beat = jet.by_beat / (abs(jet.by_beat_beat) + num_samples**2)
            doppler = jet.by_doppler / (abs(jet.by_doppler_doppler) + num_ramps**2)
    # No longer than a quarter of a resolution cell, inside the main lobe.
    cells = max(abs(beat) * num_samples, abs(doppler) * num_ramps)
    if cells > MAX_STEP_CELLS:
        beat, doppler = beat * MAX_STEP_CELLS / cells, doppler * MAX_STEP_CELLS / cells
    return beat, doppler


class AscentResult(NamedTuple):
    """Final point of an ascent, the cost there, and the cost at its start."""

    beat: float
    doppler: float
    end: CostJet
    start: CostJet


class Updated(NamedTuple):
    """Components after each had its turn.

    ``points`` (L, 2), ``precisions`` (M,) of all columns, ``kept`` (L,), and ``ratios`` (L,), the
    activation ratio of each when its turn came.
    """

    points: FloatArray
    precisions: FloatArray
    kept: BoolArray
    ratios: FloatArray


@compiled
def ascend(
    point: FloatArray,
    precision: float,
    residual: ComplexParts,
    others: ComplexPartColumns,
    max_steps: int,
) -> AscentResult:
    """Maximise (70) from a point (2,) by safeguarded Newton steps; the cost never falls.

    Where the Hessian is not negative definite the step follows the gradient, scaled by the
    curvature of an isolated line. Arguments as for `cost_jet`.
    """
    num_samples = others.beat_factors.real.shape[1]
    num_ramps = others.doppler_factors.real.shape[1]
    beat, doppler, by_beat, by_doppler = point[0], point[1], 0.0, 0.0
    start = current = CostJet(-np.inf, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    # The cost where it starts counts as the first of the trials: one call, compiled once.
    steps, trials = -1, 0
    while steps < max_steps and trials < TRIALS:
        trial = cost_jet(beat + by_beat, doppler + by_doppler, precision, residual, others)
        if steps >= 0 and trial.value < current.value:  # backtracking: a quarter of the step
            by_beat, by_doppler, trials = 0.25 * by_beat, 0.25 * by_doppler, trials + 1
            continue
        beat, doppler, current = beat + by_beat, doppler + by_doppler, trial
        start = current if steps < 0 else start
        steps, trials = steps + 1, 0
        by_beat, by_doppler = newton_or_gradient_step(current, num_samples, num_ramps)
        # the quadratic model gains half of it
        if current.by_beat * by_beat + current.by_doppler * by_doppler < 2.0 * NO_GAIN:
            break
    return AscentResult(beat, doppler, current, start)


@compiled
def downdate(columns: ComplexPartColumns, index: int) -> None:
    """Posterior of the other components as if one were not there, which leaves zeros behind."""
    covariance, amplitudes = columns.covariance, columns.amplitudes
    size, num_antennas = amplitudes.real.shape
    variance = covariance.real[index, index]  # c'_l, (68)
    for i in range(size):
        # -lambda C Phi^H phi_l of the others
        c, d = covariance.real[i, index] / variance, covariance.imag[i, index] / variance
        for a in range(num_antennas):
            real, imag = amplitudes.real[index, a], amplitudes.imag[index, a]
            if i != index:
                # mu - (c_l / C_ll) mu_l: mean of the others without component l.
                amplitudes.real[i, a] -= c * real - d * imag
                amplitudes.imag[i, a] -= c * imag + d * real
        for j in range(size):
            # The row at `index` is what it was as long as others are changed.
            if i != index:
                real, imag = covariance.real[index, j], covariance.imag[index, j]
                # C - c_l c_l^H / C_ll: their covariance.
                covariance.real[i, j] -= c * real - d * imag
                covariance.imag[i, j] -= c * imag + d * real
    # The row and column of the removed component drop out of all sums.
    for i in range(size):
        covariance.real[i, index] = covariance.imag[i, index] = 0.0
        covariance.real[index, i] = covariance.imag[index, i] = 0.0
    for a in range(num_antennas):
        amplitudes.real[index, a] = amplitudes.imag[index, a] = 0.0


@compiled
def update_inverse(
    columns: ComplexPartColumns, index: int, precision: float, inverse_rho: float
) -> None:
    """Block inversion (68): the atom that was fitted last takes the place of the zeros at `index`.

    Parameters
    ----------
    columns : ComplexPartColumns
        Changed in place; `atom_fit` has left the atom in its scratch.
    index : int
        Where the zeros are.
    precision : float
        Prior precision of the new weight.
    inverse_rho : float
        The atom's, beside the others.
    """
    covariance, amplitudes, noise_precision, scratch = columns[2:6]
    _, innovations, weighted = scratch.jet
    size, num_antennas = amplitudes.real.shape
    variance = 1.0 / (inverse_rho + precision)  # c'_l = 1/(1/rho + gamma), (68)
    gain, square = noise_precision * variance, noise_precision * noise_precision * variance
    for i in range(size):
        c, d = weighted.real[0, i], weighted.imag[0, i]
        for j in range(size):
            real, imag = weighted.real[0, j], weighted.imag[0, j]
            # Upper left block of (68): C + lambda^2 c' (C Phi^H phi)(C Phi^H phi)^H.
            covariance.real[i, j] += square * (c * real + d * imag)
            covariance.imag[i, j] += square * (d * real - c * imag)
        # Off-diagonal block: -lambda c' C Phi^H phi.
        covariance.real[i, index] = covariance.real[index, i] = -gain * c
        covariance.imag[i, index], covariance.imag[index, i] = -gain * d, gain * d
        for a in range(num_antennas):
            real, imag = innovations.real[0, a], innovations.imag[0, a]
            # Mean: the others give up lambda^2 c' C Phi^H phi (phi^H r - phi^H Phi mu).
            amplitudes.real[i, a] -= gain * noise_precision * (c * real - d * imag)
            amplitudes.imag[i, a] -= gain * noise_precision * (c * imag + d * real)
    # lower right entry c'
    covariance.real[index, index], covariance.imag[index, index] = variance, 0.0
    for a in range(num_antennas):
        # mu_l = lambda c' phi^H (r - Phi mu)
        amplitudes.real[index, a] = gain * innovations.real[0, a]
        amplitudes.imag[index, a] = gain * innovations.imag[0, a]
    if is_moving(columns.migration):
        columns.points[index, 0], columns.points[index, 1] = scratch.point[0], scratch.point[1]
    else:
        write_row(scratch.beat_line, columns.beat_factors, index)
        write_row(scratch.doppler_line, columns.doppler_factors, index)


@compiled
def refine_line(
    point: FloatArray, precision: float, residual: ComplexParts, others: ComplexPartColumns
) -> AtomFit:
    """One step of `ascend`, in place; trials and the final atom need no derivatives."""
    num_samples = others.beat_factors.real.shape[1]
    num_ramps = others.doppler_factors.real.shape[1]
    # (70) with gradient and Hessian at the present frequencies.
    start = cost_jet(point[0], point[1], precision, residual, others)
    beat, doppler = newton_or_gradient_step(start, num_samples, num_ramps)
    if start.by_beat * beat + start.by_doppler * doppler < 2.0 * NO_GAIN:
        beat = doppler = 0.0
    trials = 0
    while True:
        # The trial's moments are those of Algorithm 4, should it be accepted.
        fit = atom_fit(point[0] + beat, point[1] + doppler, precision, residual, others)
        if fit.value >= start.value or trials == TRIALS or (beat == 0.0 and doppler == 0.0):
            break
        trials += 1
        shorter = 0.25 if trials < TRIALS else 0.0  # the last trial is to stay
        beat, doppler = shorter * beat, shorter * doppler
    point[0] += beat
    point[1] += doppler
    return fit


@compiled
def update_lines(
    points: FloatArray,
    precisions: FloatArray,
    residual: ComplexArray,
    columns: Columns,
    threshold: float,
    levels: FloatArray,
) -> Updated:
    """Loop of Algorithm 3: move, test and re-estimate or prune every component in turn.

    Parameters
    ----------
    points : (L, 2) float
        Beat and Doppler frequencies.
    precisions : (M,) float
        Prior precisions of all columns, of which the first L are objects.
    residual : (A P, N) complex
        Received signal minus what is not among the columns.
    columns : Columns
        All M.
    threshold : float
        T, linear; the sum of the antennas' ratios is compared with it.
    levels : (L,) float
        Noise at the beats of the objects, in units of 1/lambda.
    """
    count, num_antennas = len(points), columns.amplitudes.shape[1]
    parts, posterior = split(residual), columns_as_parts(columns)
    new = Updated(points.copy(), precisions.copy(), np.ones(count, np.bool_), np.zeros(count))
    for index in range(count):
        # C and mu of the others, C_{l-bar} and mu_{l-bar}.
        downdate(posterior, index)
        moved = np.array([points[index, 0], points[index, 1]])
        # zeta_l from (70)
        fit = refine_line(moved, precisions[index], parts, posterior)
        if fit.inverse_rho > MIN_SCHUR * columns.noise_precision:
            # omega^2 / rho of (23)-(24)
            new.ratios[index] = fit.power / fit.inverse_rho / levels[index]
        # Algorithm 4: pruned unless omega^2/rho > T.
        if new.ratios[index] <= threshold:
            new.kept[index] = False
            continue
        new.points[index, 0], new.points[index, 1] = moved[0], moved[1]
        # gamma = 1 / (omega^2 - rho), the fixed point (77) with the antennas' mean omega^2
        excess = levels[index] * (new.ratios[index] / num_antennas - 1.0)
        new.precisions[index] = fit.inverse_rho / excess
        # C from (59), alpha from (58) with the new column.
        update_inverse(posterior, index, new.precisions[index], fit.inverse_rho)
    return new
