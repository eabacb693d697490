"""Phases of the own oscillator against dense formulas, their bound and their false-alarm rate."""

import numpy as np
import pytest
from scipy.linalg import toeplitz
from scipy.stats import binom, f

from tests.vsep import oscillator_bench as bench
from vsep.inference.core.phase_estimate import PhaseProducts
from vsep.inference.core.receiver import PhasePrior

SHAPE = 16, 64
NO_PHASES = np.zeros((SHAPE[0], 1))
ONE = np.array([[0.11, 0.2]])


def products(level_db, theta, seed, shape=SHAPE, extra=0.0):
    """Products of one known line and what is left of the frame that theta turns."""
    rng = np.random.default_rng(seed)
    line = bench.lines(ONE, [level_db], shape, rng)
    frame = np.exp(1j * theta) * line + bench.noise(shape, rng) + extra
    return PhaseProducts(line[None], (frame - line)[None], np.zeros((shape[0], 1)), 1.0)


def autocovariance(prior, size):
    lags = np.arange(size)
    return prior.jitter_std**2 + prior.noise_std**2 * prior.decay**lags


@pytest.mark.parametrize("jitter_std", [0.0, 0.2])
def test_the_posterior_mean_is_that_of_the_dense_gaussian(jitter_std):
    rng = np.random.default_rng(1)
    signal = bench.lines(np.array([[0.1, 0.2], [0.17, -0.1]]), [30.0, 28.0], SHAPE, rng)
    residual = bench.noise(SHAPE, rng)
    prior = PhasePrior(jitter_std=jitter_std, noise_std=0.3, half_width=0.02)
    found = PhaseProducts(signal[None], residual[None], NO_PHASES, 2.0)._probable(prior)
    covariance = toeplitz(autocovariance(prior, SHAPE[1]))
    for ramp in range(SHAPE[0]):
        energy = np.abs(signal[ramp]) ** 2
        noisy = (signal[ramp].conj() * residual[ramp]).imag / energy
        told = covariance + np.diag(1.0 / (2.0 * 2.0 * energy))
        np.testing.assert_allclose(found[ramp], covariance @ np.linalg.solve(told, noisy))


def test_what_has_been_taken_off_counts_as_if_it_had_not():
    rng = np.random.default_rng(2)
    theta = 0.01 * rng.standard_normal(SHAPE)
    signal = bench.lines(ONE, [60.0], SHAPE, rng)
    frame = np.exp(1j * theta) * signal + bench.noise(SHAPE, rng)
    whole = PhaseProducts(signal[None], (frame - signal)[None], NO_PHASES, 1.0)
    rest = np.exp(-0.7j * theta) * frame - signal
    again = PhaseProducts(signal[None], rest[None], 0.7 * theta, 1.0)
    np.testing.assert_allclose(again.products, whole.products, rtol=0.0, atol=1e-9)


def test_phases_of_jitter_reach_their_bound():
    # A strong prior of no weight: errors of the phases, without mean and trend, by noise alone.
    level_db, errors = 50.0, []
    bound = SHAPE[0] / (2.0 * 10.0 ** (level_db / 10.0))  # 1/(2 lambda |x_p|^2)
    ramps = np.arange(SHAPE[0])
    for seed in range(60):
        phases = np.random.default_rng([3, seed]).normal(0.0, 0.1, SHAPE[0])
        phases -= np.polyval(np.polyfit(ramps, phases, 1), ramps)
        found = products(level_db, phases[:, None], [4, seed]).estimate(
            within_ramps=False, last=None
        )
        errors.append(found.phases[:, 0] - phases)
    variance = np.sum(np.square(errors)) / (60 * (SHAPE[0] - 2))
    # chi-square with 840 degrees of freedom: 4 deviations
    assert variance == pytest.approx(bound, rel=4.0 * np.sqrt(2.0 / 840.0))


def test_the_variance_of_jitter_is_that_of_its_ramps():
    variances = []
    for seed in range(60):
        phases = np.random.default_rng([5, seed]).normal(0.0, 0.005, SHAPE[0])
        found = products(75.0, phases[:, None], [6, seed]).estimate(within_ramps=False, last=None)
        variances.append(found.prior.jitter_std**2)
    assert np.mean(variances) == pytest.approx(25e-6, rel=4.0 * np.sqrt(2.0 / 840.0))


@pytest.mark.parametrize("within", [False, True])
def test_nothing_is_found_in_noise_or_beside_an_unmodelled_object(within):
    found = 0
    for seed in range(300):
        rng = np.random.default_rng([7, seed])
        beside = ONE + rng.uniform(-1.0, 1.0, (1, 2)) / np.array(SHAPE[::-1])
        other = bench.lines(beside, [rng.uniform(0.0, 50.0)], SHAPE, rng)
        made = products(60.0, 0.0, [8, seed], extra=other if seed % 2 else 0.0)
        found += made.estimate(within_ramps=within, last=None) is not None
    # an F test of 1e-5, and 6 deviations of a normal statistic
    assert found <= 1


@pytest.mark.parametrize("cells", [1.0, 4.0])
def test_phase_noise_is_found_with_its_deviation_and_width(cells):
    shape = 32, 128
    prior = PhasePrior(noise_std=0.01, half_width=cells / 128)
    root = np.linalg.cholesky(toeplitz(autocovariance(prior, 128)))
    rng = np.random.default_rng(9)
    theta = rng.standard_normal(shape) @ root.T
    found = products(75.0, theta, 10, shape).estimate(within_ramps=True, last=None)
    assert found.prior.noise_std == pytest.approx(0.01, rel=0.2)
    assert 0.6 < found.prior.half_width / prior.half_width < 1.6
    # per-sample noise of 8 mrad (75 dB over 4096 samples), smoothed over the process
    left = np.sqrt(np.mean((found.phases - theta) ** 2))
    covariance = toeplitz(autocovariance(prior, 128))
    told = covariance + np.eye(128) * 4096 / (2.0 * 10.0**7.5)
    best = np.sqrt(np.trace(covariance - covariance @ np.linalg.solve(told, covariance)) / 128)
    assert left < 1.15 * best


def test_as_often_as_it_says_the_test_finds_jitter():
    # The statistic at a rate that can be counted: its F distribution with P - 2 degrees each.
    from vsep.inference.core import phase_estimate

    ratios = []
    for seed in range(400):
        made = products(60.0, 0.0, [11, seed])
        energy = made.energy.sum(axis=1)
        sums = made.products.sum(axis=1) / energy
        turned, stretched = (
            float(energy @ phase_estimate._without_trend(part, energy) ** 2)
            for part in (sums.imag, sums.real)
        )
        ratios.append(turned / stretched)
    limit = f.isf(0.1, SHAPE[0] - 2, SHAPE[0] - 2)
    low, high = binom.interval(0.999, 400, 0.1)
    assert low <= np.sum(np.array(ratios) > limit) <= high


def test_an_object_beside_a_strong_one_is_no_phase():
    shape = 32, 128
    prior = PhasePrior(noise_std=0.01, half_width=4.0 / 128)
    root = np.linalg.cholesky(toeplitz(autocovariance(prior, 128)))
    theta = np.random.default_rng(12).standard_normal(shape) @ root.T
    beside = ONE + np.array([[3.4 / 128, 5.3 / 32]])
    line = bench.lines(beside, [35.0], shape, np.random.default_rng(13))
    alone = products(75.0, theta, 14, shape).estimate(within_ramps=True, last=None)
    found = products(75.0, theta, 14, shape, extra=line).estimate(within_ramps=True, last=None)
    # The half of the line that turns would make phases of 7 mrad; it stays out.
    assert np.std(found.phases - alone.phases) < 1.5e-3


def test_a_course_of_phases_is_no_jitter():
    ramps = np.linspace(-1.0, 1.0, SHAPE[0])[:, None]
    course = 0.1 * ramps**2  # of an object that accelerates
    assert products(70.0, course, 15).estimate(within_ramps=False, last=None) is None
    jitter = np.random.default_rng(16).normal(0.0, 0.03, (SHAPE[0], 1))
    assert products(70.0, jitter, 15).estimate(within_ramps=False, last=None) is not None
