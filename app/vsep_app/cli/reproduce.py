"""``vsep reproduce``: the figures and the numbers of both papers from one command."""

import argparse
import sys
import time
from pathlib import Path
from typing import Any

from vsep.files.writing import write_table, write_text
from vsep.reproduction.claims import judge
from vsep.reproduction.figures import FIGURES, Extent, Figure, chosen_figures
from vsep.reproduction.paper_claims import CLAIMS
from vsep.reproduction.recipe import read_recipes, record_recipe
from vsep.reproduction.table import commands_of, finding_lines, findings_markdown
from vsep.studies.catalogue import CATALOGUE
from vsep.studies.engine import finished_keys, pending_trials, record_study
from vsep.studies.rows import read_rows
from vsep.studies.summary import summarise
from vsep.studies.trial import FAILED, Row, is_missing
from vsep_app.cli.estimator_options import add_workers_option
from vsep_app.cli.progress import counter, say
from vsep_app.cli.shared_options import EXIT_INCOMPLETE, add_file, require_dashboard

DESCRIPTION = (
    "Make the figures of both papers again and check every number that they claim: pictures, "
    "tables with intervals, and one page with what is claimed, what is measured and a verdict."
)
EXAMPLES = """\
examples:
  vsep reproduce --list
  vsep reproduce --quick --out reproduction --workers 2
  vsep reproduce 3b 5d-f --full --out reproduction

A reproduction that was stopped goes on where it was: give the same command again. Quick and full
share their rows: full goes on from what quick has made.
"""
_MINUTE = 60.0


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of the command."""
    parser.add_argument(
        "figures", nargs="*", metavar="FIGURE", help=f"{', '.join(FIGURES)} (default: all)"
    )
    parser.add_argument(
        "--list", action="store_true", help="list the figures with the minutes that a core takes"
    )
    extent = parser.add_mutually_exclusive_group()
    extent.add_argument(
        "--quick", action="store_true", help="a few realizations, wide intervals (the default)"
    )
    extent.add_argument(
        "--full", action="store_true", help="as many realizations as the papers have, or more"
    )
    add_file(parser, "--out", "folder, made if need be (default: reproduction)", "DIR")
    add_workers_option(parser)
    parser.add_argument(
        "--scheduler", metavar="ADDRESS", help="use the workers of this Dask scheduler"
    )


def run(options: argparse.Namespace) -> int:
    """List the figures, or make them and the page of claims."""
    figures = chosen_figures(options.figures)
    if options.list:
        return _list(figures)
    extent: Extent = "full" if options.full else "quick"
    page = require_dashboard("vsep_app.report.reproduction", "reproduce")
    out = Path("reproduction" if options.out is None else options.out)
    (out / "rows").mkdir(parents=True, exist_ok=True)
    workers = options.workers or 1
    start = time.perf_counter()
    took = sum(figure.duration_s(extent, workers) for figure in figures) / _MINUTE
    say(f"{extent}: about {took:.0f} minutes on {workers} of this machine's cores.")
    complete = True
    for figure in figures:
        complete &= _make(figure, extent, out, options)
    recipes = read_recipes(out)
    rows = {
        name: _rows(out, FIGURES[name], recipe["extent"])
        for name, recipe in recipes.items()
        if name in FIGURES and _rows_path(out, FIGURES[name]).exists()
    }
    findings = judge([claim for claim in CLAIMS if claim.figure in rows], rows)
    lines = finding_lines(findings)
    if lines:
        _write_lines(out / "claims.csv", lines)
    made = commands_of({name: recipes[name]["extent"] for name in rows})
    machine = page.machine_text()
    write_text(out / "claims.md", findings_markdown(findings, made=made, machine=machine))
    pictures = {name: out / f"{name}.png" for name in rows}
    text = page.reproduction_html(findings, pictures, made=made, machine=machine)
    write_text(out / "index.html", text)
    say(f"{(time.perf_counter() - start) / _MINUTE:.1f} minutes; the page is {out / 'index.html'}.")
    return 0 if complete else EXIT_INCOMPLETE


def _list(figures: tuple[Figure, ...]) -> int:
    for figure in figures:
        times = (figure.duration_s(extent) / _MINUTE for extent in ("quick", "full"))
        quick, full = (f"{minutes:.1f}" for minutes in times)
        sys.stdout.write(
            f"{figure.name:<12}{figure.source}: {figure.title}\n"
            f"{'':<12}{figure.quick} or {figure.full} realizations, {quick} or {full} minutes\n"
        )
    return 0


def _rows_path(out: Path, figure: Figure) -> Path:
    return out / "rows" / f"{figure.name}.jsonl"


def _make(figure: Figure, extent: Extent, out: Path, options: argparse.Namespace) -> bool:
    """Run what is missing of a figure, draw it and sum it up; whether nothing is missing."""
    study, path = figure.study_of(extent), _rows_path(out, figure)
    pending = list(pending_trials(study, finished_keys(study, path)))
    results = record_study(study, path, workers=options.workers or 1, scheduler=options.scheduler)
    missing = sum(len(trial.methods) for trial in pending)
    with counter(study.num_rows, f"row of {figure.name}", study.num_rows - missing) as progress:
        for rows in results:
            progress.update(len(rows))
            for row in (row for row in rows if row["status"] == FAILED):
                say(f"{figure.name}, {row['method']}: {row['reason']}")
    rows = _rows(out, figure, extent)
    require_dashboard("vsep_app.figures.study_figure", "reproduce").write_study_figure(
        _drawn(rows), out / f"{figure.name}.png"
    )
    measures = [measure.as_row() for measure in summarise(rows)]
    if measures:
        _write_lines(out / f"{figure.name}.csv", measures)
        record_recipe(out, figure, extent)
    return not any(is_missing(row) for row in rows)


def _rows(out: Path, figure: Figure, extent: Extent) -> list[Row]:
    """Return the rows of an extent; a file may hold those of a larger one."""
    count = figure.study_of(extent).realizations
    return [row for row in read_rows(_rows_path(out, figure)) if row["realization"] < count]


def _drawn(rows: list[Row]) -> list[Row]:
    """Return what a figure is drawn of: of examples the first realisation."""
    return [
        row for row in rows if CATALOGUE[row["study"]].example is None or row["realization"] == 0
    ]


def _write_lines(path: Path, lines: list[dict[str, Any]]) -> None:
    names = list(dict.fromkeys(name for line in lines for name in line))
    write_table(str(path), names, ([line.get(name, "") for name in names] for line in lines))
