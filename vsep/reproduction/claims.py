"""Claims of the sources that hold a number, and whether what is measured agrees.

A claim is a range for a measured figure. It is reproduced where the figure lies in the range,
contradicted where its whole interval lies outside, and undecided between the two: then more
realisations tell.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from math import inf, nan
from typing import Any, Final, Literal, TypeAlias

import numpy as np

from vsep._typing import FloatArray
from vsep.analysis.intervals import Interval
from vsep.studies.summary import Measure, summarise
from vsep.studies.trial import Row

Verdict: TypeAlias = Literal["reproduced", "not reproduced", "undecided", "not measured"]
Pick: TypeAlias = Literal["largest", "smallest", "crossing"]
Limits: TypeAlias = tuple[float, float]


@dataclass(frozen=True, kw_only=True, slots=True)
class Claim:
    """One sentence of a source."""

    figure: str  #: one of `vsep.reproduction.figures.FIGURES`
    section: str  #: where it stands
    says: str  #: what it says, in our words
    claimed: Limits  #: range that agrees with it
    #: what is measured: method and metric, of the points whose parameters lie in these ranges, or
    #: are these texts
    method: str
    metric: str
    where: Mapping[str, Limits | str] = field(default_factory=dict)
    #: of several points the one with the largest or smallest figure; or where over the parameter of
    #: `where` the figure crosses zero
    pick: Pick = "largest"
    remark: str = ""  #: for the reader, where the verdict needs a word

    def is_about(self, point: Mapping[str, Any]) -> bool:
        """Whether a point of its figure is one of those that it is about."""
        return all(_within(point[name], limits) for name, limits in self.where.items())


@dataclass(frozen=True, kw_only=True, slots=True)
class Finding:
    """A claim beside what was measured."""

    claim: Claim
    interval: Interval
    verdict: Verdict
    versions: tuple[str, ...]  #: that made the rows


_NOTHING: Final = Interval(value=nan, low=nan, high=nan, level=0.95, method="none", num_samples=0)


def judge(claims: Sequence[Claim], rows: Mapping[str, Sequence[Row]]) -> list[Finding]:
    """Measure claims.

    Parameters
    ----------
    claims : sequence of Claim
        In the order of the table.
    rows : mapping
        Rows by figure; claims of other figures are not measured.
    """
    measures: dict[str, list[Measure]] = {}
    for name, own in rows.items():
        metrics = dict.fromkeys(claim.metric for claim in claims if claim.figure == name)
        measures[name] = summarise(own, metrics)
    return [_finding(claim, measures.get(claim.figure, [])) for claim in claims]


def _finding(claim: Claim, measures: Sequence[Measure]) -> Finding:
    own = [
        measure
        for measure in measures
        if (measure.method, measure.metric) == (claim.method, claim.metric)
        and claim.is_about(measure.point)
    ]
    own = [measure for measure in own if np.isfinite(measure.interval.value)]
    interval = _picked(claim, own) if own else _NOTHING
    versions = sorted({version for measure in own for version in measure.versions})
    return Finding(
        claim=claim,
        interval=interval,
        verdict=verdict_of(interval, claim.claimed),
        versions=tuple(versions),
    )


def verdict_of(interval: Interval, claimed: Limits) -> Verdict:
    """Compare a measured figure with a range.

    Examples
    --------
    >>> from vsep.analysis.intervals import binomial_interval
    >>> verdict_of(binomial_interval(0, 500), (0.0, 0.05))
    'reproduced'
    >>> verdict_of(binomial_interval(0, 500), (0.5, 1.0))
    'not reproduced'
    """
    low, high = claimed
    if not np.isfinite(interval.value):
        return "not measured"
    if low <= interval.value <= high:
        return "reproduced"
    ends = interval.value, interval.low, interval.high
    known = [end for end in ends if np.isfinite(end)]
    return "not reproduced" if max(known) < low or min(known) > high else "undecided"


def _within(value: Any, limits: Limits | str) -> bool:
    if isinstance(limits, str):
        return bool(value == limits)
    return value is not None and limits[0] <= value <= limits[1]


def _picked(claim: Claim, measures: Sequence[Measure]) -> Interval:
    if claim.pick == "crossing":
        return _crossing(next(iter(claim.where)), measures)
    best = max if claim.pick == "largest" else min
    return best((measure.interval for measure in measures), key=lambda each: each.value)


def _crossing(name: str, measures: Sequence[Measure]) -> Interval:
    """Where a figure goes through zero over a parameter, on straight lines between the points."""
    ordered = sorted(measures, key=lambda measure: float(measure.point[name]))
    x = np.array([float(measure.point[name]) for measure in ordered])
    places = [
        _zero(x, np.array([getattr(measure.interval, end) for measure in ordered]))
        for end in ("value", "low", "high")
    ]
    ends = [place for place in places[1:] if np.isfinite(place)]
    first = ordered[0].interval
    return Interval(
        value=places[0],
        low=min(ends, default=nan),
        high=max(ends, default=nan),
        level=first.level,
        method=first.method,
        num_samples=first.num_samples,
    )


def _zero(x: FloatArray, y: FloatArray) -> float:
    for left in range(len(x) - 1):
        here, there = y[left], y[left + 1]
        if here * there <= 0.0 and here != there:
            return float(x[left] - here * (x[left + 1] - x[left]) / (there - here))
    return nan


def limits_text(limits: Limits) -> str:
    """Say a range in words.

    Examples
    --------
    >>> limits_text((0.0, inf)), limits_text((-inf, 0.2)), limits_text((5.0, 10.0))
    ('at least 0', 'at most 0.2', '5 to 10')
    """
    low, high = limits
    if high == inf:
        return f"at least {low:g}"
    return f"at most {high:g}" if low == -inf else f"{low:g} to {high:g}"
