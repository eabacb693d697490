"""Newton's method on the cost (70), and the loop of Algorithm 3 over all components."""

import numpy as np

from vsep._arrays import BoolArray, ComplexArray, FloatArray
from vsep.kernels.compiler import compiled
from vsep.kernels.lines import LEAST_SCHUR, Columns, CostJet, cost_jet, fill_line

NO_GAIN = 1e-6  # nats of log evidence: a step that promises less is not tried
MAX_STEP_CELLS = 0.25  # longest Newton step, in resolution cells 1/N and 1/P
TRIALS = 4  # lengths that are tried of one step, each a quarter of the one before


@compiled
def newton_or_gradient_step(jet: CostJet, num_samples: int, num_ramps: int) -> tuple[float, float]:
    """Newton step, or one along the gradient where the cost is not concave; never too long.

    A single ramp has no Doppler frequency. The curvature of an isolated line scales the gradient.
    """
    if num_ramps == 1:
        curvature = -jet.by_beat_beat
        if curvature <= 0.0:
            curvature = abs(curvature) + num_samples**2
        beat, doppler = jet.by_beat / curvature, 0.0
    else:
        determinant = jet.by_beat_beat * jet.by_doppler_doppler - jet.by_beat_doppler**2
        if jet.by_beat_beat < 0.0 and determinant > 0.0:
            beat = jet.by_beat_doppler * jet.by_doppler - jet.by_doppler_doppler * jet.by_beat
            doppler = jet.by_beat_doppler * jet.by_beat - jet.by_beat_beat * jet.by_doppler
            beat, doppler = beat / determinant, doppler / determinant
        else:
            beat = jet.by_beat / (abs(jet.by_beat_beat) + num_samples**2)
            doppler = jet.by_doppler / (abs(jet.by_doppler_doppler) + num_ramps**2)
    cells = max(abs(beat) * num_samples, abs(doppler) * num_ramps)
    if cells > MAX_STEP_CELLS:
        beat, doppler = beat * MAX_STEP_CELLS / cells, doppler * MAX_STEP_CELLS / cells
    return beat, doppler


@compiled
def climb(
    point: FloatArray,
    start: CostJet,
    max_steps: int,
    precision: float,
    residual: ComplexArray,
    others: Columns,
) -> CostJet:
    """Climb (70) from `point`, where the cost is `start`; the point is moved in place.

    Arguments as for `cost_jet`. The cost never falls.
    """
    num_ramps, num_samples = residual.shape
    current = start
    for _ in range(max_steps):
        beat, doppler = newton_or_gradient_step(current, num_samples, num_ramps)
        if current.by_beat * beat + current.by_doppler * doppler < 2.0 * NO_GAIN:
            return current
        found = False
        for _ in range(TRIALS):
            trial = cost_jet(point[0] + beat, point[1] + doppler, precision, residual, others)
            if trial.value >= current.value:
                found = True
                break
            beat, doppler = 0.25 * beat, 0.25 * doppler
        if not found:
            return current
        point[0] += beat
        point[1] += doppler
        current = trial
    return current


@compiled
def take_out(covariance: ComplexArray, amplitudes: ComplexArray, index: int) -> None:
    """Posterior of the other components as if one were not there, which leaves zeros behind."""
    variance = covariance[index, index].real
    column = covariance[:, index].copy()
    ratio = amplitudes[index] / variance
    for i in range(len(column)):
        amplitudes[i] -= column[i] * ratio
        scaled = column[i] / variance
        for j in range(len(column)):
            covariance[i, j] -= scaled * column[j].conjugate()
    covariance[index, :] = 0.0
    covariance[:, index] = 0.0
    amplitudes[index] = 0.0


@compiled
def put_in(
    covariance: ComplexArray,
    amplitudes: ComplexArray,
    index: int,
    correlations: ComplexArray,
    projection: complex,
    precision: float,
    noise_precision: float,
) -> None:
    """Block inversion (68): a unit-norm component takes the place of the zeros at `index`.

    Parameters
    ----------
    covariance, amplitudes : (L, L), (L,) complex
        Changed in place.
    index : int
        Where the zeros are.
    correlations : (L,) complex
        ``Phi^H phi`` with the new atom; the entry at `index` is not read.
    projection : complex
        ``phi^H residual``.
    precision : float
        Prior precision of the new weight.
    noise_precision : float
        lambda.
    """
    size = len(amplitudes)
    regression = np.zeros(size, dtype=np.complex128)
    schur = noise_precision + precision
    innovation = projection
    for i in range(size):
        if i != index:
            for j in range(size):
                if j != index:
                    regression[i] += noise_precision * covariance[i, j] * correlations[j]
            schur -= noise_precision * (correlations[i].conjugate() * regression[i]).real
            innovation -= correlations[i].conjugate() * amplitudes[i]
    variance = 1.0 / schur
    amplitude = noise_precision * variance * innovation
    for i in range(size):
        amplitudes[i] -= regression[i] * amplitude
        for j in range(size):
            covariance[i, j] += variance * regression[i] * regression[j].conjugate()
        covariance[i, index] = -variance * regression[i]
        covariance[index, i] = -variance * regression[i].conjugate()
    covariance[index, index] = variance
    amplitudes[index] = amplitude


@compiled
def update_lines(
    points: FloatArray,
    precisions: FloatArray,
    residual: ComplexArray,
    columns: Columns,
    threshold: float,
) -> tuple[BoolArray, FloatArray]:
    """Loop of Algorithm 3: move, test and re-weigh or prune every component in turn.

    Parameters
    ----------
    points : (L, 2) float
        Beat and Doppler frequencies; moved in place.
    precisions : (M,) float
        Prior precisions of all columns, of which the first L are objects; changed in place.
    residual : (P, N) complex
        Received signal minus what is not among the columns.
    columns : Columns
        All M; changed in place. What is pruned leaves zeros.
    threshold : float
        T, linear.

    Returns
    -------
    kept : (L,) bool
    ratios : (L,) float
        Activation ratio of each when its turn came.
    """
    beat_factors, doppler_factors, covariance, amplitudes, noise_precision = columns
    count = len(points)
    kept = np.ones(count, dtype=np.bool_)
    ratios = np.zeros(count)
    correlations = np.empty(len(precisions), dtype=np.complex128)
    for index in range(count):
        take_out(covariance, amplitudes, index)
        precision = precisions[index]
        start = cost_jet(points[index, 0], points[index, 1], precision, residual, columns)
        moved = points[index].copy()
        jet = climb(moved, start, 1, precision, residual, columns)
        if jet.inverse_rho > LEAST_SCHUR * noise_precision:
            ratios[index] = jet.power / jet.inverse_rho
        if ratios[index] <= threshold:
            kept[index] = False
            continue
        points[index] = moved
        # gamma = 1 / (omega^2 - rho), the fixed point (77)
        precisions[index] = jet.inverse_rho / (ratios[index] - 1.0)
        fill_line(moved[0], 0.0, beat_factors[index])
        fill_line(moved[1], 0.0, doppler_factors[index])
        for other in range(len(precisions)):
            beat = np.vdot(beat_factors[other], beat_factors[index])
            correlations[other] = beat * np.vdot(doppler_factors[other], doppler_factors[index])
        projection = 0.0j
        for p in range(len(residual)):
            projection += doppler_factors[index, p].conjugate() * np.vdot(
                beat_factors[index], residual[p]
            )
        put_in(
            covariance,
            amplitudes,
            index,
            correlations,
            projection,
            precisions[index],
            noise_precision,
        )
    return kept, ratios
