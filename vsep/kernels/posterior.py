"""Gaussian posterior of the weights from their Gram matrix and projections, (58)-(62).

Everything comes from the inverse R of the Cholesky factor of the precision matrix
``lambda A^H A + diag gamma``: the covariance is ``R^H R``, its logarithmic determinant twice the
sum of the logarithms of R's diagonal.
"""

from typing import NamedTuple

import numpy as np

from vsep._typing import ComplexArray, FloatArray
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


@compiled
def _conjugate_product(a: ComplexArray, b: ComplexArray, size: int) -> complex:
    """Inner product ``a^H b`` of the first entries."""
    real = imag = 0.0
    for n in range(size):
        real += a[n].real * b[n].real + a[n].imag * b[n].imag
        imag += a[n].real * b[n].imag - a[n].imag * b[n].real
    return complex(real, imag)


@compiled
def inverse_factor(
    gram: ComplexArray, precisions: FloatArray, noise_precision: float
) -> tuple[ComplexArray, float]:
    """Inverse R (K, K) of the Cholesky factor, lower triangular, and log|C|; O(K^3)."""
    size = len(precisions)
    factor = np.zeros((size, size), dtype=np.complex128)
    inverse = np.zeros((size, size), dtype=np.complex128)
    log_determinant = 0.0
    for i in range(size):
        # Diagonal of lambda A^H A + diag(gamma), (59)
        pivot = noise_precision * gram[i, i].real + precisions[i]
        for j in range(i):
            # L_ij = (M_ij - sum_k L_ik L_jk^*) / L_jj; the inverse has 1 / L_jj.
            entry = noise_precision * gram[i, j] - _conjugate_product(factor[j], factor[i], j)
            entry = complex(entry.real * inverse[j, j].real, entry.imag * inverse[j, j].real)
            factor[i, j] = entry
            pivot -= entry.real * entry.real + entry.imag * entry.imag
        log_determinant -= np.log(pivot) if pivot > 0.0 else np.nan  # log|C| = -2 sum log L_ii
        scale = 1.0 / np.sqrt(pivot)
        for k in range(i):
            # Row i of R = L^-1 by forward substitution
            weight = scale * factor[i, k]
            for j in range(k + 1):
                inverse[i, j] -= weight * inverse[k, j]
        inverse[i, i] = scale
    return inverse, log_determinant


@compiled
def factored_posterior(
    gram: ComplexArray,
    projections: ComplexArray,
    factor: tuple[ComplexArray, float],
    noise_precision: float,
) -> Posterior:
    """Posterior from the inverse factor R and log|C|."""
    inverse, log_determinant = factor
    size = len(projections)
    covariance = np.zeros((size, size), dtype=np.complex128)
    for k in range(size):
        for i in range(k + 1):
            left = inverse[k, i].conjugate()
            for j in range(i + 1):
                covariance[i, j] += left * inverse[k, j]  # C = R^H R
    amplitudes = np.zeros(size, dtype=np.complex128)
    for i in range(size):
        covariance[i, i] = covariance[i, i].real
        for j in range(i):
            covariance[j, i] = covariance[i, j].conjugate()  # Hermitian
    for i in range(size):
        total = 0.0j
        for j in range(size):
            total += covariance[i, j] * projections[j]  # C A^H r
        amplitudes[i] = noise_precision * total  # (58), (61)
    return Posterior(gram, projections, covariance, amplitudes, log_determinant)


@compiled
def log_evidence(
    projections: ComplexArray, factor: tuple[ComplexArray, float], noise_precision: float
) -> float:
    """Log evidence (71), ``log|C| + lambda h^H beta = log|C| + lambda^2 |R h|^2``."""
    inverse, log_determinant = factor
    explained = 0.0
    for i in range(len(projections)):
        white = 0.0j
        for k in range(i + 1):
            white += inverse[i, k] * projections[k]  # R A^H r
        explained += white.real * white.real + white.imag * white.imag
    return log_determinant + noise_precision * noise_precision * explained


@compiled
def weight_posterior(
    gram: ComplexArray, projections: ComplexArray, precisions: FloatArray, noise_precision: float
) -> Posterior:
    """Posterior from the Gram matrix and projections."""
    factor = inverse_factor(gram, precisions, noise_precision)
    return factored_posterior(gram, projections, factor, noise_precision)
