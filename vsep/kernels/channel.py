"""Channel of one ramp: weight posterior (60)-(62), and the slopes of (71).

A column is ``template * psi_k``, the template of one of the ramp's B bursts times the atom
``psi_k = exp(-j 2 pi k n / M) / sqrt(N)`` of a grid of M bins. All columns share one posterior.
Real and imaginary parts are kept apart, for the vector registers.
"""

from typing import NamedTuple

import numpy as np

from vsep._typing import ComplexArray, FloatArray, IntArray
from vsep.kernels.compiler import compiled
from vsep.kernels.complex_parts import ComplexParts, add_scaled, inner, split, split_row
from vsep.kernels.posterior import (
    Posterior,
    factored_posterior,
    inverse_factor,
    log_evidence,
    weight_posterior,
)


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
        place = 0
        for n in range(num_samples):
            atoms[k, n] = twiddle[place]  # psi_k(n) = exp(-j 2 pi k n / M) / sqrt(N), k n modulo M
            place += bins[k]
            if place >= len(twiddle):
                place -= len(twiddle)
    return atoms


@compiled
def channel_columns(templates: ComplexParts, atoms: ComplexParts, owners: IntArray) -> ComplexParts:
    """(K, N) columns from the templates (B, N) and the columns' atoms (K, N)."""
    real, imag = np.empty(atoms.real.shape), np.empty(atoms.real.shape)
    for k in range(len(owners)):
        a, b = templates.real[owners[k]], templates.imag[owners[k]]
        c, d = atoms.real[k], atoms.imag[k]
        for n in range(len(a)):
            real[k, n] = a[n] * c[n] - b[n] * d[n]  # columns of U Psi, (12)
            imag[k, n] = a[n] * d[n] + b[n] * c[n]
    return ComplexParts(real, imag)


@compiled
def column_products(
    columns: ComplexParts, residual: ComplexParts
) -> tuple[ComplexArray, ComplexArray]:
    """Gram matrix (K, K) of the columns, and projections (K,) of the residual, one row."""
    size = len(columns.real)
    gram = np.empty((size, size), dtype=np.complex128)
    projections = np.empty(size, dtype=np.complex128)
    for i in range(size):
        projections[i] = inner(columns, i, residual, 0)  # A^H r
        for j in range(i + 1):
            gram[i, j] = inner(columns, i, columns, j)  # A^H A
            gram[j, i] = gram[i, j].conjugate()
    return gram, projections


@compiled
def columns_posterior(
    columns: ComplexParts, residual: ComplexParts, precisions: FloatArray, noise_precision: float
) -> Posterior:
    """Posterior of the weights of (K, N) columns; the residual is one row."""
    gram, projections = column_products(columns, residual)
    # (60)-(62) with A = U Psi
    return weight_posterior(gram, projections, precisions, noise_precision)


@compiled
def ramp_columns(templates: ComplexArray, channel: Channel) -> tuple[ComplexParts, ComplexParts]:
    """Atoms and columns (K, N) of one ramp."""
    atoms = split(grid_atoms(templates.shape[1], channel.bins, channel.twiddle))
    return atoms, channel_columns(split(templates), atoms, channel.owners)


@compiled
def fill_bursts(
    columns: ComplexParts, owners: IntArray, amplitudes: ComplexArray, signals: ComplexArray
) -> None:
    """Write what the columns of each burst add up to into (B, N) signals."""
    for b in range(signals.shape[0]):
        for n in range(signals.shape[1]):
            signals[b, n] = 0.0
    for k in range(len(owners)):
        row, weight = signals[owners[k]], amplitudes[k]
        for n in range(len(row)):
            row[n] += weight * complex(columns.real[k, n], columns.imag[k, n])  # U Psi beta


@compiled
def _line_and_spread(
    atoms: ComplexParts,
    columns: ComplexParts,
    fit: tuple[ComplexArray, ComplexArray],
    moving: IntArray,
) -> tuple[ComplexParts, ComplexParts]:
    """(1, N) ``Psi beta`` and ``diag(A C Psi^H)`` of the weights that carry a template."""
    covariance, amplitudes = fit
    shape = (1, atoms.real.shape[1])
    line, spread = (
        ComplexParts(np.zeros(shape), np.zeros(shape)),
        ComplexParts(np.zeros(shape), np.zeros(shape)),
    )
    mixed = ComplexParts(np.empty(shape), np.empty(shape))
    for k in range(len(moving)):
        for n in range(shape[1]):
            mixed.real[0, n] = mixed.imag[0, n] = 0.0
        for m in range(len(columns.real)):
            add_scaled(covariance[m, moving[k]], columns, m, mixed, 0)  # A C, column k
        add_scaled(amplitudes[moving[k]], atoms, k, line, 0)  # Psi beta
        for n in range(shape[1]):
            real, imag = atoms.real[k, n], atoms.imag[k, n]
            # diag(A C Psi^H)
            spread.real[0, n] += mixed.real[0, n] * real + mixed.imag[0, n] * imag
            spread.imag[0, n] += mixed.imag[0, n] * real - mixed.real[0, n] * imag
    return line, spread


@compiled
def template_slopes(
    derivatives: ComplexArray,
    atoms: ComplexParts,
    columns: ComplexParts,
    fit: tuple[ComplexArray, ComplexArray],
    moving: IntArray,
    residual: ComplexParts,
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
    atoms : (K, N) rows
        Channel atoms Psi of the columns that carry the template.
    columns : (M, N) rows
        All columns that have a part in this ramp.
    fit : tuple of (M, M) and (M,) complex
        Covariance and mean of their weights.
    moving : (K,) int
        Which of them carry the template.
    residual : (1, N) rows
        What the columns explain.
    noise_precision : float
        lambda.
    """
    covariance, amplitudes = fit
    size = len(columns.real)
    noise_residual = ComplexParts(residual.real.copy(), residual.imag.copy())
    for m in range(size):
        add_scaled(-amplitudes[m], columns, m, noise_residual, 0)  # r - A beta
    line, spread = _line_and_spread(atoms, columns, fit, moving)
    slopes = split(derivatives)
    # B = dU Psi beta
    moved = channel_columns(slopes, ComplexParts(_twice(line.real), _twice(line.imag)), _both())
    gradient, curvature = np.zeros(2), np.zeros((2, 2))
    crossed = np.empty((2, size), dtype=np.complex128)
    for i in range(2):
        # Re(da (r* y - c*)): the moved template on what is left, less the spread.
        gradient[i] = 2.0 * noise_precision * (inner(noise_residual, 0, moved, i).real)
        gradient[i] -= 2.0 * noise_precision * inner(spread, 0, slopes, i).real
        for m in range(size):
            crossed[i, m] = inner(columns, m, moved, i)  # A^H B
    for i in range(2):
        for j in range(2):
            # B^H (I - lambda A C A^H) B
            kept = inner(moved, i, moved, j).real
            for m in range(size):
                mean = 0.0j
                for k in range(size):
                    mean += crossed[j, k].conjugate() * covariance[k, m]
                kept -= noise_precision * (crossed[i, m] * mean).real
            # Fisher information of theta with beta as nuisance
            curvature[i, j] = 2.0 * noise_precision * kept
    return gradient, curvature


@compiled
def _both() -> IntArray:
    """(2,) numbers of the two parameters."""
    numbers = np.zeros(2, dtype=np.int64)
    numbers[1] = 1
    return numbers


@compiled
def _twice(row: FloatArray) -> FloatArray:
    """(2, N) one row (1, N) above itself."""
    rows = np.empty((2, row.shape[1]))
    for n in range(row.shape[1]):
        rows[0, n] = rows[1, n] = row[0, n]
    return rows


@compiled
def channel_cost(
    templates: ComplexArray, residual: ComplexArray, channel: Channel, noise_precision: float
) -> float:
    """Cost (71) of one ramp."""
    _, columns = ramp_columns(templates, channel)
    gram, projections = column_products(columns, split_row(residual))
    factor = inverse_factor(gram, channel.precisions, noise_precision)  # R and log|C|
    return log_evidence(projections, factor, noise_precision)  # (71)


@compiled
def _carried(atoms: ComplexParts, owners: IntArray, burst: int) -> tuple[IntArray, ComplexParts]:
    """Columns of one burst, and their atoms."""
    count, place = 0, 0
    for k in range(len(owners)):
        count += owners[k] == burst
    shape = (count, atoms.real.shape[1])
    own, carried = np.empty(count, dtype=np.int64), ComplexParts(np.zeros(shape), np.zeros(shape))
    for k in range(len(owners)):
        if owners[k] == burst:
            own[place] = k
            add_scaled(complex(1.0, 0.0), atoms, k, carried, place)
            place += 1
    return own, carried


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
    atoms, columns = ramp_columns(templates, channel)
    parts = split_row(residual)
    gram, projections = column_products(columns, parts)
    factor = inverse_factor(gram, channel.precisions, noise_precision)
    fit = factored_posterior(gram, projections, factor, noise_precision)
    own, carried = _carried(atoms, channel.owners, moving)
    gradient, curvature = template_slopes(
        derivatives,
        carried,
        columns,
        (fit.covariance, fit.amplitudes),
        own,
        parts,
        noise_precision,
    )
    return log_evidence(projections, factor, noise_precision), gradient, curvature
