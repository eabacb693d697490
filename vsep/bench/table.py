"""Table of the bench: one line for every scene and method, a figure with its interval a column."""

from collections.abc import Iterable
from typing import Final

from vsep.analysis.intervals import Interval
from vsep.studies.summary import Measure, summarise
from vsep.studies.trial import Row

COLUMNS: Final = {
    "misses": "misses",
    "false_alarms": "false alarms",
    "gospa": "GOSPA [cells]",
    "evm": "EVM",
    "sinr_db": "SINR [dB]",
    "nsinr_db": "NSINR [dB]",
    "gtnr": "gTNR",
    "nmse": "NMSE",
    "seconds": "seconds",
}
"""Metrics of the table with their headings."""


def bench_measures(rows: Iterable[Row]) -> list[Measure]:
    """Measure every scene and method by the metrics of the bench, with intervals."""
    return summarise(rows, COLUMNS)


def bench_table(rows: Iterable[Row]) -> str:
    """Return the table as text, in Markdown.

    Examples
    --------
    >>> bench_table([]).splitlines()[0][:54]
    '| scene | method | frames | misses | false alarms | GO'
    """
    lines: dict[tuple[str, str], dict[str, Interval]] = {}
    for measure in bench_measures(rows):
        line = lines.setdefault((measure.point["panel"], measure.method), {})
        line[measure.metric] = measure.interval
    head = ["scene", "method", "frames", *COLUMNS.values()]
    body = [
        [
            scene,
            method,
            str(max(interval.num_samples for interval in line.values())),
            *(_cell(line.get(name)) for name in COLUMNS),
        ]
        for (scene, method), line in lines.items()
    ]
    return "".join(f"| {' | '.join(cells)} |\n" for cells in (head, ["---"] * len(head), *body))


def _cell(interval: Interval | None) -> str:
    if interval is None:
        return ""
    value = f"{interval.value:.3g}"
    if interval.method == "none":
        return value
    return f"{value} [{interval.low:.3g}, {interval.high:.3g}]"
