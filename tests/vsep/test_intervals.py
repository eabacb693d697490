import math

import numpy as np
import pytest
from scipy import stats

from vsep import InputError
from vsep.analysis.intervals import (
    binomial_interval,
    bootstrap_interval,
    mean,
    median,
    poisson_interval,
    root_mean_square,
)


@pytest.mark.parametrize(("successes", "trials"), [(0, 20), (1, 20), (13, 20), (20, 20)])
def test_binomial_ends_are_those_of_clopper_and_pearson(successes, trials):
    interval = binomial_interval(successes, trials, level=0.9)
    exact = stats.binomtest(successes, trials).proportion_ci(0.9, method="exact")
    assert (interval.low, interval.high) == pytest.approx((exact.low, exact.high), abs=1e-10)
    assert interval.method == "Clopper-Pearson"


@pytest.mark.parametrize("count", [0, 1, 7, 400])
def test_poisson_ends_leave_half_of_the_rest_on_either_side(count):
    interval = poisson_interval(count, 50, level=0.9)
    assert stats.poisson.cdf(count, interval.high * 50) == pytest.approx(0.05, rel=1e-6)
    if count:
        assert stats.poisson.sf(count - 1, interval.low * 50) == pytest.approx(0.05, rel=1e-6)
    else:
        assert interval.low == 0.0


def test_bootstrap_of_a_mean_is_as_wide_as_the_normal_interval():
    samples = np.random.default_rng(1).normal(size=400)
    interval = bootstrap_interval(samples)
    width = 2.0 * 1.96 * samples.std() / 20.0
    # A 2.5 % quantile of 1000 resamples has a standard error of sqrt(.025 .975 / 1000) / phi(1.96)
    # = 0.085 standard deviations of the mean; the width, of two ends, 0.12 of 3.92: 3.1 %; 4 sigma.
    assert interval.high - interval.low == pytest.approx(width, rel=0.125)
    assert interval.low < interval.value < interval.high
    assert interval.num_samples == 400


def test_bootstrap_covers_as_often_as_it_says():
    rng = np.random.default_rng(2)
    draws = rng.normal(size=(300, 80))
    covered = 0
    for samples in draws:
        interval = bootstrap_interval(samples, root_mean_square, level=0.8)
        covered += interval.low <= 1.0 <= interval.high
    # Binomial with 300 draws: a standard error of 2.3 %; four of them, and 3 % for the bootstrap's
    # own bias at 80 samples.
    assert covered / 300 == pytest.approx(0.8, abs=0.125)


def test_the_same_samples_give_the_same_interval_and_nan_is_left_out():
    samples = np.random.default_rng(3).exponential(size=50)
    with_gaps = np.concatenate([samples, [np.nan, np.nan]])
    assert bootstrap_interval(samples, median) == bootstrap_interval(with_gaps, median)


@pytest.mark.parametrize("samples", [[], [np.nan], [2.0]])
def test_too_few_samples_have_no_interval(samples):
    interval = bootstrap_interval(np.array(samples, dtype=float), mean)
    assert interval.method == "none"
    assert math.isnan(interval.low)
    assert math.isnan(interval.high)
    assert interval.num_samples == np.count_nonzero(np.isfinite(samples))


def test_no_trials_have_no_interval():
    assert math.isnan(binomial_interval(0, 0).value)


def test_impossible_counts_are_refused():
    with pytest.raises(InputError, match="between 0 and 3"):
        binomial_interval(4, 3)
    with pytest.raises(InputError, match="count"):
        poisson_interval(-1, 3)
    with pytest.raises(InputError, match="level"):
        bootstrap_interval(np.ones(3), level=1.5)
