"""Slopes of the joint cost (67) of all objects."""

import numpy as np

from vsep._arrays import ComplexArray, FloatArray
from vsep.kernels.compiler import compiled
from vsep.kernels.lines import Columns, atom_jet, split_columns
from vsep.kernels.split_arrays import row_of, split


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
    rest, posterior = split(residual), split_columns(columns)
    covariance, amplitudes, noise_precision = columns[2:]
    size, num_antennas = amplitudes.shape
    axes = 2 if columns.doppler_factors.shape[1] > 1 else 1
    rows = np.empty((num_objects, 6, size), dtype=np.complex128)
    weighted = np.empty((num_objects, 3, size), dtype=np.complex128)
    gradient = np.empty(axes * num_objects)
    for i in range(num_objects):
        beat_line, doppler_line = posterior.beat_factors, posterior.doppler_factors
        jet = atom_jet(row_of(beat_line, i), row_of(doppler_line, i), rest, posterior)
        rows[i] = jet.rows.real + 1j * jet.rows.imag
        weighted[i] = jet.weighted.real + 1j * jet.weighted.imag
        for s in range(axes):
            pull = 0.0
            for a in range(num_antennas):
                pull += amplitudes[i, a].real * jet.innovations.real[s + 1, a]
                pull += amplitudes[i, a].imag * jet.innovations.imag[s + 1, a]
            for j in range(size):
                pull -= num_antennas * (covariance[j, i] * rows[i, s + 1, j]).real
            gradient[s * num_objects + i] = 2.0 * noise_precision * pull
    curvature = np.empty((axes * num_objects, axes * num_objects))
    for i in range(num_objects):
        for k in range(num_objects):
            together = 0.0j
            for a in range(num_antennas):
                together += amplitudes[i, a].conjugate() * amplitudes[k, a]
            for s in range(axes):
                for t in range(axes):
                    # The lines move with their middle at rest: dphi_i^H dphi_k = -d^2 phi_i^H phi_k
                    product = -rows[i, 3 + s + t, k]
                    for j in range(size):
                        product -= noise_precision * rows[i, s + 1, j] * weighted[k, t + 1, j]
                    value = 2.0 * noise_precision * (together * product).real
                    curvature[s * num_objects + i, t * num_objects + k] = value
    return gradient, curvature
