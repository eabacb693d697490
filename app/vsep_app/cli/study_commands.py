"""What ``vsep study`` does once its options are read: list, run, plot, summary."""

import argparse
import csv
import sys
from pathlib import Path

from tqdm import tqdm

from vsep.errors import InputError
from vsep.files.frame import write_frame
from vsep.files.results import as_json
from vsep.studies.catalogue import CATALOGUE, make_study
from vsep.studies.engine import finished_keys, pending_trials, record_study
from vsep.studies.frames import trial_frame
from vsep.studies.rows import read_rows
from vsep.studies.study import Study, Trial, TrialSettings
from vsep.studies.summary import summarise
from vsep.studies.trial import FAILED, Row, run_trial


def list_studies(options: argparse.Namespace) -> int:
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


def run_study(options: argparse.Namespace) -> int:
    """Run what is missing of a study, or repeat one trial of it."""
    study = _study(options)
    if options.repeat is not None:
        return _repeat(study.trial(*_point_and_realization(options.repeat)), options.frame)
    if options.frame is not None:
        raise InputError("--frame keeps the frame of one trial; name it by --repeat.")
    if options.out is None:
        raise InputError("--out is missing; give the file for the rows, or --repeat a trial.")
    _require_folder(options.out)
    missing = sum(
        len(trial.methods) for trial in pending_trials(study, finished_keys(study, options.out))
    )
    num_failed = 0
    results = record_study(study, options.out, workers=options.workers, scheduler=options.scheduler)
    # tqdm draws nothing by itself (None) where standard error is no terminal.
    with tqdm(
        total=study.num_rows, initial=study.num_rows - missing, unit="row", disable=None
    ) as progress:
        for rows in results:
            progress.update(len(rows))
            num_failed += _report_failures(rows)
    if num_failed:
        sys.stderr.write(f"vsep: {num_failed} rows failed; their reasons are in {options.out}.\n")
    return 0


def plot_study(options: argparse.Namespace) -> int:
    """Draw the rows of one or several studies."""
    _require_other_file(options.rows, options.out)
    _require_folder(options.out)
    from vsep_app.figures.study_figure import write_study_figure

    write_study_figure(_rows(options.rows), Path(options.out))
    return 0


def summarise_study(options: argparse.Namespace) -> int:
    """Write every figure with its interval as one line of a table."""
    _require_other_file(options.rows, options.out)
    _require_folder(options.out)
    if Path(options.out).suffix.lower() != ".csv":
        raise InputError(f"The summary {options.out!r} must end in .csv.")
    measures = [measure.as_row() for measure in summarise(_rows(options.rows))]
    names = list(dict.fromkeys(name for measure in measures for name in measure))
    with open(options.out, "w", encoding="utf-8", newline="") as file:
        table = csv.DictWriter(file, names)
        table.writeheader()
        table.writerows(measures)
    return 0


def _study(options: argparse.Namespace) -> Study:
    return make_study(
        options.study,
        realizations=options.realizations,
        methods=tuple(options.estimator) if options.estimator else None,
        selection=options.points,
        settings=TrialSettings(
            seed=options.seed,
            schedule=options.schedule,
            gospa_cutoff=options.gospa_cutoff,
            gospa_order=options.gospa_order,
        ),
        object_threshold_db=options.object_threshold_db,
    )


def _point_and_realization(text: str) -> tuple[int, int]:
    parts = text.split(",")
    if len(parts) != 2 or not all(part.strip().isdecimal() for part in parts):
        raise InputError(
            f"--repeat is {text!r}; it must be two whole numbers, point and realization: 20,17."
        )
    return int(parts[0]), int(parts[1])


def _repeat(trial: Trial, frame: str | None) -> int:
    """Print the rows of one trial and keep its frame: that with bursts, if a method sees them."""
    if frame is not None:
        _require_folder(frame)
        write_frame(frame, trial_frame(trial, trial.methods[0]))
    sys.stdout.write("".join(as_json(row) + "\n" for row in run_trial(trial)))
    return 0


def _report_failures(rows: list[Row]) -> int:
    failed = [row for row in rows if row["status"] == FAILED]
    for row in failed:
        where = f"point {row['point_index']}, realization {row['realization']}, {row['method']}"
        tqdm.write(f"vsep: {where}: {row['reason']}", file=sys.stderr)
    return len(failed)


def _rows(path: str) -> list[Row]:
    rows = read_rows(path)
    if not rows:
        raise InputError(f"{path} holds no rows; run a study into it first.")
    return rows


def _require_other_file(rows: str, out: str) -> None:
    if Path(rows).resolve() == Path(out).resolve():
        raise InputError(f"--out {out} would overwrite the rows; give another file.")


def _require_folder(out: str) -> None:
    folder = Path(out).parent
    if not folder.is_dir():
        raise InputError(f"{out} cannot be written: {folder} is no folder; make it first.")
