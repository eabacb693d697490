"""The closed-form bound against a Monte-Carlo expectation, and its growth under sub-updates."""

import numpy as np
import pytest
from scipy.stats import gamma as gamma_distribution

from vsep.inference.core.elbo import noise_bound, weights_bound
from vsep.inference.objects.sbl import ActiveSet, converged_precision
from vsep.kernels.complex_parts import split
from vsep.kernels.line_spectra import Columns, columns_as_parts
from vsep.kernels.newton_ascent import ascend
from vsep.signal.atoms import gram, line_factors, project, synthesize

SHAPE = (4, 16)


def problem(seed=3):
    rng = np.random.default_rng(seed)
    beats, dopplers = np.array([0.1, 0.16, -0.2]), np.array([0.1, -0.1, 0.3])
    factors = line_factors(beats, SHAPE[1]), line_factors(dopplers, SHAPE[0])
    noise = rng.standard_normal(SHAPE) + 1j * rng.standard_normal(SHAPE)
    received = synthesize(np.array([2.0, 1.5j, 1.0 + 0j]), *factors) + 0.1 * noise
    return received, beats, dopplers, factors


def posterior(received, factors, precisions, noise_precision):
    return ActiveSet(gram(*factors), project(received, *factors), precisions, noise_precision)


def bound(received, factors, active, noise_precision):
    signal = synthesize(active.amplitudes, *factors)
    error = float(np.sum(np.abs(received - signal) ** 2)) + active.trace()
    weights = weights_bound(
        active.amplitudes,
        np.diagonal(active.covariance).real,
        active.precisions,
        active.log_determinant,
    )
    return weights + noise_bound(received.size, noise_precision, error)


def test_closed_form_equals_a_monte_carlo_expectation():
    received, _, _, factors = problem()
    precisions, noise_precision, draws = np.array([0.3, 0.4, 0.8]), 40.0, 40_000
    active = posterior(received, factors, precisions, noise_precision)
    rng = np.random.default_rng(1)
    size = received.size
    white = rng.standard_normal((draws, 3)) + 1j * rng.standard_normal((draws, 3))
    root = np.linalg.cholesky(active.covariance)
    weights = active.amplitudes + (white / np.sqrt(2)) @ root.T
    gammas = rng.exponential(precisions, (draws, 3))
    lambdas = rng.gamma(size, noise_precision / size, draws)
    atoms = np.stack([np.kron(d, b) for b, d in zip(*factors, strict=True)], axis=1)
    errors = np.sum(np.abs(received.ravel() - weights @ atoms.T) ** 2, axis=1)
    log_joint = size * (np.log(lambdas) - np.log(np.pi)) - lambdas * errors - np.log(lambdas)
    log_joint += np.sum(
        -np.log(np.pi) + np.log(gammas) - gammas * np.abs(weights) ** 2 - np.log(gammas), axis=1
    )
    centred = weights - active.amplitudes
    mahalanobis = np.einsum(
        "di,ij,dj->d", centred.conj(), np.linalg.inv(active.covariance), centred
    ).real
    log_q = -3 * np.log(np.pi) - np.linalg.slogdet(active.covariance)[1] - mahalanobis
    log_q += np.sum(gamma_distribution.logpdf(gammas, 1.0, scale=precisions), axis=1)
    log_q += gamma_distribution.logpdf(lambdas, size, scale=noise_precision / size)
    samples = log_joint - log_q
    closed = bound(received, factors, active, noise_precision)
    # Four standard errors of the mean: one in 16000 for a correct formula, and the seed is fixed.
    assert closed == pytest.approx(np.mean(samples), abs=4 * np.std(samples) / np.sqrt(draws))


def test_bound_does_not_fall_over_any_sub_update():
    received, beats, dopplers, factors = problem()
    points = np.stack([beats, dopplers], axis=1) + 0.01
    precisions, noise_precision = np.array([1.0, 1.0, 1.0]), 1.0
    factors = line_factors(points[:, 0], SHAPE[1]), line_factors(points[:, 1], SHAPE[0])
    active = posterior(received, factors, precisions, noise_precision)
    last = bound(received, factors, active, noise_precision)
    for _ in range(6):
        for index in range(3):
            # weight precision together with the weights
            precision = converged_precision(*active.flat_prior_moments(index))
            active.set_precision(index, precision)
            now = bound(received, factors, active, noise_precision)
            assert now >= last - 1e-9 * abs(last)
            last = now
            # dispersion parameters together with the weights, (70)
            keep = np.arange(3) != index
            others = active.without(index)
            other_factors = factors[0][keep], factors[1][keep]
            posterior_of_others = others.covariance, others.amplitudes[:, None], noise_precision
            columns = columns_as_parts(Columns(*other_factors, *posterior_of_others))
            precision = float(active.precisions[index])
            points[index] = ascend(points[index], precision, split(received), columns, 1)[:2]
            factors = line_factors(points[:, 0], SHAPE[1]), line_factors(points[:, 1], SHAPE[0])
            active = posterior(received, factors, active.precisions, noise_precision)
            now = bound(received, factors, active, noise_precision)
            assert now >= last - 1e-9 * abs(last)
            last = now
        # noise precision (65), then the weights at the new one
        error = np.sum(np.abs(received - synthesize(active.amplitudes, *factors)) ** 2)
        noise_precision = received.size / (float(error) + active.trace())
        now = bound(received, factors, active, noise_precision)
        assert now >= last - 1e-9 * abs(last)
        active = posterior(received, factors, active.precisions, noise_precision)
        last = bound(received, factors, active, noise_precision)
        assert last >= now - 1e-9 * abs(now)
