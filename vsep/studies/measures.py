"""Metrics of one method at one point, each with its interval.

Realisations are the independent samples: a bootstrap resamples frames, never objects within a
frame. Paired figures compare with the run without interference on the same objects and noise.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TypeAlias

import numpy as np

from vsep._typing import FloatArray
from vsep.analysis.intervals import (
    Interval,
    Statistic,
    binomial_interval,
    bootstrap_interval,
    mean,
    median,
    poisson_interval,
    root_mean_square,
)
from vsep.analysis.signal_metrics import SIGNAL_METRICS
from vsep.studies.groups import (
    Group,
    mean_assigned_errors,
    number,
    single_object_errors,
    standardised_errors,
)
from vsep.studies.methods import MASKED, NO_INTERFERENCE
from vsep.studies.trial import Row

Metric: TypeAlias = Callable[[Group], Interval]

MANY_FALSE_ALARMS = 5
_RARE = 10


def _share(hits: Sequence[bool]) -> Interval:
    return binomial_interval(sum(hits), len(hits))


def _singles(group: Group) -> Sequence[Row]:
    return [row for row in group.rows if row["num_objects_true"] == 1]


def _detection_rate(group: Group) -> Interval:
    return _share(np.isfinite(single_object_errors(_singles(group))).tolist())


def _share_of_rows(holds: Callable[[Row], bool]) -> Metric:
    return lambda group: _share([holds(row) for row in group.rows])


def _rmse(*, exact: bool, relative: bool) -> Metric:
    def metric(group: Group) -> Interval:
        errors = single_object_errors(group.rows, exact=exact)
        scale = group.column("root_crlb") if relative else 1.0
        return bootstrap_interval(errors / scale, root_mean_square)

    return metric


def _paired_rmse(group: Group) -> Interval:
    difference = single_object_errors(group.rows) - single_object_errors(group.references)
    return _paired(group, difference / group.column("root_crlb"), root_mean_square)


def _paired(group: Group, differences: FloatArray, statistic: Statistic) -> Interval:
    """Measure differences to the reference; the reference itself has none to show."""
    own = group.rows[0]["method"] == NO_INTERFERENCE
    return bootstrap_interval(np.zeros(0) if own else differences, statistic)


def _count(name: str) -> Metric:
    def metric(group: Group) -> Interval:
        counts = group.column(name)
        noise = all(row["num_objects_true"] == 0 for row in group.rows)
        # Rare events are independent; a bootstrap of none or a few of them is far too narrow.
        if noise or counts.sum() < _RARE:
            return poisson_interval(int(counts.sum()), len(counts))
        return bootstrap_interval(counts)

    return metric


def _false_alarm_ratio(group: Group) -> Interval:
    """Divide the false alarms of noise alone by the rate that was asked for."""
    asked = group.rows[0]["point"]["false_alarm_rate"]
    if asked is None:
        return bootstrap_interval(np.zeros(0))
    found = _count("false_alarms")(group)
    return replace(found, value=found.value / asked, low=found.low / asked, high=found.high / asked)


def _average(name: str) -> Metric:
    return lambda group: bootstrap_interval(group.column(name), mean)


def _middle(name: str) -> Metric:
    return lambda group: bootstrap_interval(group.column(name), median)


def _excess(name: str) -> Metric:
    def metric(group: Group) -> Interval:
        differences = group.column(name) - group.reference_column(name)
        known = differences[np.isfinite(differences)]
        own = group.rows[0]["method"] == NO_INTERFERENCE
        if own or len(known) == 0 or np.sum(np.abs(known)) >= _RARE:
            return _paired(group, differences, mean)
        return _difference_of_rare(known)

    return metric


def _difference_of_rare(differences: FloatArray) -> Interval:
    """Bound a mean difference that few frames make: what was gained and lost are rare events.

    The ends of both exact intervals are put together in the worst way, which covers more often
    than the level says; a bootstrap of nothing but zeros would have no width at all.
    """
    count = len(differences)
    more = poisson_interval(int(np.sum(np.maximum(differences, 0.0))), count)
    fewer = poisson_interval(int(np.sum(np.maximum(-differences, 0.0))), count)
    return replace(
        more, value=more.value - fewer.value, low=more.low - fewer.high, high=more.high - fewer.low
    )


def _gospa_over_masked(group: Group) -> Interval:
    """Cost of a frame above that of the masked estimator on it."""
    own = group.rows[0]["method"] == MASKED
    differences = group.column("gospa") - group.masked_column("gospa")
    return bootstrap_interval(np.zeros(0) if own else differences, mean)


def _within(deviations: float) -> Metric:
    def metric(group: Group) -> Interval:
        ratios = [np.abs(standardised_errors(row)) for row in group.rows]
        shares = [np.mean(ratio <= deviations) if len(ratio) else np.nan for ratio in ratios]
        return bootstrap_interval(np.array(shares, dtype=np.float64), mean)

    return metric


METRICS: dict[str, Metric] = {
    "detection_rate": _detection_rate,
    "exact_order_rate": _share_of_rows(lambda row: row["num_objects"] == row["num_objects_true"]),
    "rmse_detected": _rmse(exact=False, relative=False),
    "rmse_exact": _rmse(exact=True, relative=False),
    "rmse_detected_over_crlb": _rmse(exact=False, relative=True),
    "rmse_exact_over_crlb": _rmse(exact=True, relative=True),
    "paired_rmse_over_crlb": _paired_rmse,
    "root_crlb": lambda group: bootstrap_interval(group.column("root_crlb"), root_mean_square),
    "mean_assigned_error": lambda group: bootstrap_interval(mean_assigned_errors(group)),
    "error_over_bound": _average("error_over_bound"),
    "misses": _count("misses"),
    "false_alarms": _count("false_alarms"),
    "false_alarm_ratio": _false_alarm_ratio,
    "excess_misses": _excess("misses"),
    "excess_false_alarms": _excess("false_alarms"),
    "many_false_alarms_rate": _share_of_rows(
        lambda row: number(row["false_alarms"]) > MANY_FALSE_ALARMS
    ),
    "gospa": _average("gospa"),
    "gospa_over_masked": _gospa_over_masked,
    **{name: _average(name) for name in SIGNAL_METRICS},
    "evm": _average("evm"),
    "nmse": _average("nmse"),
    "within_one_std": _within(1.0),
    "within_two_std": _within(2.0),
    "separability_db": _middle("separability_db"),
    "separability_weakest_db": _middle("separability_weakest_db"),
    "mask_missed": _average("mask_missed"),
    "mask_false": _average("mask_false"),
    "channel_components": _average("channel_components"),
    "gap_error_db": _average("gap_error_db"),
    "iterations_to_plain": _average("iterations_to_plain"),
    "iteration_ms": _middle("iteration_ms"),
    "num_clean": _average("num_clean"),
    "operator_megabytes": _average("operator_megabytes"),
    "iterations": _average("iterations"),
    "seconds": _middle("seconds"),
    "unconverged_rate": _share_of_rows(lambda row: row["termination"] != "converged"),
}
