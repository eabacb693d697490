"""Gradient and curvature of the joint cost (67) of all objects."""

import numpy as np

from vsep._typing import ComplexArray, FloatArray
from vsep.kernels.compiler import compiled
from vsep.kernels.complex_parts import ComplexParts, row_of, split
from vsep.kernels.line_spectra import (
    Columns,
    ComplexPartColumns,
    atom_jet,
    columns_as_parts,
    moving_products_at,
)
from vsep.kernels.moving_atoms import is_moving


@compiled
def joint_information(
    rows: ComplexParts, explained: ComplexParts, posterior: ComplexPartColumns, axes: int
) -> FloatArray:
    """Fisher information of the objects' frequencies with the weights as nuisance.

    Parameters
    ----------
    rows : (L, 6, K) complex
        Inner products of the atoms with the columns, see `AtomJet`.
    explained : (L, 3, K) complex
        lambda times the jets' ``weighted``.
    posterior : ComplexPartColumns
        All columns.
    axes : int
        Frequencies of an object: 1 or 2.
    """
    count, _, size = rows.real.shape
    amplitudes, noise_precision = posterior.amplitudes, posterior.noise_precision
    information = np.empty((axes * count, axes * count))
    for i in range(count):
        for k in range(count):
            # sum_a of alpha_ia^* alpha_ka
            real = imag = 0.0
            for a in range(amplitudes.real.shape[1]):
                b, c = amplitudes.real[i, a], amplitudes.imag[i, a]
                d, e = amplitudes.real[k, a], amplitudes.imag[k, a]
                real += b * d + c * e  # Re alpha_i^* alpha_k
                imag += b * e - c * d
            for s in range(axes):
                for t in range(axes):
                    # The lines move with their middle at rest: dphi_i^H dphi_k = -d^2 phi_i^H phi_k
                    kept_real, kept_imag = -rows.real[i, 3 + s + t, k], -rows.imag[i, 3 + s + t, k]
                    for j in range(size):
                        b, c = rows.real[i, s + 1, j], rows.imag[i, s + 1, j]
                        d, e = explained.real[k, t + 1, j], explained.imag[k, t + 1, j]
                        # dphi_i^H (I - lambda Phi C Phi^H) dphi_k
                        kept_real -= b * d - c * e
                        kept_imag -= b * e + c * d
                    # F = 2 lambda Re{ sum_a alpha_i^* alpha_k dphi_i^H (I - ...) dphi_k }
                    value = 2.0 * noise_precision * (real * kept_real - imag * kept_imag)
                    information[s * count + i, t * count + k] = value
    return information


@compiled
def joint_slopes(
    num_objects: int, residual: ComplexArray, columns: Columns
) -> tuple[FloatArray, FloatArray]:
    """Gradient of (67), summed over the antennas, by all beats, then Dopplers, and its curvature.

    The gradient is ``2 lambda Re{ sum_a alpha_ia^* dphi_i^H (r_a - D w_a) - A sum_j C_ji dphi_i^H
    d_j }`` over all columns D with weights w; the curvature is the Fisher information with those
    weights as nuisance, ``2 lambda Re{ sum_a B_a^H (I - lambda D C D^H) B_a }`` with the weighted
    derivatives B.

    Parameters
    ----------
    num_objects : int
        L: so many columns, the first, can move.
    residual : (A P, N) complex
        Received signal minus what is not among the columns.
    columns : Columns
        All of them.

    Returns
    -------
    gradient : (2 L,) float, of a single ramp (L,)
    curvature : (2 L, 2 L) float, of a single ramp (L, L)
    """
    parts, posterior = split(residual), columns_as_parts(columns)
    covariance, amplitudes, noise_precision, scratch = posterior[2:6]
    size, num_antennas = amplitudes.real.shape
    axes = 2 if columns.doppler_factors.shape[1] > 1 else 1
    rows = ComplexParts(np.empty((num_objects, 6, size)), np.empty((num_objects, 6, size)))
    explained = ComplexParts(np.empty((num_objects, 3, size)), np.empty((num_objects, 3, size)))
    gradient = np.empty(axes * num_objects)
    for i in range(num_objects):
        # phi_i^H Phi, phi_i^H (r - Phi alpha) and their derivatives
        jet = scratch.jet
        if is_moving(posterior.migration):
            beat, doppler = posterior.points[i, 0], posterior.points[i, 1]
            moving_products_at(beat, doppler, parts, posterior, posterior.migration, 6)
        else:
            atom_jet(
                row_of(posterior.beat_factors, i),
                row_of(posterior.doppler_factors, i),
                parts,
                posterior,
            )
        for j in range(size):
            for s in range(6):
                rows.real[i, s, j], rows.imag[i, s, j] = jet.rows.real[s, j], jet.rows.imag[s, j]
            for s in range(3):
                # lambda C Phi^H dphi_i
                explained.real[i, s, j] = noise_precision * jet.weighted.real[s, j]
                explained.imag[i, s, j] = noise_precision * jet.weighted.imag[s, j]
        for s in range(axes):
            pull = 0.0
            for a in range(num_antennas):
                # Re alpha_i^* dphi_i^H (r - Phi alpha)
                pull += amplitudes.real[i, a] * jet.innovations.real[s + 1, a]
                pull += amplitudes.imag[i, a] * jet.innovations.imag[s + 1, a]
            for j in range(size):
                # derivative of log|C|: Re C_ji dphi_i^H phi_j
                spread = covariance.real[i, j] * jet.rows.real[s + 1, j]
                spread += covariance.imag[i, j] * jet.rows.imag[s + 1, j]
                pull -= num_antennas * spread
            gradient[s * num_objects + i] = 2.0 * noise_precision * pull
    return gradient, joint_information(rows, explained, posterior, axes)
