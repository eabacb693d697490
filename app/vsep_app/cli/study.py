"""``vsep study``: Monte-Carlo studies listed, run, drawn and summarised."""

import argparse
import sys
from collections import Counter
from pathlib import Path
from typing import Any, Final

from vsep.errors import InputError
from vsep.files.frame import write_frame
from vsep.files.results import as_json
from vsep.files.writing import write_table
from vsep.studies.catalogue import CATALOGUE, make_study
from vsep.studies.engine import finished_keys, pending_trials, record_study
from vsep.studies.frames import trial_frame
from vsep.studies.rows import read_rows, row_key, torn_bytes
from vsep.studies.study import CHANGEABLE, GAP_SETTINGS, Study, Trial, TrialSettings
from vsep.studies.summary import summarise
from vsep.studies.trial import FAILED, Row, is_missing, run_trial
from vsep_app.cli.estimator_options import (
    add_schedule_option,
    add_seed_option,
    add_workers_option,
    method_settings,
)
from vsep_app.cli.progress import counter, say
from vsep_app.cli.shared_options import (
    EXIT_INCOMPLETE,
    add_file,
    add_number,
    add_out,
    add_scheduler_option,
    defaults_of,
    given,
    option_of,
    refuse_unused,
    require_dashboard,
    require_folder,
    require_other_file,
)

DESCRIPTION = "Make the paper's figures again, with intervals."
EXAMPLES = """\
examples:
  vsep study list
  vsep study run fig-3 --points 3b --realizations 100 --workers 2 --out fig-3.jsonl
  vsep study plot fig-3.jsonl --out fig-3.html
  vsep study run fig-3 --repeat 20,17 --frame outlier.npz
      one trial alone, its rows on standard output, its frame for `vsep report` and the dashboard

A study that was stopped goes on where it was: give the same command again. So do rows that are
missing because a process was killed or memory, disk or network failed; the exit code is then 3.
"""
_OF_ALL_TRIALS: Final = ("realizations", "points", "out", "workers", "scheduler")
_RUNS: Final = {"a whole study": frozenset(_OF_ALL_TRIALS), "--repeat": frozenset({"frame"})}
_MOST_REASONS: Final = 5  # in the summary of a run
_TRIAL_SETTINGS: Final = ("seed", "schedule", "gospa_cutoff", "gospa_order")


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the commands of the command, with their options."""
    actions = parser.add_subparsers(title="commands", metavar="COMMAND", required=True)
    _add_action(actions, "list", "list the studies", _list)
    _add_run(_add_action(actions, "run", "run a study, or go on with it", _run))
    plot = _add_action(actions, "plot", "draw the rows of a study", _plot)
    plot.add_argument("rows", metavar="FILE", help="what `vsep study run` wrote")
    add_out(plot, "the figure, *.html, *.png, *.svg or *.pdf")
    summary = _add_action(actions, "summary", "write all figures with their intervals", _summarise)
    summary.add_argument("rows", metavar="FILE", help="what `vsep study run` wrote")
    add_out(summary, "a table, *.csv")


def _add_action(actions: Any, name: str, summary: str, action: Any) -> Any:
    parser = actions.add_parser(name, help=summary, allow_abbrev=False)
    parser.set_defaults(action=action)
    return parser


def _add_run(parser: Any) -> None:
    parser.add_argument("study", metavar="NAME", help=", ".join(CATALOGUE))
    add_number(parser, "--realizations", "per point (default: see `vsep study list`)", kind=int)
    parser.add_argument(
        "--points",
        metavar="WHICH",
        help="panels, indices and ranges, such as 3b,0,40-51 (default: all)",
    )
    add_file(parser, "--out", "the rows, one line of JSON each; appended to if it exists")
    parser.add_argument(
        "--repeat", metavar="POINT,REALIZATION", help="run this one trial and print its rows"
    )
    add_file(parser, "--frame", "with --repeat: keep the trial's frame as a frame file, *.npz")
    where = parser.add_argument_group("where")
    add_workers_option(where)
    add_scheduler_option(where)
    what = parser.add_argument_group("what")
    add_seed_option(what, "of the study")
    what.add_argument(
        "--estimator",
        action="append",
        metavar="NAME",
        help="run this method only; may be given several times; one of "
        f"{', '.join(method_settings())} (default: those of the study)",
    )
    add_schedule_option(what)
    add_number(what, "--object-threshold-db", "in the place of the study's own threshold")
    what.add_argument(
        "--set",
        action="append",
        metavar="NAME=VALUE",
        help="another value of a setting of all points, may be given several times: "
        f"{', '.join(CHANGEABLE[1:])}; of the studies mru-*: {', '.join(GAP_SETTINGS)}",
    )
    defaults = defaults_of(TrialSettings)
    for name, meaning in (
        ("gospa_cutoff", "resolution cells beyond which an object is missed"),
        ("gospa_order", "order of GOSPA"),
    ):
        what.add_argument(
            option_of(name),
            type=float,
            metavar="X",
            help=f"{meaning} (default: {defaults[name]:g})",
        )


def run(options: argparse.Namespace) -> int:
    """List, run, draw or summarise studies."""
    code: int = options.action(options)
    return code


def _list(options: argparse.Namespace) -> int:
    """Write the studies with their points, panels and realisations to standard output."""
    del options
    for entry in CATALOGUE.values():
        points = entry.points
        panels = ", ".join(dict.fromkeys(point.panel for point in points))
        realizations = f"{entry.realizations} realization{'s' if entry.realizations > 1 else ''}"
        sys.stdout.write(
            f"{entry.name:<14}{entry.title}\n"
            f"{'':<14}{len(points)} points (panels {panels}), {realizations} each\n"
        )
    return 0


def _run(options: argparse.Namespace) -> int:
    """Run what is missing of a study, or repeat one trial of it."""
    study = _study(options)
    chosen = "a whole study" if options.repeat is None else "--repeat"
    refuse_unused(given(options, (*_OF_ALL_TRIALS, "frame")), (chosen,), _RUNS)
    if options.repeat is not None:
        return _repeat(study.trial(*_point_and_realization(options.repeat)), options.frame)
    if options.out is None:
        raise InputError("--out is missing; give the file for the rows, or --repeat a trial.")
    require_folder(options.out)
    pending = pending_trials(study, finished_keys(study, options.out))
    num_pending = sum(len(trial.methods) for trial in pending)
    if torn := torn_bytes(options.out):
        say(f"{options.out} was cut off amid a row; its last {torn} bytes are left out.")
    retried: list[Row] = []
    results = record_study(
        study,
        options.out,
        workers=1 if options.workers is None else options.workers,
        scheduler=options.scheduler,
        retried=retried.append,
    )
    try:
        with counter(study.num_rows, "row", done=study.num_rows - num_pending) as progress:
            for rows in results:
                progress.update(len(rows))
                _report_failures(rows)
    except KeyboardInterrupt:
        _summarise_run(study, options, len(retried))
        raise
    return _summarise_run(study, options, len(retried)) if num_pending else 0


def _summarise_run(study: Study, options: argparse.Namespace, num_retried: int) -> int:
    """Say how many rows there are, and what to type for those that are missing; the exit code."""
    rows = read_rows(options.out) if Path(options.out).exists() else []
    by_key = {row_key(row): row for row in rows}
    keys = (
        (study.name, index, realization, method)
        for index in study.point_indices
        for realization in range(study.realizations)
        for method in study.methods
    )
    own = [by_key[key] for key in keys if key in by_key]
    done = [row for row in own if row["status"] != FAILED]
    missing = study.num_rows - sum(not is_missing(row) for row in own)
    parts = [f"{len(done)} of {study.num_rows} rows done"]
    reasons = Counter(row["reason"] or "no reason given" for row in own if row["status"] == FAILED)
    for reason, count in reasons.most_common(_MOST_REASONS):
        parts.append(f"{count} failed ({reason})")
    if others := sum(reasons.values()) - sum(
        count for _, count in reasons.most_common(_MOST_REASONS)
    ):
        parts.append(f"{others} failed for other reasons")
    if num_retried:
        parts.append(f"{num_retried} retried")
    say(f"{'; '.join(parts)}; the rows are in {options.out}.")
    if missing == 0:
        return 0
    are = "row is" if missing == 1 else "rows are"
    say(f"{missing} {are} missing; to go on, type: {options.typed}")
    return EXIT_INCOMPLETE


def _plot(options: argparse.Namespace) -> int:
    """Draw the rows of one or several studies."""
    require_other_file(options.out, (options.rows,), "would overwrite the rows")
    require_folder(options.out)
    figure = require_dashboard("vsep_app.figures.study_figure", "study plot")
    figure.write_study_figure(_rows(options.rows), Path(options.out))
    return 0


def _summarise(options: argparse.Namespace) -> int:
    """Write every figure with its interval as one line of a table."""
    require_other_file(options.out, (options.rows,), "would overwrite the rows")
    require_folder(options.out)
    if Path(options.out).suffix.lower() != ".csv":
        raise InputError(f"The summary {options.out!r} must end in .csv.")
    measures = [measure.as_row() for measure in summarise(_rows(options.rows))]
    names = list(dict.fromkeys(name for measure in measures for name in measure))
    write_table(options.out, names, ([row.get(name, "") for name in names] for row in measures))
    return 0


def _study(options: argparse.Namespace) -> Study:
    settings = given(options, _TRIAL_SETTINGS)
    study = make_study(
        options.study,
        realizations=options.realizations,
        methods=tuple(options.estimator) if options.estimator else None,
        selection=options.points,
        settings=TrialSettings(**settings),
        object_threshold_db=options.object_threshold_db,
        changes=dict(_setting(text) for text in options.set or ()),
    )
    refuse_unused(given(options, ("schedule",)), study.methods, method_settings())
    return study


def _setting(text: str) -> tuple[str, Any]:
    """Read NAME=VALUE; the value is a number, or a word."""
    name, equals, value = text.partition("=")
    if not (name and equals and value):
        raise InputError(f"--set is {text!r}; it must be NAME=VALUE.")
    for kind in (int, float):
        try:
            return name, kind(value)
        except ValueError:
            continue
    return name, value


def _point_and_realization(text: str) -> tuple[int, int]:
    parts = text.split(",")
    if len(parts) != 2 or not all(part.strip().isdecimal() for part in parts):
        raise InputError(
            f"--repeat is {text!r}; it must be two integers, point and realization: 20,17."
        )
    return int(parts[0]), int(parts[1])


def _repeat(trial: Trial, frame: str | None) -> int:
    """Print the rows of one trial and keep its frame: that with bursts, if a method sees them."""
    if frame is not None:
        require_folder(frame)
        write_frame(frame, trial_frame(trial, trial.methods[0]))
    sys.stdout.write("".join(as_json(row) + "\n" for row in run_trial(trial)))
    return 0


def _report_failures(rows: list[Row]) -> None:
    for row in (row for row in rows if row["status"] == FAILED):
        where = f"point {row['point_index']}, realization {row['realization']}, {row['method']}"
        say(f"{where}: {row['reason']}")


def _rows(path: str) -> list[Row]:
    rows = read_rows(path)
    if not rows:
        raise InputError(f"{path} holds no rows; run a study into it first.")
    return rows
