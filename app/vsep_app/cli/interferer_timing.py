"""``vsep interferer-timing``: the interfering radars, from when their bursts cross the band."""

import argparse
import sys
from pathlib import Path
from typing import Any

from vsep.errors import InputError
from vsep.files.results import as_json
from vsep.files.timing_lines import read_timings, timing_line, write_timing_table
from vsep_app.cli.shared_options import add_file, require_dashboard

DESCRIPTION = (
    "Estimate slope, chirp interval and time offset of the interfering radars from the times at "
    "which the bursts that vsep separate found cross the band: one JSON line per frame."
)
EXAMPLES = """\
examples:
  vsep interferer-timing results.jsonl
  vsep interferer-timing results.jsonl --out raster.png
  vsep interferer-timing results.jsonl --out bursts.csv
"""
_PICTURES = (".png", ".svg")


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of the command."""
    parser.add_argument("results", metavar="RESULTS", help="what vsep separate wrote, *.jsonl")
    add_file(
        parser,
        "--out",
        "the crossing times of the first frame with their residuals as a picture, *.png or "
        "*.svg, or all bursts as a table, *.csv",
    )


def run(options: argparse.Namespace) -> int:
    """Write a line per frame to standard output, and a picture or a table if asked for."""
    suffix = Path(options.out or "").suffix.lower()
    if options.out is not None and suffix not in (*_PICTURES, ".csv"):
        raise InputError(f"--out {options.out} must end in .png, .svg or .csv.")
    raster: Any = None
    if suffix in _PICTURES:
        raster = require_dashboard(
            "vsep_app.figures.raster", f"interferer-timing --out {options.out}"
        )
    frames = list(read_timings(options.results))
    if not frames:
        raise InputError(f"{options.results} holds no frame; the results of vsep separate do.")
    for frame in frames:
        sys.stdout.write(as_json(timing_line(frame)) + "\n")
    if raster is not None:
        raster.write_raster(frames[0], Path(options.out))
    elif suffix:
        write_timing_table(options.out, frames)
    return 0
