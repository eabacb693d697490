"""Cost (70) of one object's frequencies, for one antenna or several.

The cost is ``J(zeta) = sum_a lambda^2 |q_a|^2 / D - A log D``, ``D = lambda + gamma - lambda^2 v^H
C v``, with ``v = Phi^H phi(zeta)`` and ``q_a = phi^H r_a - v^H mu_a``, where Phi, C and mu belong
to the *other* components. The antennas share the object's place, its prior and the columns of the
others, so that D is one for all; each has a weight of its own.
"""

from typing import NamedTuple

import numpy as np

from vsep.kernels.compiler import compiled
from vsep.kernels.complex_parts import ComplexParts, line_products, multiply, rows_to
from vsep.kernels.line_spectra import (
    AtomJet,
    ComplexPartColumns,
    apply_covariance,
    atom_jet,
    fill_line,
    moving_products_at,
    subtract_fit,
)
from vsep.kernels.moving_atoms import is_moving

MIN_SCHUR = 1e-12  # of lambda: what D is at least


class CostJet(NamedTuple):
    """Cost (70) at one point (beat, Doppler) with its derivatives.

    ``inverse_rho`` is D without gamma and ``power`` is ``sum_a |lambda q_a|^2``: the moments
    (23)-(24).
    """

    value: float
    by_beat: float
    by_doppler: float
    by_beat_beat: float
    by_beat_doppler: float
    by_doppler_doppler: float
    inverse_rho: float
    power: float


class AtomFit(NamedTuple):
    """Cost (70) without derivatives, and the moments as in `CostJet`."""

    value: float
    inverse_rho: float
    power: float


@compiled
def _product(jet: AtomJet, i: int, j: int) -> float:
    """``Re sum_a q_i^* q_j`` of two derivatives of the innovation."""
    total = 0.0
    for a in range(jet.innovations.real.shape[1]):
        # the antennas' powers add up
        total += jet.innovations.real[i, a] * jet.innovations.real[j, a]
        total += jet.innovations.imag[i, a] * jet.innovations.imag[j, a]
    return total


@compiled
def _overlap(jet: AtomJet, i: int, j: int) -> float:
    """``Re v_i^H C v_j`` of two derivatives of the overlap, the second a first one at most."""
    total = 0.0
    for k in range(jet.rows.real.shape[1]):
        total += jet.rows.real[i, k] * jet.weighted.real[j, k]  # rows hold v^H, weighted C v
        total -= jet.rows.imag[i, k] * jet.weighted.imag[j, k]
    return total


@compiled
def cost_jet(
    beat: float,
    doppler: float,
    precision: float,
    residual: ComplexParts,
    others: ComplexPartColumns,
) -> CostJet:
    """Cost (70) of one component with analytic gradient and Hessian.

    Parameters
    ----------
    beat, doppler : float
        Where the component is.
    precision : float
        Its prior precision gamma; zero for a new one.
    residual : (A P, N) complex
        Received signal minus the interference estimate.
    others : ComplexPartColumns
        The other components.
    """
    beat_line, doppler_line = others.scratch[:2]
    jet = others.scratch.jet
    if is_moving(others.migration):
        moving_products_at(beat, doppler, residual, others, others.migration, 6)
    else:
        # phi = line over the ramps (x) line over the samples, (10)
        fill_line(beat, beat_line)
        fill_line(doppler, doppler_line)
        atom_jet(beat_line, doppler_line, residual, others)
    num_antennas, noise_precision = others.amplitudes.real.shape[1], others.noise_precision
    square = noise_precision * noise_precision
    # P = lambda^2 sum |q|^2 and its derivatives by beat (b) and Doppler (d)
    power = square * _product(jet, 0, 0)
    power_b, power_d = 2.0 * square * _product(jet, 0, 1), 2.0 * square * _product(jet, 0, 2)
    power_bb = 2.0 * square * (_product(jet, 1, 1) + _product(jet, 0, 3))
    power_bd = 2.0 * square * (_product(jet, 1, 2) + _product(jet, 0, 4))
    power_dd = 2.0 * square * (_product(jet, 2, 2) + _product(jet, 0, 5))
    # (23): 1/rho = lambda - lambda^2 v^H C v
    inverse_rho = noise_precision - square * _overlap(jet, 0, 0)
    # D = 1/rho + gamma = 1/c', (68)
    schur = max(inverse_rho + precision, MIN_SCHUR * noise_precision)
    # dD = -2 lambda^2 Re dv^H C v
    schur_b, schur_d = -2.0 * square * _overlap(jet, 1, 0), -2.0 * square * _overlap(jet, 2, 0)
    # d^2D = -2 lambda^2 Re (d^2v^H C v + dv^H C dv)
    schur_bb = -2.0 * square * (_overlap(jet, 3, 0) + _overlap(jet, 1, 1))
    schur_bd = -2.0 * square * (_overlap(jet, 4, 0) + _overlap(jet, 1, 2))
    schur_dd = -2.0 * square * (_overlap(jet, 5, 0) + _overlap(jet, 2, 2))
    ratio = power / schur
    # With A antennas J = P/D - A log D, so dJ = (dP - (A + P/D) dD) / D.
    rise, bend = num_antennas + ratio, (num_antennas + 2.0 * ratio) / schur
    cross = power_b * schur_d + power_d * schur_b
    return CostJet(
        ratio - num_antennas * np.log(schur),  # J, (70)
        (power_b - rise * schur_b) / schur,  # dJ/db
        (power_d - rise * schur_d) / schur,  # dJ/dd
        # Hessian: bb, bd, dd
        (power_bb - rise * schur_bb - 2.0 * power_b * schur_b / schur + bend * schur_b * schur_b)
        / schur,
        (power_bd - rise * schur_bd - cross / schur + bend * schur_b * schur_d) / schur,
        (power_dd - rise * schur_dd - 2.0 * power_d * schur_d / schur + bend * schur_d * schur_d)
        / schur,
        inverse_rho,
        power,
    )


@compiled
def atom_fit(
    beat: float,
    doppler: float,
    precision: float,
    residual: ComplexParts,
    others: ComplexPartColumns,
) -> AtomFit:
    """Cost (70) of one component without derivatives; arguments as for `cost_jet`.

    What block inversion takes stays in scratch: the lines, and the jet's first row of each.
    """
    beat_line, doppler_line, along, along_ramps, _, beats, dopplers, jet = others.scratch[:8]
    num_antennas = others.amplitudes.real.shape[1]
    if is_moving(others.migration):
        moving_products_at(beat, doppler, residual, others, others.migration, 1)
    else:
        fill_line(beat, beat_line)
        fill_line(doppler, doppler_line)
        # phi^H r, along the samples and then the ramps
        line_products(residual, beat_line, along)
        line_products(rows_to(along_ramps, num_antennas), doppler_line, jet.innovations)
        line_products(others.beat_factors, beat_line, beats)
        line_products(others.doppler_factors, doppler_line, dopplers)
        multiply(beats, 0, dopplers, 0, jet.rows, 0)  # phi^H Phi
        subtract_fit(jet.rows, others.amplitudes, jet.innovations, 1)  # q = phi^H r - phi^H Phi mu
        apply_covariance(jet.rows, others.covariance, jet.weighted, 1)  # C Phi^H phi
    power = overlap = 0.0
    for a in range(num_antennas):
        power += jet.innovations.real[0, a] ** 2 + jet.innovations.imag[0, a] ** 2
    for k in range(jet.rows.real.shape[1]):
        overlap += jet.rows.real[0, k] * jet.weighted.real[0, k]
        overlap -= jet.rows.imag[0, k] * jet.weighted.imag[0, k]
    noise_precision = others.noise_precision
    square = noise_precision * noise_precision
    inverse_rho = noise_precision - square * overlap  # (23)
    schur = max(inverse_rho + precision, MIN_SCHUR * noise_precision)
    value = square * power / schur - num_antennas * np.log(schur)  # (70)
    return AtomFit(value, inverse_rho, square * power)
