"""Distributions over the realisations: box plots, and quantiles of standardised errors."""

from collections.abc import Mapping

import numpy as np
from scipy.special import betaincinv, ndtri

from vsep._typing import FloatArray
from vsep.analysis.intervals import DEFAULT_LEVEL
from vsep.studies.groups import Group, GroupKey, mean_assigned_errors, standardised_errors
from vsep.studies.methods import NO_INTERFERENCE
from vsep.studies.panel_specs import ERROR_MISSES_FALSE_ALARMS, BoxSpec, QuantileSpec
from vsep.studies.panels import Box, BoxPanel, FigurePanel, Series

_NUM_QUANTILES = 199


def box_panels(grouped: Mapping[GroupKey, Group], spec: BoxSpec) -> list[BoxPanel]:
    """Return boxes of error, misses and false alarms at one point.

    `grouped`: of `vsep.studies.summary.groups`; `spec`: which point, and the title. Returns three,
    or none if the point has no rows.
    """
    chosen = [
        (method, group)
        for (_, _, method), group in grouped.items()
        if group.rows
        and (spec.methods is None or method in spec.methods)
        and all(
            group.rows[0]["point"][name] == getattr(spec, name)
            for name in ("panel", "snr_db", "sir_db")
        )
    ]
    return [
        BoxPanel(
            title=spec.title,
            y_label=label,
            boxes=tuple(_box(method, _values(group, metric)) for method, group in chosen),
            note="boxes: quartiles; whiskers: 1.5 times their distance; numbers: outliers",
            log_y=metric == "mean_assigned_error",
        )
        for metric, label in ERROR_MISSES_FALSE_ALARMS
        if chosen
    ]


def _values(group: Group, metric: str) -> FloatArray:
    return mean_assigned_errors(group) if metric == "mean_assigned_error" else group.column(metric)


def _box(role: str, values: FloatArray) -> Box:
    defined = values[np.isfinite(values)]
    low = first = middle = third = high = np.nan
    outside = defined
    if len(defined):
        first, middle, third = np.quantile(defined, [0.25, 0.5, 0.75])
        reach = 1.5 * (third - first)
        within = (defined >= first - reach) & (defined <= third + reach)
        low, high, outside = defined[within].min(), defined[within].max(), defined[~within]
    return Box(
        role=role,
        low=float(low),
        first=float(first),
        middle=float(middle),
        third=float(third),
        high=float(high),
        outliers=tuple(sorted(outside.tolist())),
    )


def quantile_panels(grouped: Mapping[GroupKey, Group], spec: QuantileSpec) -> list[FigurePanel]:
    """Q-Q plot of errors over their reported standard deviation against the normal law.

    `grouped`: of `vsep.studies.summary.groups`; `spec`: whose points are pooled, and the title.
    Returns one, or none if there is no error.
    """
    ratios: dict[str, list[FloatArray]] = {}
    for (_, _, method), group in grouped.items():
        # Without a model of the interference no estimator can know its error.
        if method != "object-only" and group.rows and group.rows[0]["point"]["panel"] == spec.panel:
            ratios.setdefault(method, []).extend(standardised_errors(row) for row in group.rows)
    series = []
    # The reference first, so that the others are drawn over it.
    for method in sorted(ratios, key=lambda name: name != NO_INTERFERENCE):
        values = np.sort(np.concatenate(ratios[method]))
        if len(values):
            share = (np.arange(_NUM_QUANTILES) + 1.0) / (_NUM_QUANTILES + 1.0)
            none = np.full(_NUM_QUANTILES, np.nan)
            series.append(
                Series(
                    label=method,
                    role=method,
                    kind="line",
                    x=np.asarray(ndtri(share)),
                    y=np.quantile(values, share),
                    low=none,
                    high=none,
                )
            )
    if not series:
        return []
    counts = [sum(len(part) for part in parts) for parts in ratios.values()]
    series.append(_ideal_quantiles(min(count for count in counts if count)))
    return [
        FigurePanel(
            title=spec.title,
            x_label="quantile of the normal law",
            y_label="quantile of error / standard deviation",
            series=tuple(series),
            note=f"{100 * DEFAULT_LEVEL:g} % band of {min(counts)} independent errors; "
            "errors of close objects are not independent",
        )
    ]


def _ideal_quantiles(count: int) -> Series:
    """Diagonal with the pointwise band of order statistics, which are beta distributed."""
    share = (np.arange(_NUM_QUANTILES) + 1.0) / (_NUM_QUANTILES + 1.0)
    tail = 0.5 * (1.0 - DEFAULT_LEVEL)
    shapes = share * (count + 1.0), (1.0 - share) * (count + 1.0)
    ideal = np.asarray(ndtri(share))
    return Series(
        label="ideal",
        role="bound",
        kind="dashed",
        x=ideal,
        y=ideal,
        low=np.asarray(ndtri(betaincinv(*shapes, tail))),
        high=np.asarray(ndtri(betaincinv(*shapes, 1.0 - tail))),
    )
