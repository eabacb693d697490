"""Intervals of Doppler frequency of moving objects, which their migration alone tells apart."""

import numpy as np
from numpy.typing import NDArray

from vsep._typing import ComplexArray, FloatArray
from vsep.kernels.compiler import compiled
from vsep.kernels.complex_parts import split
from vsep.kernels.line_spectra import Columns, columns_as_parts
from vsep.kernels.moving_atoms import Migration, fold_loss, fold_width
from vsep.kernels.newton_ascent import downdate, update_inverse
from vsep.kernels.object_cost import MIN_SCHUR, atom_fit

FOLD_GAIN = 7.0  # nats of log evidence: what another interval of Doppler frequency must gain,
FOLD_SHARE = 0.5  # and how much of what an object that is there gains


@compiled
def favour_first_interval(
    power: NDArray[np.float32], columns: Columns, migration: Migration | None
) -> None:
    """Lower the rows of a grid (R, C) that are no Doppler frequencies of the first interval.

    Noise is much the same in all intervals of Doppler frequency, and what is no line fits here and
    there; an object exceeds its image in another interval by its `fold_loss`.
    """
    if migration is None:
        return
    num_ramps, num_samples = columns.doppler_factors.shape[1], columns.beat_factors.shape[1]
    share = 1.0 / (1.0 + FOLD_SHARE * fold_loss(migration, num_ramps, num_samples))
    lead = FOLD_GAIN / columns.noise_precision
    half = len(power) // 2
    for row in range(len(power)):
        if abs(row - half) > num_ramps:
            for column in range(power.shape[1]):
                rest = np.float32(share) * power[row, column] - np.float32(lead)
                power[row, column] = max(rest, np.float32(0.0))


@compiled
def unfold_lines(
    points: FloatArray, precisions: FloatArray, residual: ComplexArray, columns: Columns
) -> FloatArray:
    """Move objects to the next interval of Doppler frequency where evidence says so.

    Parameters
    ----------
    points : (L, 2) float
        Beat and Doppler frequencies of moving objects.
    precisions : (L,) float
        Their prior precisions.
    residual : (A P, N) complex
        Received signal minus what is not among the columns.
    columns : Columns
        The objects.

    Returns
    -------
    (L, 2) float
        Where they are now; whoever asks places them anew.
    """
    new = points.copy()
    migration, num_samples = columns.migration, columns.beat_factors.shape[1]
    if migration is None:
        return new
    parts, posterior = split(residual), columns_as_parts(columns)
    width = fold_width(migration, num_samples)
    loss = fold_loss(migration, columns.doppler_factors.shape[1], num_samples)
    for index in range(len(points)):
        precision = precisions[index]
        downdate(posterior, index)
        best, side = -np.inf, 0.0
        for step in (-1.0, 1.0):
            # The beat frequency makes up for the Doppler within the ramp.
            beat = points[index, 0] - step * migration.ramp_share
            value = atom_fit(
                beat, points[index, 1] + step * width, precision, parts, posterior
            ).value
            if value > best:
                best, side = value, step
        fit = atom_fit(points[index, 0], points[index, 1], precision, parts, posterior)
        inverse_rho = max(fit.inverse_rho, MIN_SCHUR * columns.noise_precision)
        if best > fit.value + max(FOLD_GAIN, FOLD_SHARE * loss * fit.power / inverse_rho):
            new[index, 0] -= side * migration.ramp_share
            new[index, 1] += side * width
            fit = atom_fit(new[index, 0], new[index, 1], precision, parts, posterior)
            inverse_rho = max(fit.inverse_rho, MIN_SCHUR * columns.noise_precision)
        update_inverse(posterior, index, precision, inverse_rho)
    return new
