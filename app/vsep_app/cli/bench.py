"""``vsep bench``: any method on the frozen scenes."""

import argparse
import os
import sys
from pathlib import Path
from typing import Final

from vsep.bench.export import OPEN_SET, SHEET, export_frames
from vsep.bench.methods import read_method
from vsep.bench.scenes import DEFAULT_METHODS, FRAMES, SCENES, SEED, VERSION, bench_study
from vsep.bench.table import bench_table
from vsep.errors import InputError
from vsep.studies.engine import finished_keys, pending_trials, record_study
from vsep.studies.rows import read_rows, row_key
from vsep.studies.trial import FAILED, is_missing
from vsep_app.cli.estimator_options import add_workers_option
from vsep_app.cli.progress import counter, say
from vsep_app.cli.shared_options import EXIT_INCOMPLETE, add_file, add_number, require_folder

DESCRIPTION = (
    "Measure methods on frozen scenes: misses, false alarms, GOSPA, EVM, SINR, NSINR, gTNR, NMSE. "
    f"The scenes are of version {VERSION}, seed {SEED}."
)
EXAMPLES = """\
examples:
  vsep bench --list
  vsep bench --scenes simulation-2-b,semi-real --method factorised --method zeroing --out rows.jsonl
  vsep bench --export open-set
  vsep bench --method my_module:MyMethod --out rows.jsonl
      a method from outside: a function of received and mask that returns the cleaned frame, or a
      class as in assets/docs/extending.md; the module lies here or on Python's path

The rows are those of a study: the same command goes on where it was, and `vsep study summary` makes
a table of all figures with their intervals.
"""
_ALL: Final = "all"


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of the command."""
    parser.add_argument("--list", action="store_true", help="list the scenes")
    parser.add_argument(
        "--scenes",
        metavar="NAMES",
        default=_ALL,
        help="comma-separated names of the scenes (default: all)",
    )
    parser.add_argument(
        "--method",
        action="append",
        metavar="NAME",
        help="an estimator, a mitigation method or MODULE:OBJECT; may be given several times "
        f"(default: {', '.join(DEFAULT_METHODS)})",
    )
    add_number(parser, "--frames", f"of every scene (default: {FRAMES})", kind=int)
    add_workers_option(parser)
    parser.add_argument(
        "--scheduler", metavar="ADDRESS", help="use the workers of this Dask scheduler"
    )
    add_file(parser, "--out", "the rows, one line of JSON each; appended to if it exists")
    add_file(
        parser,
        "--export",
        "write frames of the scenes as frame files with truth, mask and a data sheet instead "
        f"(default of the scenes: {', '.join(OPEN_SET)}; one frame each)",
        "DIR",
    )


def run(options: argparse.Namespace) -> int:
    """List the scenes, or run what is missing and print the table."""
    if options.list:
        for scene in SCENES:
            sys.stdout.write(f"{scene.name:<24}{scene.help}\n")
        return 0
    if options.export is not None:
        scenes = OPEN_SET if options.scenes == _ALL else options.scenes.split(",")
        frames = 1 if options.frames is None else options.frames
        paths = export_frames(Path(options.export), scenes=scenes, frames=frames)
        say(f"{len(paths)} frames and {SHEET} are in {options.export}.")
        return 0
    if options.out is None:
        raise InputError("--out is missing; give the file for the rows, or --list.")
    require_folder(options.out)
    if os.getcwd() not in sys.path:
        sys.path.insert(0, os.getcwd())  # where a module of one's own lies
    study = bench_study(
        scenes=None if options.scenes == _ALL else options.scenes.split(","),
        methods=[read_method(text) for text in options.method or DEFAULT_METHODS],
        frames=FRAMES if options.frames is None else options.frames,
    )
    pending = pending_trials(study, finished_keys(study, options.out))
    missing = sum(len(trial.methods) for trial in pending)
    results = record_study(
        study, options.out, workers=options.workers or 1, scheduler=options.scheduler
    )
    with counter(study.num_rows, "row", done=study.num_rows - missing) as progress:
        for rows in results:
            progress.update(len(rows))
            for row in (row for row in rows if row["status"] == FAILED):
                say(f"{row['point']['panel']}, {row['method']}: {row['reason']}")
    names = {study.points[index].panel for index in study.point_indices}
    own = [
        row
        for row in read_rows(options.out)
        if row["point"]["panel"] in names and row["method"] in study.methods
    ]
    sys.stdout.write(bench_table(own))
    made = {row_key(row) for row in own if not is_missing(row)}
    return 0 if len(made) >= study.num_rows else EXIT_INCOMPLETE
