"""Largest change of the objects' frequencies in standard deviations."""

import numpy as np

from vsep._typing import FloatArray
from vsep.kernels.compiler import compiled
from vsep.kernels.line_spectra import Columns


@compiled
def largest_change(
    before: FloatArray, after: FloatArray, precisions: FloatArray, columns: Columns
) -> float:
    """Largest change of the objects' frequencies, in standard deviations of isolated lines.

    ``sqrt(6 / (omega^2 / rho)) / (2 pi)`` cells is such a deviation, with the moments (23)-(24) of
    the weight; its ratio is 1 at least, also where the others explain a weight.

    Parameters
    ----------
    before, after : (L, 2) float
        Beat and Doppler frequencies, cyclic.
    precisions : (K,) float
        Prior precisions of all columns, of which the first L are objects.
    columns : Columns
        Posterior of their weights.
    """
    sizes = columns.beat_factors.shape[1], columns.doppler_factors.shape[1]
    largest = 0.0
    for k in range(len(after)):
        variance = columns.covariance[k, k].real  # C_ll of (59)
        inverse_rho = 1.0 / variance - precisions[k]  # (23): 1/C_ll = 1/rho + gamma_l
        power = 0.0
        for a in range(columns.amplitudes.shape[1]):
            power += columns.amplitudes[k, a].real ** 2 + columns.amplitudes[k, a].imag ** 2
        # (24): omega^2/rho = |alpha_l|^2 / (C_ll^2 / rho)
        ratio = power / (variance * variance * inverse_rho) if inverse_rho > 0.0 else 0.0
        # Cramer-Rao bound of an isolated line, in resolution cells.
        deviation = np.sqrt(6.0 / max(ratio, 1.0)) / (2.0 * np.pi)
        for axis in range(2):
            move = after[k, axis] - before[k, axis]
            cells = abs(move - np.rint(move)) * sizes[axis]  # frequencies are cyclic
            largest = max(largest, cells / deviation)
    return largest
