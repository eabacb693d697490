"""Table of claims: claimed, measured, interval, verdict, as text and as lines of a file."""

from collections.abc import Mapping, Sequence
from math import isfinite
from typing import Any, Final

from vsep.analysis.intervals import Interval
from vsep.reproduction.claims import Finding, limits_text
from vsep.reproduction.figures import FIGURES, Extent

HEADINGS: Final = ("section", "the paper says", "agrees if", "measured", "frames", "verdict")
_SIGNIFICANT_DIGITS = 6


def command_of(figure: str) -> str:
    """Return what makes a figure in full.

    Examples
    --------
    >>> command_of("3b")
    'vsep reproduce 3b --full --out reproduction'
    """
    return f"vsep reproduce {figure} --full --out reproduction"


def commands_of(extents: Mapping[str, Extent]) -> str:
    """Return what made figures, one line an extent.

    Examples
    --------
    >>> commands_of({"3b": "full", "7": "full"})
    'vsep reproduce 3b 7 --full --out reproduction'
    """
    lines = []
    for extent in dict.fromkeys(extents.values()):
        names = " ".join(name for name in FIGURES if extents.get(name) == extent)
        lines.append(f"vsep reproduce {names} --{extent} --out reproduction")
    return "\n".join(lines)


def measured_text(interval: Interval) -> str:
    """Say a measured figure with its interval, to three digits.

    Examples
    --------
    >>> from vsep.analysis.intervals import binomial_interval
    >>> measured_text(binomial_interval(1, 2))
    '0.5 [0.0126, 0.987]'
    """
    if not isfinite(interval.value):
        return ""
    if not (isfinite(interval.low) and isfinite(interval.high)):
        return f"{interval.value:.3g}"
    return f"{interval.value:.3g} [{interval.low:.3g}, {interval.high:.3g}]"


def finding_lines(findings: Sequence[Finding]) -> list[dict[str, Any]]:
    """Return one flat dictionary a claim, for a table in a file."""
    return [
        {
            "figure": finding.claim.figure,
            "section": finding.claim.section,
            "says": finding.claim.says,
            "method": finding.claim.method,
            "metric": finding.claim.metric,
            "claimed_low": finding.claim.claimed[0],
            "claimed_high": finding.claim.claimed[1],
            "value": _short(finding.interval.value),
            "low": _short(finding.interval.low),
            "high": _short(finding.interval.high),
            "interval": finding.interval.method,
            "realizations": finding.interval.num_samples,
            "verdict": finding.verdict,
            "version": " ".join(finding.versions),
            "command": command_of(finding.claim.figure),
        }
        for finding in findings
    ]


def cells_of(finding: Finding) -> tuple[str, ...]:
    """Return the cells of a claim under `HEADINGS`."""
    claim = finding.claim
    return (
        claim.section,
        f"{claim.says} [{claim.remark}]" if claim.remark else claim.says,
        f"{claim.metric.replace('_', ' ')} of {claim.method} {limits_text(claim.claimed)}",
        measured_text(finding.interval),
        str(finding.interval.num_samples),
        finding.verdict,
    )


def findings_markdown(findings: Sequence[Finding], *, made: str, machine: str) -> str:
    """Return the page of all claims, a table for every figure.

    Parameters
    ----------
    findings : sequence of Finding
        In their order.
    made, machine : str
        How the figures were made, and where.
    """
    counts = {finding.verdict: 0 for finding in findings}
    for finding in findings:
        counts[finding.verdict] += 1
    summary = ", ".join(f"{count} {verdict}" for verdict, count in counts.items())
    parts = [
        "# Reproduction\n",
        "Every sentence of the sources' evaluation that holds a number, beside what *vsep* "
        "measures. This page is written by the command itself:\n",
        f"```sh\n{made}\n```\n",
        f"{len(findings)} claims: {summary}. {machine}\n",
        "A claim is a range for a measured figure, our reading of the sentence. It is reproduced "
        "where the figure lies in the range, not reproduced where its whole 95 % interval lies "
        "outside, and undecided between the two. In brackets stands what we add. Methods bear the "
        "names of *vsep*: `factorised` is the proposed variant, `object-only` no mitigation.\n",
    ]
    for name, figure in FIGURES.items():
        own = [finding for finding in findings if finding.claim.figure == name]
        if own:
            rows = [HEADINGS, ("---",) * len(HEADINGS), *(cells_of(finding) for finding in own)]
            table = "\n".join(f"| {' | '.join(cells)} |" for cells in rows)
            parts.append(f"## {figure.source}: {name}, {figure.title}\n")
            parts.append(f"```sh\n{command_of(name)}\n```\n")
            parts.append(f"{table}\n")
    return "\n".join(parts)


def _short(value: float) -> float:
    return float(f"{value:.{_SIGNIFICANT_DIGITS}g}")
