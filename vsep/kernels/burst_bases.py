"""Orthonormal bases of U Psi and of the tangents of U Psi beta, row by row.

A Gram-Schmidt process that repeats itself where a column loses most of its length: the same as a
QR factorisation of every row. Real and imaginary parts are kept apart, for the vector registers.
"""

import numpy as np

from vsep._typing import ComplexArray, FloatArray
from vsep.kernels.cis import cis
from vsep.kernels.compiler import compiled

# What is left of a column beside the earlier ones is rounding below this share of its length.
_ROUNDING = 1e-13
# A column that keeps this share of its squared length is orthogonal to rounding after one pass.
_ENOUGH = 0.5
_EXACT_EVERY = 64  # samples after which a line is set anew instead of rotated


@compiled
def _project_out(real: FloatArray, imag: FloatArray, row: int, known: int) -> float:
    """Take the first rows out of a row, and return the squared length of what is left."""
    num_samples = real.shape[1]
    for other in range(known):
        along = across = 0.0
        for n in range(num_samples):
            along += real[other, n] * real[row, n] + imag[other, n] * imag[row, n]  # e^H a
            across += real[other, n] * imag[row, n] - imag[other, n] * real[row, n]
        for n in range(num_samples):
            real[row, n] -= along * real[other, n] - across * imag[other, n]  # a - e (e^H a)
            imag[row, n] -= along * imag[other, n] + across * real[other, n]
    energy = 0.0
    for n in range(num_samples):
        energy += real[row, n] * real[row, n] + imag[row, n] * imag[row, n]
    return energy


@compiled
def _make_orthogonal(real: FloatArray, imag: FloatArray, row: int, known: int) -> float:
    """Make a row orthogonal to the first ones; its length now over that before."""
    first = before = _project_out(real, imag, row, 0)
    # Twice is enough (Kahan, Parlett): the second pass removes the rounding of the first.
    left = _project_out(real, imag, row, known)
    if left < _ENOUGH * before:
        left = _project_out(real, imag, row, known)
    return np.sqrt(left / first) if first > 0.0 else 0.0


@compiled
def _scale(real: FloatArray, imag: FloatArray, row: int, factor: float) -> None:
    for n in range(real.shape[1]):
        real[row, n] *= factor
        imag[row, n] *= factor


@compiled
def _make_unit(real: FloatArray, imag: FloatArray, row: int, share: float) -> None:
    """Scale a row to length one, or to zero if its share of the length it had is rounding."""
    energy = _project_out(real, imag, row, 0)
    kept = share > _ROUNDING and energy > 0.0
    _scale(real, imag, row, 1.0 / np.sqrt(energy) if kept else 0.0)


@compiled
def _fill_rows(
    template: ComplexArray,
    derivatives: ComplexArray,
    frequencies: FloatArray,
    weights: ComplexArray,
    real: FloatArray,
    imag: FloatArray,
) -> None:
    """Write the columns of U Psi, the two derivatives of U Psi beta, and U Psi beta, each a row."""
    num_paths, num_samples = len(frequencies), len(template)
    signal = num_paths + 2
    for n in range(num_samples):
        real[signal, n] = imag[signal, n] = 0.0
    for k in range(num_paths):
        # psi_k by rotation, set anew where rounding would add up
        step = cis(-frequencies[k])
        line = 0.0j
        for n in range(num_samples):
            line = cis(-frequencies[k] * n) if n % _EXACT_EVERY == 0 else line * step
            column = line * template[n]  # U psi_k
            real[k, n], imag[k, n] = column.real, column.imag
            response = line * weights[k]
            real[signal, n] += response.real
            imag[signal, n] += response.imag
    for n in range(num_samples):
        response = complex(real[signal, n], imag[signal, n])
        for number in range(2):
            derivative = derivatives[number, n] * response  # dU Psi beta
            real[num_paths + number, n] = derivative.real
            imag[num_paths + number, n] = derivative.imag
        whole = template[n] * response
        real[signal, n], imag[signal, n] = whole.real, whole.imag


@compiled
def _straighten_tangents(real: FloatArray, imag: FloatArray, first: int) -> None:
    """Make the second tangent orthogonal to the first as a real vector, and both unit."""
    second = first + 1
    before = _project_out(real, imag, second, 0)
    for _ in range(2):
        along = 0.0
        for n in range(real.shape[1]):
            # real inner product: theta is real
            along += real[first, n] * real[second, n] + imag[first, n] * imag[second, n]
        for n in range(real.shape[1]):
            real[second, n] -= along * real[first, n]
            imag[second, n] -= along * imag[first, n]
    left = _project_out(real, imag, second, 0)
    _make_unit(real, imag, second, np.sqrt(left / before) if before > 0.0 else 0.0)


@compiled
def burst_bases(
    templates: ComplexArray,
    derivatives: ComplexArray,
    frequencies: FloatArray,
    weights: ComplexArray,
) -> ComplexArray:
    """Make bases, tangents and signals of bursts.

    Parameters
    ----------
    templates : (M, N) complex
        Diagonals of U.
    derivatives : (M, 2, N) complex
        Of the templates by theta.
    frequencies : (M, K) float
        Channel lines in cycles per sample.
    weights : (M, K) complex
        Of the lines at the first sample, beta.

    Returns
    -------
    (M, K + 3, N) complex
        Orthonormal basis of the span of U Psi, a dependent column being zero; the derivatives of
        U Psi beta by theta, orthonormal, as real vectors, to each other and the basis; U Psi beta.
    """
    num_bursts, num_samples = templates.shape
    num_paths = frequencies.shape[1]
    rows = np.empty((num_bursts, num_paths + 3, num_samples), dtype=np.complex128)
    real = np.empty((num_paths + 3, num_samples))
    imag = np.empty((num_paths + 3, num_samples))
    for b in range(num_bursts):
        _fill_rows(templates[b], derivatives[b], frequencies[b], weights[b], real, imag)
        for k in range(num_paths):
            # Basis of the span of U Psi
            share = _make_orthogonal(real, imag, k, k)
            _make_unit(real, imag, k, share)
        for k in range(num_paths, num_paths + 2):
            # What is rounding here is told where the two tangents are compared.
            _make_orthogonal(real, imag, k, num_paths)
        _make_unit(real, imag, num_paths, 1.0)
        # Tangents, orthogonal to each other as real vectors
        _straighten_tangents(real, imag, num_paths)
        for k in range(num_paths + 3):
            for n in range(num_samples):
                rows[b, k, n] = complex(real[k, n], imag[k, n])
    return rows
