"""What ``vsep interferer-timing`` does once its options are read."""

import argparse
import sys
from pathlib import Path

from vsep.errors import InputError
from vsep.files.results import as_json
from vsep.files.timing_lines import read_timings, timing_line, write_timing_table

_PICTURES = (".png", ".svg")


def describe_timings(options: argparse.Namespace) -> int:
    """Write a line per frame to standard output, and a raster or a table if asked for."""
    suffix = Path(options.out or "").suffix.lower()
    if options.out is not None and suffix not in (*_PICTURES, ".csv"):
        raise InputError(f"--out {options.out} must end in .png, .svg or .csv.")
    frames = list(read_timings(options.results))
    if not frames:
        raise InputError(f"{options.results} holds no frame; the results of vsep separate do.")
    for frame in frames:
        sys.stdout.write(as_json(timing_line(frame)) + "\n")
    if suffix == ".csv":
        write_timing_table(options.out, frames)
    elif suffix:
        from vsep_app.figures.raster import write_raster

        write_raster(frames[0], Path(options.out))
    return 0
