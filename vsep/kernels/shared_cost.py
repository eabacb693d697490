"""The cost (70) of an object that several antennas see, each with a weight of its own.

The antennas share the object's place, its prior and the columns of the others, so that the Schur
complement is one for all; only what the residual adds is a sum over the antennas. One antenna alone
has `vsep.kernels.lines.cost_jet`.
"""

from typing import NamedTuple

import numpy as np

from vsep._arrays import ComplexArray, FloatArray
from vsep.kernels.compiler import compiled
from vsep.kernels.lines import (
    LEAST_SCHUR,
    Columns,
    CostJet,
    fill_line,
    frame_moments,
    overlap_rows,
)


class PowerJet(NamedTuple):
    """``|q|^2`` with its derivatives by beat and Doppler frequency."""

    value: float
    by_beat: float
    by_doppler: float
    by_beat_beat: float
    by_beat_doppler: float
    by_doppler_doppler: float


@compiled
def _power_jet(moments: ComplexArray, rows: ComplexArray, amplitudes: ComplexArray) -> PowerJet:
    """Power of what one antenna's residual holds beyond the other components.

    Parameters
    ----------
    moments : (3, 3) complex
        Inner products of the atom with the residual, see `frame_moments`.
    rows : (6, L) complex
        Inner products of the atom with the other columns, see `overlap_rows`.
    amplitudes : (L,) complex
        Their weights at this antenna.
    """
    q, q_b, q_d = moments[0, 0], moments[1, 0], moments[0, 1]
    q_bb, q_bd, q_dd = moments[2, 0], moments[1, 1], moments[0, 2]
    for k in range(len(amplitudes)):
        q -= rows[0, k] * amplitudes[k]
        q_b -= rows[1, k] * amplitudes[k]
        q_d -= rows[2, k] * amplitudes[k]
        q_bb -= rows[3, k] * amplitudes[k]
        q_bd -= rows[4, k] * amplitudes[k]
        q_dd -= rows[5, k] * amplitudes[k]
    return PowerJet(
        q.real**2 + q.imag**2,
        2.0 * (q.conjugate() * q_b).real,
        2.0 * (q.conjugate() * q_d).real,
        2.0 * ((q_b * q_b.conjugate()).real + (q.conjugate() * q_bb).real),
        2.0 * ((q_b * q_d.conjugate()).real + (q.conjugate() * q_bd).real),
        2.0 * ((q_d * q_d.conjugate()).real + (q.conjugate() * q_dd).real),
    )


@compiled
def _overlap(rows: ComplexArray, covariance: ComplexArray) -> FloatArray:
    """(6, 3) real parts of ``(d_i v)^H C (d_j v)``."""
    weighted = np.empty(rows.shape[1], dtype=np.complex128)
    overlap = np.zeros((6, 3))
    for j in range(3):
        for k in range(rows.shape[1]):
            weighted[k] = 0.0
            for other in range(rows.shape[1]):
                weighted[k] += covariance[k, other] * rows[j, other].conjugate()
        for i in range(6):
            for k in range(rows.shape[1]):
                overlap[i, j] += (rows[i, k] * weighted[k]).real
    return overlap


@compiled
def shared_cost_jet(
    beat: float, doppler: float, precision: float, residual: ComplexArray, others: Columns
) -> CostJet:
    """Cost ``sum_a |lambda q_a|^2 / S - A log S`` with analytic gradient and Hessian.

    Parameters
    ----------
    beat, doppler : float
        Where the component is.
    precision : float
        Its prior precision gamma; zero for a new one.
    residual : (A, P, N) complex
        Received signals minus the interference estimate.
    others : Columns
        The other components, with amplitudes (A, L).

    Returns
    -------
    CostJet
        Its ``power`` is summed over the antennas.
    """
    covariance, amplitudes, noise_precision = others[2:]
    num_antennas, num_ramps, num_samples = residual.shape
    beat_line = np.empty(num_samples, dtype=np.complex128)
    doppler_line = np.empty(num_ramps, dtype=np.complex128)
    fill_line(beat, -0.5 * (num_samples - 1), beat_line)
    fill_line(doppler, -0.5 * (num_ramps - 1), doppler_line)
    rows = overlap_rows(beat_line, doppler_line, others)
    power = power_b = power_d = power_bb = power_bd = power_dd = 0.0
    for a in range(num_antennas):
        jet = _power_jet(frame_moments(residual[a], beat_line, doppler_line), rows, amplitudes[a])
        power += jet.value
        power_b += jet.by_beat
        power_d += jet.by_doppler
        power_bb += jet.by_beat_beat
        power_bd += jet.by_beat_doppler
        power_dd += jet.by_doppler_doppler
    square = noise_precision * noise_precision
    power_b, power_d = square * power_b, square * power_d
    power_bb, power_bd, power_dd = square * power_bb, square * power_bd, square * power_dd
    overlap = _overlap(rows, covariance)
    inverse_rho = noise_precision - square * overlap[0, 0]
    schur = max(inverse_rho + precision, LEAST_SCHUR * noise_precision)
    schur_b, schur_d = -2.0 * square * overlap[1, 0], -2.0 * square * overlap[2, 0]
    schur_bb = -2.0 * square * (overlap[3, 0] + overlap[1, 1])
    schur_bd = -2.0 * square * (overlap[4, 0] + 0.5 * (overlap[1, 2] + overlap[2, 1]))
    schur_dd = -2.0 * square * (overlap[5, 0] + overlap[2, 2])
    ratio = square * power / schur
    rise, bend = num_antennas + ratio, (num_antennas + 2.0 * ratio) / schur
    cross = power_b * schur_d + power_d * schur_b
    return CostJet(
        ratio - num_antennas * np.log(schur),
        (power_b - rise * schur_b) / schur,
        (power_d - rise * schur_d) / schur,
        (power_bb - rise * schur_bb - 2.0 * power_b * schur_b / schur + bend * schur_b**2) / schur,
        (power_bd - rise * schur_bd - cross / schur + bend * schur_b * schur_d) / schur,
        (power_dd - rise * schur_dd - 2.0 * power_d * schur_d / schur + bend * schur_d**2) / schur,
        inverse_rho,
        square * power,
    )
