"""What ``vsep separability`` does once its options are read: evaluate, try, write."""

import argparse
import csv
import sys
from pathlib import Path

from tqdm import tqdm

from vsep._validation import require_range
from vsep.errors import InputError
from vsep.separability.analytic import analytic_map
from vsep.separability.axes import parse_axis, parse_value
from vsep.separability.cells import CellResult, compute_map
from vsep.separability.map import SeparabilityMap, make_separability_map, table_rows
from vsep.separability.map_spec import Cell, MapSpec
from vsep.studies.study import TrialSettings

_SUFFIXES = (".html", ".png", ".svg", ".pdf", ".csv")


def map_separability(options: argparse.Namespace) -> int:
    """Evaluate a map and write it as a document, a picture or a table."""
    out = Path(options.out)
    suffix = out.suffix.lower()
    if suffix not in _SUFFIXES:
        raise InputError(f"The map {options.out!r} must end in .html, .png, .svg, .pdf or .csv.")
    if not out.parent.is_dir():
        raise InputError(f"{out} cannot be written: {out.parent} is no folder; make it first.")
    require_range("workers", options.workers, 1, 4096)
    spec = _spec(options)
    cell_results = _cell_results(spec, options.workers)
    separability_map = make_separability_map(spec, analytic_map(spec), cell_results)
    if suffix == ".csv":
        _write_table(separability_map, out)
        return 0
    from vsep_app.figures.map_file import write_map

    write_map(separability_map, out)
    return 0


def _spec(options: argparse.Namespace) -> MapSpec:
    return MapSpec(
        x=parse_axis(options.x),
        y=parse_axis(options.y),
        scene=options.scene,
        fixed=tuple(parse_value(text) for text in options.set),
        method=options.estimator,
        trials=options.trials,
        settings=TrialSettings(seed=options.seed, schedule=options.schedule),
        false_alarm_rate=options.false_alarm_rate,
    )


def _cell_results(spec: MapSpec, workers: int) -> dict[Cell, CellResult]:
    """Run the trials of all cells; those without a result are counted to standard error."""
    cell_results: dict[Cell, CellResult] = {}
    if spec.trials == 0:
        return cell_results
    # tqdm draws nothing by itself (None) where standard error is no terminal.
    with tqdm(total=spec.x.count * spec.y.count, unit="cell", disable=None) as progress:
        for cell_result in compute_map(spec, workers=workers):
            cell_results[cell_result.cell] = cell_result
            progress.update(1)
    failed = sum(cell_result.num_failed for cell_result in cell_results.values())
    if failed:
        sys.stderr.write(f"vsep: {failed} trials have no result.\n")
    return cell_results


def _write_table(separability_map: SeparabilityMap, out: Path) -> None:
    rows = table_rows(separability_map)
    with out.open("w", encoding="utf-8", newline="") as file:
        table = csv.DictWriter(file, list(rows[0]))
        table.writeheader()
        table.writerows(rows)
