"""Unit-norm exponentials, and the cost (70) of moving one of them.

The cost is ``J(zeta) = -log D + lambda^2 |q|^2 / D``, ``D = lambda + gamma - lambda^2 v^H C v``,
with ``v = Phi^H phi(zeta)`` and ``q = phi^H r - v^H mu``, where Phi, C and mu belong to the *other*
components. A component that is taken out leaves zeros in C and mu behind and drops out of all sums.
Derivatives multiply an exponential by powers of ``-j 2 pi m``, m counted from its middle.
"""

from typing import NamedTuple

import numpy as np

from vsep._arrays import ComplexArray, FloatArray
from vsep.kernels.compiler import compiled
from vsep.kernels.turns import turn

EXACT_EVERY = 64  # samples after which an exponential is set anew instead of turned on
LEAST_SCHUR = 1e-12  # of lambda: what D is at least


class CostJet(NamedTuple):
    """Cost (70) at one point (beat, Doppler) with its derivatives.

    ``inverse_rho`` is D without gamma and ``power`` is ``|lambda q|^2``: the moments (23)-(24).
    """

    value: float
    by_beat: float
    by_doppler: float
    by_beat_beat: float
    by_beat_doppler: float
    by_doppler_doppler: float
    inverse_rho: float
    power: float


class Columns(NamedTuple):
    """Separable columns and the posterior of their weights, as the kernels take them.

    ``beat_factors`` (L, N), ``doppler_factors`` (L, P), ``covariance`` (L, L), ``amplitudes`` (L,),
    and the noise precision lambda.
    """

    beat_factors: ComplexArray
    doppler_factors: ComplexArray
    covariance: ComplexArray
    amplitudes: ComplexArray
    noise_precision: float


@compiled
def fill_line(frequency: float, first: float, line: ComplexArray) -> None:
    """Write ``exp(-j 2 pi frequency (first + m)) / sqrt(M)`` for m = 0 ... M - 1."""
    scale = 1.0 / np.sqrt(len(line))
    step = turn(-frequency)
    value = 0.0j
    for m in range(len(line)):
        value = scale * turn(-frequency * (first + m)) if m % EXACT_EVERY == 0 else value * step
        line[m] = value


@compiled
def fill_lines(frequencies: FloatArray, lines: ComplexArray) -> None:
    """Write one exponential, counted from the first sample, into every row (L, M)."""
    for row in range(len(frequencies)):
        fill_line(frequencies[row], 0.0, lines[row])


@compiled
def _line_moments(signal: ComplexArray, line: ComplexArray) -> tuple[complex, complex, complex]:
    """Inner product of a line with a signal, and its two derivatives by the line's frequency."""
    zeroth_real = zeroth_imag = first_real = first_imag = second_real = second_imag = 0.0
    middle = 0.5 * (len(line) - 1)
    for m in range(len(line)):
        a, b, offset = signal[m], line[m], m - middle
        real = a.real * b.real + a.imag * b.imag
        imag = a.imag * b.real - a.real * b.imag
        zeroth_real += real
        zeroth_imag += imag
        first_real += offset * real
        first_imag += offset * imag
        second_real += offset * offset * real
        second_imag += offset * offset * imag
    angular = 2.0 * np.pi
    return (
        complex(zeroth_real, zeroth_imag),
        angular * complex(-first_imag, first_real),
        -angular * angular * complex(second_real, second_imag),
    )


@compiled
def frame_moments(
    residual: ComplexArray, beat_line: ComplexArray, doppler_line: ComplexArray
) -> ComplexArray:
    """(3, 3) inner products ``phi^H r``: beat derivatives down, Doppler derivatives across."""
    num_ramps = residual.shape[0]
    along = np.empty((3, num_ramps), dtype=np.complex128)
    for p in range(num_ramps):
        along[0, p], along[1, p], along[2, p] = _line_moments(residual[p], beat_line)
    moments = np.empty((3, 3), dtype=np.complex128)
    for order in range(3):
        row = _line_moments(along[order], doppler_line)
        moments[order, 0], moments[order, 1], moments[order, 2] = row
    return moments


@compiled
def overlap_rows(
    beat_line: ComplexArray, doppler_line: ComplexArray, columns: Columns
) -> ComplexArray:
    """(6, L) rows ``v^*``, its two first and three second derivatives (bb, bd, dd)."""
    rows = np.empty((6, len(columns.beat_factors)), dtype=np.complex128)
    for k in range(rows.shape[1]):
        b0, b1, b2 = _line_moments(columns.beat_factors[k], beat_line)
        d0, d1, d2 = _line_moments(columns.doppler_factors[k], doppler_line)
        rows[0, k] = b0 * d0
        rows[1, k] = b1 * d0
        rows[2, k] = b0 * d1
        rows[3, k] = b2 * d0
        rows[4, k] = b1 * d1
        rows[5, k] = b0 * d2
    return rows


@compiled
def cost_jet(
    beat: float,
    doppler: float,
    precision: float,
    residual: ComplexArray,
    others: Columns,
) -> CostJet:
    """Cost (70) of one component with analytic gradient and Hessian; O(PN + L (N + P) + L^2).

    Parameters
    ----------
    beat, doppler : float
        Where the component is.
    precision : float
        Its prior precision gamma; zero for a new one.
    residual : (P, N) complex
        Received signal minus the interference estimate.
    others : Columns
        The other components.
    """
    covariance, amplitudes, noise_precision = others[2:]
    num_ramps, num_samples = residual.shape
    beat_line = np.empty(num_samples, dtype=np.complex128)
    doppler_line = np.empty(num_ramps, dtype=np.complex128)
    fill_line(beat, -0.5 * (num_samples - 1), beat_line)
    fill_line(doppler, -0.5 * (num_ramps - 1), doppler_line)
    moments = frame_moments(residual, beat_line, doppler_line)
    rows = overlap_rows(beat_line, doppler_line, others)
    size = rows.shape[1]
    q, q_b, q_d = moments[0, 0], moments[1, 0], moments[0, 1]
    q_bb, q_bd, q_dd = moments[2, 0], moments[1, 1], moments[0, 2]
    # overlap[i, j] = Re (d_i v)^H C (d_j v)
    overlap = np.zeros((6, 3))
    for k in range(size):
        q -= rows[0, k] * amplitudes[k]
        q_b -= rows[1, k] * amplitudes[k]
        q_d -= rows[2, k] * amplitudes[k]
        q_bb -= rows[3, k] * amplitudes[k]
        q_bd -= rows[4, k] * amplitudes[k]
        q_dd -= rows[5, k] * amplitudes[k]
        for j in range(3):
            weighted = 0.0j
            for other in range(size):
                weighted += covariance[k, other] * rows[j, other].conjugate()
            for i in range(6):
                overlap[i, j] += (rows[i, k] * weighted).real
    square = noise_precision * noise_precision
    power = square * (q.real**2 + q.imag**2)
    power_b = 2.0 * square * (q.conjugate() * q_b).real
    power_d = 2.0 * square * (q.conjugate() * q_d).real
    power_bb = 2.0 * square * ((q_b * q_b.conjugate()).real + (q.conjugate() * q_bb).real)
    power_bd = 2.0 * square * ((q_b * q_d.conjugate()).real + (q.conjugate() * q_bd).real)
    power_dd = 2.0 * square * ((q_d * q_d.conjugate()).real + (q.conjugate() * q_dd).real)
    inverse_rho = noise_precision - square * overlap[0, 0]
    schur = max(inverse_rho + precision, LEAST_SCHUR * noise_precision)
    schur_b, schur_d = -2.0 * square * overlap[1, 0], -2.0 * square * overlap[2, 0]
    schur_bb = -2.0 * square * (overlap[3, 0] + overlap[1, 1])
    schur_bd = -2.0 * square * (overlap[4, 0] + 0.5 * (overlap[1, 2] + overlap[2, 1]))
    schur_dd = -2.0 * square * (overlap[5, 0] + overlap[2, 2])
    ratio = power / schur
    rise, bend = 1.0 + ratio, (1.0 + 2.0 * ratio) / schur
    return CostJet(
        ratio - np.log(schur),
        (power_b - rise * schur_b) / schur,
        (power_d - rise * schur_d) / schur,
        (power_bb - rise * schur_bb - 2.0 * power_b * schur_b / schur + bend * schur_b * schur_b)
        / schur,
        (
            power_bd
            - rise * schur_bd
            - (power_b * schur_d + power_d * schur_b) / schur
            + bend * schur_b * schur_d
        )
        / schur,
        (power_dd - rise * schur_dd - 2.0 * power_d * schur_d / schur + bend * schur_d * schur_d)
        / schur,
        inverse_rho,
        power,
    )
