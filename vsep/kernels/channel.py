"""The channel of one ramp: weight posterior (60)-(62), and the slopes of (71).

A column is ``template * psi_k``, the template of one of the ramp's B bursts times the atom
``psi_k = exp(-j 2 pi k n / M) / sqrt(N)`` of a grid of M bins. All columns share one posterior.
"""

from typing import NamedTuple

import numpy as np

from vsep._arrays import ComplexArray, FloatArray, IntArray
from vsep.kernels.compiler import compiled


class Posterior(NamedTuple):
    """Gaussian posterior of K weights: ``C = (lambda A^H A + diag gamma)^-1``, mean, log|C|.

    ``log_determinant`` is NaN where the precision matrix is not positive definite.
    """

    gram: ComplexArray
    projections: ComplexArray
    covariance: ComplexArray
    amplitudes: ComplexArray
    log_determinant: float


class Channel(NamedTuple):
    """Columns of one ramp: burst, bin and prior precision of each (K,), and the atoms' M values."""

    owners: IntArray
    bins: IntArray
    precisions: FloatArray
    twiddle: ComplexArray


@compiled
def grid_atoms(num_samples: int, bins: IntArray, twiddle: ComplexArray) -> ComplexArray:
    """(K, N) atoms Psi of some bins."""
    atoms = np.empty((len(bins), num_samples), dtype=np.complex128)
    for k in range(len(bins)):
        turns = 0
        for n in range(num_samples):
            atoms[k, n] = twiddle[turns]
            turns += bins[k]
            if turns >= len(twiddle):
                turns -= len(twiddle)
    return atoms


@compiled
def channel_columns(templates: ComplexArray, atoms: ComplexArray, owners: IntArray) -> ComplexArray:
    """(K, N) columns from the templates (B, N) and the columns' atoms (K, N)."""
    columns = np.empty_like(atoms)
    for k in range(len(owners)):
        for n in range(atoms.shape[1]):
            columns[k, n] = templates[owners[k], n] * atoms[k, n]
    return columns


@compiled
def _inner(a: ComplexArray, b: ComplexArray) -> complex:
    real = imag = 0.0
    for n in range(len(a)):
        real += a[n].real * b[n].real + a[n].imag * b[n].imag
        imag += a[n].real * b[n].imag - a[n].imag * b[n].real
    return complex(real, imag)


@compiled
def weight_posterior(
    gram: ComplexArray, projections: ComplexArray, precisions: FloatArray, noise_precision: float
) -> Posterior:
    """Posterior from the Gram matrix and projections, by Cholesky's factors; O(K^3)."""
    size = len(precisions)
    # inverse: of the Cholesky factor L of the precision matrix, so that C = L^-H L^-1
    factor = np.zeros((size, size), dtype=np.complex128)
    inverse = np.zeros((size, size), dtype=np.complex128)
    log_determinant = 0.0
    for i in range(size):
        for j in range(i):
            rest = noise_precision * gram[i, j] - _inner(factor[j, :j], factor[i, :j])
            factor[i, j] = rest / factor[j, j].real
        pivot = noise_precision * gram[i, i].real + precisions[i]
        pivot -= _inner(factor[i, :i], factor[i, :i]).real
        log_determinant -= np.log(pivot) if pivot > 0.0 else np.nan
        factor[i, i] = np.sqrt(pivot)
        for j in range(i):
            total = 0.0j
            for k in range(j, i):
                total += factor[i, k] * inverse[k, j]
            inverse[i, j] = -total / factor[i, i].real
        inverse[i, i] = 1.0 / factor[i, i].real
    covariance = np.zeros((size, size), dtype=np.complex128)
    for k in range(size):
        for i in range(k + 1):
            for j in range(k + 1):
                covariance[i, j] += inverse[k, i].conjugate() * inverse[k, j]
    amplitudes = np.zeros(size, dtype=np.complex128)
    for i in range(size):
        for j in range(size):
            amplitudes[i] += noise_precision * covariance[i, j] * projections[j]
    return Posterior(gram, projections, covariance, amplitudes, log_determinant)


@compiled
def columns_posterior(
    columns: ComplexArray, residual: ComplexArray, precisions: FloatArray, noise_precision: float
) -> Posterior:
    """Posterior of the weights of (K, N) columns."""
    size = len(columns)
    gram = np.empty((size, size), dtype=np.complex128)
    projections = np.empty(size, dtype=np.complex128)
    for i in range(size):
        projections[i] = _inner(columns[i], residual)
        for j in range(i + 1):
            gram[i, j] = _inner(columns[i], columns[j])
            gram[j, i] = gram[i, j].conjugate()
    return weight_posterior(gram, projections, precisions, noise_precision)


@compiled
def channel_fit(
    templates: ComplexArray, residual: ComplexArray, channel: Channel, noise_precision: float
) -> Posterior:
    """Posterior of the columns of one ramp."""
    atoms = grid_atoms(len(residual), channel.bins, channel.twiddle)
    columns = channel_columns(templates, atoms, channel.owners)
    return columns_posterior(columns, residual, channel.precisions, noise_precision)


@compiled
def burst_signals(
    templates: ComplexArray, channel: Channel, amplitudes: ComplexArray
) -> ComplexArray:
    """(B, N) bursts U Psi beta."""
    signals = np.zeros(templates.shape, dtype=np.complex128)
    atoms = grid_atoms(templates.shape[1], channel.bins, channel.twiddle)
    for k in range(len(amplitudes)):
        owner = channel.owners[k]
        for n in range(templates.shape[1]):
            signals[owner, n] += amplitudes[k] * templates[owner, n] * atoms[k, n]
    return signals


@compiled
def _line_and_spread(
    atoms: ComplexArray,
    columns: ComplexArray,
    fit: tuple[ComplexArray, ComplexArray],
    moving: IntArray,
) -> tuple[ComplexArray, ComplexArray]:
    """(N,) ``Psi beta`` and ``diag(A C Psi^H)`` of the weights that carry a template."""
    covariance, amplitudes = fit
    num_samples = atoms.shape[1]
    line = np.zeros(num_samples, dtype=np.complex128)
    spread = np.zeros(num_samples, dtype=np.complex128)
    mixed = np.empty(num_samples, dtype=np.complex128)
    for k in range(len(moving)):
        mixed[:] = 0.0
        for m in range(len(columns)):
            weight = covariance[m, moving[k]]
            for n in range(num_samples):
                mixed[n] += weight * columns[m, n]
        weight = amplitudes[moving[k]]
        for n in range(num_samples):
            line[n] += weight * atoms[k, n]
            spread[n] += mixed[n] * atoms[k, n].conjugate()
    return line, spread


@compiled
def template_slopes(
    derivatives: ComplexArray,
    atoms: ComplexArray,
    columns: ComplexArray,
    covariance: ComplexArray,
    amplitudes: ComplexArray,
    moving: IntArray,
    residual: ComplexArray,
    noise_precision: float,
) -> tuple[FloatArray, FloatArray]:
    """Gradient (2,) and Gauss-Newton curvature (2, 2) of a log evidence by a template.

    With ``y = Psi beta`` and ``c = diag(A C Psi^H)`` the gradient of (71) is ``2 lambda Re sum da
    (r* y - c*)`` over the derivatives da of the template, r being what no column explains. The
    curvature is that of the residual after projection on the columns, positive definite.

    Parameters
    ----------
    derivatives : (2, N) complex
        Derivatives of the template by the two parameters.
    atoms : (K, N) complex
        Channel atoms Psi of the columns that carry the template.
    columns : (M, N) complex
        All columns that have a part in this ramp.
    covariance, amplitudes : (M, M), (M,) complex
        Their posterior.
    moving : (K,) int
        Which of them carry the template.
    residual : (N,) complex
        What the columns explain.
    noise_precision : float
        lambda.
    """
    num_samples, size = len(residual), len(columns)
    rest = residual.copy()
    for m in range(size):
        for n in range(num_samples):
            rest[n] -= amplitudes[m] * columns[m, n]
    line, spread = _line_and_spread(atoms, columns, (covariance, amplitudes), moving)
    gradient, curvature = np.zeros(2), np.zeros((2, 2))
    moved = derivatives * line
    crossed = np.empty((2, size), dtype=np.complex128)
    for i in range(2):
        for n in range(num_samples):
            pull = rest[n].conjugate() * line[n] - spread[n].conjugate()
            gradient[i] += 2.0 * noise_precision * (derivatives[i, n] * pull).real
        for m in range(size):
            crossed[i, m] = _inner(columns[m], moved[i])
    for i in range(2):
        for j in range(2):
            kept = _inner(moved[i], moved[j]).real
            for m in range(size):
                mean = _inner(crossed[j], covariance[:, m])
                kept -= noise_precision * (crossed[i, m] * mean).real
            curvature[i, j] = 2.0 * noise_precision * kept
    return gradient, curvature


@compiled
def channel_cost(
    templates: ComplexArray, residual: ComplexArray, channel: Channel, noise_precision: float
) -> float:
    """Cost (71) of one ramp, ``log|C| + lambda h^H beta`` with the projections h."""
    fit = channel_fit(templates, residual, channel, noise_precision)
    return fit.log_determinant + noise_precision * _inner(fit.projections, fit.amplitudes).real


@compiled
def channel_slopes(
    templates: ComplexArray,
    moving: int,
    derivatives: ComplexArray,
    residual: ComplexArray,
    channel: Channel,
    noise_precision: float,
) -> tuple[float, FloatArray, FloatArray]:
    """Cost (71) of one ramp with gradient and curvature by the template `moving`."""
    atoms = grid_atoms(len(residual), channel.bins, channel.twiddle)
    columns = channel_columns(templates, atoms, channel.owners)
    fit = columns_posterior(columns, residual, channel.precisions, noise_precision)
    own = np.flatnonzero(channel.owners == moving)
    gradient, curvature = template_slopes(
        derivatives,
        atoms[own],
        columns,
        fit.covariance,
        fit.amplitudes,
        own,
        residual,
        noise_precision,
    )
    cost = fit.log_determinant + noise_precision * _inner(fit.projections, fit.amplitudes).real
    return cost, gradient, curvature
