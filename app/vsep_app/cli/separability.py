"""``vsep separability``: maps of when objects and interference can be told apart."""

import argparse
import sys
from pathlib import Path
from textwrap import fill
from typing import Any, Final

from vsep._validation import require_range
from vsep.errors import InputError
from vsep.files.writing import write_table
from vsep.presets.registry import PRESET_NAMES
from vsep.separability.analytic import analytic_map
from vsep.separability.axes import AXES, parse_axis, parse_value
from vsep.separability.cells import CellResult, compute_map
from vsep.separability.map import SeparabilityMap, make_separability_map, table_rows
from vsep.separability.map_spec import Cell, MapSpec
from vsep.studies.study import TrialSettings
from vsep_app.cli.estimator_options import (
    add_false_alarm_option,
    add_schedule_option,
    add_seed_option,
    add_workers_option,
    method_settings,
)
from vsep_app.cli.progress import counter
from vsep_app.cli.shared_options import (
    add_number,
    add_out,
    defaults_of,
    given,
    refuse_unused,
    require_dashboard,
    require_folder,
)

DESCRIPTION = (
    "Map condition (27), the coherence of the bases and the bound's loss over two parameters, and "
    "with --trials what an estimator does."
)
EXAMPLES = f"""\
examples:
  vsep separability --x sir_db=-40:40:33 --y slope_difference=-2e12:-1e11:33 --out map.html
  vsep separability --scene simulation-2-c --x object_delay=-2e-7:2e-7:33 --y num_objects=1:20:20 \\
      --set sir_db=-10 --trials 5 --workers 2 --out map.png

parameters, in SI units; a name may lack its unit:
{fill(", ".join(AXES), 98, initial_indent="  ", subsequent_indent="  ")}
"""
_SUFFIXES = (".html", ".png", ".svg", ".pdf", ".csv")
_OF_TRIALS: Final = ("estimator", "schedule", "false_alarm_rate", "workers")
_MAPS: Final = {
    "a map with trials": frozenset(_OF_TRIALS),
    "a map without trials": frozenset[str](),
}


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of the command."""
    defaults = defaults_of(MapSpec)
    for name in ("--x", "--y"):
        parser.add_argument(name, required=True, metavar="NAME=START:STOP:COUNT", help="an axis")
    parser.add_argument(
        "--scene",
        choices=PRESET_NAMES,
        default=defaults["scene"],
        help=f"radar, objects and paths (default: {defaults['scene']})",
    )
    parser.add_argument(
        "--set",
        action="append",
        default=[],
        metavar="NAME=VALUE",
        help="a parameter that is on no axis; the scene's own by default",
    )
    add_number(
        parser,
        "--trials",
        "trials of the estimator in every cell (default: 0, which takes a second)",
        kind=int,
        default=0,
    )
    parser.add_argument(
        "--estimator",
        metavar="NAME",
        help="the estimator of the trials, a method of `vsep study run` "
        f"(default: {defaults['method']})",
    )
    add_schedule_option(parser)
    add_false_alarm_option(parser)
    add_seed_option(parser, "draws objects, paths, noise")
    add_workers_option(parser)
    add_out(parser, "the map, *.html, *.png, *.svg, *.pdf or *.csv")


def run(options: argparse.Namespace) -> int:
    """Evaluate a map and write it as a document, a picture or a table."""
    out = Path(options.out)
    suffix = out.suffix.lower()
    if suffix not in _SUFFIXES:
        raise InputError(f"The map {options.out!r} must end in .html, .png, .svg, .pdf or .csv.")
    require_folder(out)
    workers = 1 if options.workers is None else options.workers
    require_range("workers", workers, 1, 4096)
    spec = _spec(options)
    drawing: Any = None
    if suffix != ".csv":
        drawing = require_dashboard("vsep_app.figures.map_file", f"separability --out {out}")
    separability_map = make_separability_map(spec, analytic_map(spec), _cell_results(spec, workers))
    if drawing is None:
        _write_table(separability_map, out)
    else:
        drawing.write_map(separability_map, out)
    return 0


def _spec(options: argparse.Namespace) -> MapSpec:
    values = given(options, _OF_TRIALS)
    method = values.get("estimator", defaults_of(MapSpec)["method"])
    spec = MapSpec(
        x=parse_axis(options.x),
        y=parse_axis(options.y),
        scene=options.scene,
        fixed=tuple(parse_value(text) for text in options.set),
        method=method,
        trials=options.trials,
        settings=TrialSettings(**given(options, ("seed", "schedule"))),
        false_alarm_rate=options.false_alarm_rate,
    )
    refuse_unused(values, ("a map with trials" if spec.trials else "a map without trials",), _MAPS)
    refuse_unused(given(options, ("schedule",)), (method,), method_settings())
    return spec


def _cell_results(spec: MapSpec, workers: int) -> dict[Cell, CellResult]:
    """Run the trials of all cells; those without a result are counted to standard error."""
    cell_results: dict[Cell, CellResult] = {}
    if spec.trials == 0:
        return cell_results
    with counter(spec.x.count * spec.y.count, "cell") as progress:
        for cell_result in compute_map(spec, workers=workers):
            cell_results[cell_result.cell] = cell_result
            progress.update(1)
    failed = sum(cell_result.num_failed for cell_result in cell_results.values())
    if failed:
        sys.stderr.write(f"vsep: {failed} trials have no result.\n")
    return cell_results


def _write_table(separability_map: SeparabilityMap, out: Path) -> None:
    rows = table_rows(separability_map)
    write_table(out, list(rows[0]), (list(row.values()) for row in rows))
