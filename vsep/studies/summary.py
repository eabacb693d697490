"""Measures with intervals, summed up from the rows of one or several studies.

Every figure is of one point and one method. Rows that failed are left out.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from vsep._validation import require_choice
from vsep.analysis.intervals import Interval
from vsep.studies.groups import groups
from vsep.studies.measures import METRICS
from vsep.studies.trial import Row

# A table is read by people; intervals are wider than the sixth digit.
_SIGNIFICANT_DIGITS = 6


@dataclass(frozen=True, kw_only=True, slots=True)
class Measure:
    """One figure of one method at one point."""

    study: str  #: name of the study
    point_index: int  #: which point of it
    point: Mapping[str, Any]  #: its parameters by name
    #: what was measured of which method
    method: str
    metric: str
    interval: Interval  #: the figure, its interval, how that was made, and of how many realisations
    versions: tuple[str, ...]  #: those of this package that made the rows

    def as_row(self) -> dict[str, Any]:
        """Return the figure as a flat dictionary."""
        interval = self.interval
        return {
            "study": self.study,
            "point_index": self.point_index,
            **self.point,
            "method": self.method,
            "metric": self.metric,
            "value": _short(interval.value),
            "low": _short(interval.low),
            "high": _short(interval.high),
            "level": interval.level,
            "interval": interval.method,
            "realizations": interval.num_samples,
            "version": " ".join(self.versions),
        }


def summarise(rows: Iterable[Row], metrics: Iterable[str] | None = None) -> list[Measure]:
    """Measure every method at every point.

    Parameters
    ----------
    rows : iterable of dict
        Of one or several studies, in any order.
    metrics : iterable of str, optional
        Names of `METRICS`; all that make sense by default.

    Returns
    -------
    list of Measure
        Without those that have nothing to measure.

    Raises
    ------
    InputError
        If a metric is unknown.
    """
    names = tuple(METRICS) if metrics is None else tuple(metrics)
    for name in names:
        require_choice("metric", name, METRICS)
    measures = []
    for (study, index, method), group in groups(rows).items():
        for name in names if group.rows else ():
            interval = METRICS[name](group)
            if interval.num_samples:
                measures.append(
                    Measure(
                        study=study,
                        point_index=index,
                        point=group.rows[0]["point"],
                        method=method,
                        metric=name,
                        interval=interval,
                        versions=tuple(sorted({row.get("version", "") for row in group.rows})),
                    )
                )
    return measures


def _short(value: float) -> float:
    return float(f"{value:.{_SIGNIFICANT_DIGITS}g}")
