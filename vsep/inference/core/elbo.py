r"""The evidence lower bound (19) of the factorised model with Jeffreys hyper-priors.

For every active weight the factors are ``q(gamma) = Ga(1, 1/gamma-hat)``, and
``<log p(w | gamma)> + <log p(gamma)> - <log q(gamma)> = 1 - log pi + log gamma-hat
- gamma-hat (|w|^2 + C_ll)``. The improper hyper-priors are known up to a constant per component,
which is left out: bounds are comparable at one model order, and across orders up to that constant.
"""

import math
from functools import lru_cache

import numpy as np
from scipy.special import digamma, gammaln

from vsep._typing import ComplexArray, FloatArray


def weights_bound(
    amplitudes: ComplexArray,
    variances: FloatArray,
    precisions: FloatArray,
    log_determinant: float,
) -> float:
    """Terms of one weight factor: prior, hyper-prior and entropies of q(w) and q(gamma).

    Parameters
    ----------
    amplitudes, variances, precisions : (K,) or (K, A), (K,), (K,) arrays
        Posterior means and variances, and the means of q(gamma). The weights of A antennas share
        covariance and precisions.
    log_determinant : float
        Of the covariance.
    """
    if len(amplitudes) == 0:
        return 0.0
    if amplitudes.ndim == 2:
        return _shared_weights_bound(amplitudes, variances, precisions, log_determinant)
    second_moment = amplitudes.real**2 + amplitudes.imag**2 + variances  # <|w|^2>
    count = len(amplitudes)
    # <log p(w|gamma)> + <log p(gamma)> - <log q(gamma)> without the moments
    hyper = count * (1.0 - math.log(math.pi)) + float(np.log(precisions).sum())
    entropy = count * math.log(math.pi * math.e) + log_determinant  # of q(w) = CN
    return hyper - float(precisions @ second_moment) + entropy


def _shared_weights_bound(
    amplitudes: ComplexArray,
    variances: FloatArray,
    precisions: FloatArray,
    log_determinant: float,
) -> float:
    """`weights_bound` of A weights a component, with q(gamma) = Ga(A, A / gamma-hat)."""
    count, size = amplitudes.shape
    second_moment = np.sum(np.abs(amplitudes) ** 2, axis=1) + size * variances
    # the same of A weights that share gamma
    constant = size * (1.0 - np.log(np.pi) - np.log(size)) + gammaln(size)
    hyper = np.sum(constant + size * np.log(precisions) - precisions * second_moment)
    entropy = size * (count * np.log(np.pi * np.e) + log_determinant)
    return float(hyper + entropy)


def noise_bound(num_values: int, noise_precision: float, expected_error: float) -> float:
    """Terms of the likelihood, and prior and entropy of q(lambda) = Ga(PN, PN / lambda-hat).

    Parameters
    ----------
    num_values : int
        PN.
    noise_precision : float
        Mean lambda-hat of q(lambda).
    expected_error : float
        ||r - Phi alpha - U Psi beta||^2 plus both traces of (65).
    """
    shape = float(num_values)
    rate = shape / noise_precision
    psi, log_gamma = _gamma_functions(num_values)
    expected_log = psi - math.log(rate)  # <log lambda>
    # <log p(r | ...)>
    likelihood = shape * (expected_log - math.log(math.pi)) - noise_precision * expected_error
    # of q(lambda) = Ga
    entropy = shape - math.log(rate) + log_gamma + (1.0 - shape) * psi
    return float(likelihood - expected_log + entropy)  # - <log lambda> is Jeffreys' prior


@lru_cache(maxsize=16)
def _gamma_functions(num_values: int) -> tuple[float, float]:
    """Digamma function and logarithm of the gamma function."""
    return float(digamma(num_values)), float(gammaln(num_values))
