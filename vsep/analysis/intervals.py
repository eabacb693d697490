"""Confidence intervals: bootstrap for averages, exact ones for counts.

Every interval names its method, so that a table or a figure can state it.
"""

import math
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from functools import lru_cache
from typing import Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray
from scipy.special import betaincinv, gammaincinv

from vsep._typing import FloatArray
from vsep._validation import require_range
from vsep.errors import InputError

IntervalMethod: TypeAlias = Literal["bootstrap percentile", "Clopper-Pearson", "Garwood", "none"]
Statistic: TypeAlias = Callable[[FloatArray], FloatArray]
IndexArray: TypeAlias = NDArray[np.int32]

DEFAULT_LEVEL = 0.95
NUM_RESAMPLES = 1000
# Resamples are made in blocks of at most this many numbers, 16 MB of indices.
_BLOCK = 4_000_000
_SEED = 20_210_531


@dataclass(frozen=True, kw_only=True, slots=True)
class Interval:
    """A measured figure with its confidence interval."""

    #: the figure and the interval's ends; NaN if there was nothing to measure
    value: float
    low: float
    high: float
    level: float  #: confidence, 0.95 for 95 %
    method: IntervalMethod  #: how the interval was made; "none" if there is none
    num_samples: int  #: how many realisations went in


def mean(samples: FloatArray) -> FloatArray:
    """Average over the last axis; a statistic for `bootstrap_interval`."""
    return np.asarray(np.mean(samples, axis=-1))


def root_mean_square(samples: FloatArray) -> FloatArray:
    """Root mean square over the last axis; a statistic for `bootstrap_interval`."""
    return np.asarray(np.sqrt(np.mean(np.square(samples), axis=-1)))


def median(samples: FloatArray) -> FloatArray:
    """Median over the last axis; a statistic for `bootstrap_interval`."""
    return np.asarray(np.median(samples, axis=-1))


def bootstrap_interval(
    samples: FloatArray, statistic: Statistic = mean, *, level: float = DEFAULT_LEVEL
) -> Interval:
    """Percentile bootstrap interval of a statistic of independent samples.

    The resamples come from a fixed seed: the same samples give the same interval.

    Parameters
    ----------
    samples : (n,) float
        One value a realisation; NaN is left out.
    statistic : callable
        Reduces the last axis.
    level : float
        Confidence.

    Returns
    -------
    Interval
        Without ends if fewer than two samples are left.

    Examples
    --------
    >>> import numpy as np
    >>> interval = bootstrap_interval(np.arange(100.0))
    >>> interval.value, interval.low < 49.5 < interval.high, interval.method
    (49.5, True, 'bootstrap percentile')
    """
    require_range("confidence level", level, 0.01, 0.9999)
    defined = np.asarray(samples, dtype=np.float64)
    defined = defined[np.isfinite(defined)]
    count = len(defined)
    if count < 2:
        return _without_ends(float(statistic(defined)) if count else math.nan, level, count)
    estimates = np.concatenate([statistic(defined[chosen]) for chosen in _resamples(count)])
    low, high = np.quantile(estimates, [0.5 * (1.0 - level), 0.5 * (1.0 + level)])
    return Interval(
        value=float(statistic(defined)),
        low=float(low),
        high=float(high),
        level=level,
        method="bootstrap percentile",
        num_samples=count,
    )


def _without_ends(value: float, level: float, count: int) -> Interval:
    ends = {"low": math.nan, "high": math.nan}
    return Interval(value=value, level=level, method="none", num_samples=count, **ends)


def _resamples(count: int) -> Iterable[IndexArray]:
    """Yield blocks of resamples, one a row; those of a usual size are drawn once and kept."""
    rows = max(1, _BLOCK // count)
    return [_kept_resamples(count)] if rows >= NUM_RESAMPLES else _drawn_resamples(count, rows)


@lru_cache(maxsize=2)
def _kept_resamples(count: int) -> IndexArray:
    return next(iter(_drawn_resamples(count, NUM_RESAMPLES)))


def _drawn_resamples(count: int, rows: int) -> Iterator[IndexArray]:
    rng = np.random.default_rng(_SEED)
    for start in range(0, NUM_RESAMPLES, rows):
        shape = (min(rows, NUM_RESAMPLES - start), count)
        yield rng.integers(0, count, shape, dtype=np.int32)


def binomial_interval(successes: int, trials: int, *, level: float = DEFAULT_LEVEL) -> Interval:
    """Clopper-Pearson interval of a share: it covers at least at its level, at 0 and 1 too.

    Parameters
    ----------
    successes, trials : int
        0 <= successes <= trials.
    level : float
        Confidence.

    Raises
    ------
    InputError
        If there are more successes than trials, or fewer than none.

    Examples
    --------
    >>> interval = binomial_interval(0, 100)
    >>> interval.low, round(interval.high, 4)
    (0.0, 0.0362)
    """
    require_range("confidence level", level, 0.01, 0.9999)
    if not 0 <= successes <= trials:
        raise InputError(f"successes is {successes}; it must lie between 0 and {trials}.")
    if trials == 0:
        return _without_ends(math.nan, level, 0)
    tail = 0.5 * (1.0 - level)
    failures = trials - successes
    low = 0.0 if successes == 0 else float(betaincinv(successes, failures + 1, tail))
    high = 1.0 if failures == 0 else float(betaincinv(successes + 1, failures, 1.0 - tail))
    return Interval(
        value=successes / trials,
        low=low,
        high=high,
        level=level,
        method="Clopper-Pearson",
        num_samples=trials,
    )


def poisson_interval(count: int, exposure: int, *, level: float = DEFAULT_LEVEL) -> Interval:
    """Garwood's exact interval of a Poisson rate, for rare events such as false alarms.

    Parameters
    ----------
    count : int
        Events seen.
    exposure : int
        In how many frames, at least one.
    level : float
        Confidence.

    Raises
    ------
    InputError
        If the count is negative or there was no frame.

    Examples
    --------
    >>> interval = poisson_interval(10, 1000)
    >>> interval.value, round(interval.low, 4), round(interval.high, 4)
    (0.01, 0.0048, 0.0184)
    """
    require_range("confidence level", level, 0.01, 0.9999)
    require_range("count", count, 0, 2**62)
    require_range("exposure", exposure, 1, 2**62)
    tail = 0.5 * (1.0 - level)
    low = 0.0 if count == 0 else float(gammaincinv(count, tail))
    high = float(gammaincinv(count + 1, 1.0 - tail))
    return Interval(
        value=count / exposure,
        low=low / exposure,
        high=high / exposure,
        level=level,
        method="Garwood",
        num_samples=exposure,
    )
