"""What ``vsep separability`` does once its options are read: evaluate, try, write."""

import argparse
import csv
import sys
from pathlib import Path

from tqdm import tqdm

from vsep._arrays import InputError, require_range
from vsep.laboratory.analytic import analytic_map
from vsep.laboratory.atlas import Atlas, make_atlas, table_rows
from vsep.laboratory.axes import parse_axis, parse_value
from vsep.laboratory.cells import Finding, explore
from vsep.laboratory.question import Cell, Question
from vsep.studies.study import TrialSettings

_SUFFIXES = (".html", ".png", ".csv")


def map_separability(options: argparse.Namespace) -> int:
    """Evaluate a map and write it as a document, a picture or a table."""
    out = Path(options.out)
    suffix = out.suffix.lower()
    if suffix not in _SUFFIXES:
        raise InputError(f"The map {options.out!r} must end in .html, .png or .csv.")
    if not out.parent.is_dir():
        raise InputError(f"{out} cannot be written: {out.parent} is no folder; make it first.")
    require_range("workers", options.workers, 1, 4096)
    question = _question(options)
    findings = _findings(question, options.workers)
    atlas = make_atlas(question, analytic_map(question), findings)
    if suffix == ".csv":
        _write_table(atlas, out)
        return 0
    from app.laboratory.figures import write_map

    write_map(atlas, out)
    return 0


def _question(options: argparse.Namespace) -> Question:
    return Question(
        x=parse_axis(options.x),
        y=parse_axis(options.y),
        scene=options.scene,
        fixed=tuple(parse_value(text) for text in options.set),
        method=options.estimator,
        trials=options.trials,
        settings=TrialSettings(seed=options.seed, schedule=options.schedule),
        false_alarm_rate=options.false_alarm_rate,
    )


def _findings(question: Question, workers: int) -> dict[Cell, Finding]:
    """Run the trials of all cells; those without a result are counted to standard error."""
    findings: dict[Cell, Finding] = {}
    if question.trials == 0:
        return findings
    # tqdm draws nothing by itself (None) where standard error is no terminal.
    with tqdm(total=question.x.count * question.y.count, unit="cell", disable=None) as progress:
        for finding in explore(question, workers=workers):
            findings[finding.cell] = finding
            progress.update(1)
    failed = sum(finding.num_failed for finding in findings.values())
    if failed:
        sys.stderr.write(f"vsep: {failed} trials have no result.\n")
    return findings


def _write_table(atlas: Atlas, out: Path) -> None:
    rows = table_rows(atlas)
    with out.open("w", encoding="utf-8", newline="") as file:
        table = csv.DictWriter(file, list(rows[0]))
        table.writeheader()
        table.writerows(rows)
