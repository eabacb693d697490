"""``vsep stream``: sequences of frames, each separated from what the last one predicts."""

import argparse
import sys
import time
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import Any, Final

from vsep.errors import InputError
from vsep.files.frame import Frame, read_frame
from vsep.files.line_file import lines_of_a_run
from vsep.files.results import as_json
from vsep.inference.registry import ESTIMATORS
from vsep.parameters import PARAMETERS
from vsep.signal.motion import CYCLE_S
from vsep.studies.cluster_map import map_on_cluster
from vsep.tracking.lines import sequence_lines
from vsep.tracking.sequence import SequenceSeparator
from vsep.tracking.sources import frame_files, piped_frames
from vsep_app.cli.estimator_options import add_false_alarm_option
from vsep_app.cli.progress import counted, say
from vsep_app.cli.shared_options import (
    EXIT_INPUT,
    add_file,
    add_number,
    add_out,
    add_scheduler_option,
    error_text,
    given,
    lost_lines,
    require_folder,
    require_other_file,
)

DESCRIPTION = "Separate sequences of frames and follow their objects."
EXAMPLES = """\
examples:
  vsep simulate --preset street --frames 200 --out street
  vsep stream street --out street.jsonl
  vsep stream night/*.npz --cycle-ms 66.7 --out night.jsonl
  recorder | vsep stream - --like first.npz --out /dev/stdout

Files and the frames of a folder, by name, are in the order of time. Every folder is a sequence of
its own, and with --scheduler they are shared among machines. A frame that cannot be read gets a
line with "file" and "error"; the sequence goes on after a gap, and the exit code is 2 at the end.
"""
PIPE: Final = "-"
_SETTINGS: Final = (
    "acceleration",
    "false_alarm_rate",
    "object_threshold_db",
    "interference_threshold_db",
    "max_iterations",
)


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of the command."""
    parser.add_argument(
        "sources",
        nargs="+",
        metavar="FRAMES",
        help=f"frame files, *.npz, a folder of them, or {PIPE} for NumPy arrays one after another "
        "on standard input",
    )
    add_out(parser, "the results, one JSON line per frame, written as they come")
    add_file(parser, "--like", f"with {PIPE}: a frame file with radar and filter of the frames")
    add_number(
        parser,
        "--cycle-ms",
        f"from frame to frame, ms (default: {1e3 * CYCLE_S:g})",
        default=1e3 * CYCLE_S,
    )
    parser.add_argument(
        "--cold",
        action="store_true",
        help="separate every frame from nothing, for comparison; objects are followed all the same",
    )
    add_scheduler_option(parser, ", a sequence each; they must see the files under the same names")
    group = parser.add_argument_group("the estimator")
    add_false_alarm_option(group)
    add_number(group, "--object-threshold-db", "the object threshold itself")
    add_number(group, "--interference-threshold-db", "threshold of interference-channel components")
    default = ESTIMATORS.require("factorised").defaults["max_iterations"]
    add_number(
        group,
        "--max-iterations",
        f"where a frame's run stops at the latest (default: {default})",
        kind=int,
    )
    record = PARAMETERS["acceleration"]
    group.add_argument(
        "--acceleration",
        choices=tuple(record.choices or ()),
        help="whether objects whose velocity changes within the frame are modelled (default: "
        f"{record.default})",
    )


def run(options: argparse.Namespace) -> int:
    """Separate every sequence, one result line a frame; 2 if a frame could not be used."""
    sequences = _sequences(options)
    separator = make_sequence_separator(options)
    require_folder(options.out)
    files = [name for names in sequences for name in names]
    require_other_file(options.out, files, "is one of the frames")
    starts: Counter[str] = Counter()
    began, seconds = time.perf_counter(), 0.0
    with lines_of_a_run(options.out) as results:
        for line in counted(_lines(separator, options, sequences), len(files), "frame"):
            if "error" in line:
                say(line["error"])
            starts[line.get("start", "unusable")] += 1
            seconds += line.get("seconds", 0.0)
            results.write(as_json(line) + "\n")
    used = starts.total() - starts["unusable"]
    if used > 1:
        sys.stderr.write(_summary(starts, seconds, time.perf_counter() - began) + "\n")
    return EXIT_INPUT if starts["unusable"] else 0


def make_sequence_separator(options: argparse.Namespace) -> SequenceSeparator:
    """Return the separator that the options describe."""
    return SequenceSeparator(
        cycle_s=1e-3 * options.cycle_ms, warm=not options.cold, **given(options, _SETTINGS)
    )


def _sequences(options: argparse.Namespace) -> list[tuple[str, ...]]:
    """Return the files of every sequence; of a pipe one without files."""
    piped = PIPE in options.sources
    if piped and (len(options.sources) > 1 or options.like is None):
        raise InputError(
            f"{PIPE} is one sequence of its own and needs --like FRAME, which names the radar."
        )
    if piped and options.scheduler is not None:
        raise InputError(
            f"--scheduler is {options.scheduler}; {PIPE}, a pipe, is read by this machine."
        )
    if not piped and options.like is not None:
        raise InputError(f"--like {options.like} is for {PIPE}, a pipe; frame files say it all.")
    if piped:
        return [()]
    folders = [name for name in options.sources if Path(name).is_dir()]
    loose = tuple(name for name in options.sources if name not in folders)
    return [*([loose] if loose else []), *(frame_files([folder]) for folder in folders)]


def _lines(
    separator: SequenceSeparator,
    options: argparse.Namespace,
    sequences: Sequence[tuple[str, ...]],
) -> Iterator[dict[str, Any]]:
    if options.like is not None:
        like = read_frame(options.like)
        yield from sequence_lines(separator, piped_frames(sys.stdin.buffer, like))
        return
    make = partial(lines_of_files, separator=separator)
    if options.scheduler is not None:
        for lines in map_on_cluster(make, sequences, options.scheduler, lost=lost_lines):
            yield from lines
        return
    for files in sequences:
        yield from sequence_lines(separator, _frames(files))


def lines_of_files(files: Sequence[str], separator: SequenceSeparator) -> list[dict[str, Any]]:
    """Make the result lines of a sequence."""
    return list(sequence_lines(separator, _frames(files)))


def _frames(files: Iterable[str]) -> Iterator[Frame | tuple[str, str]]:
    for path in files:
        try:
            yield read_frame(path)
        except (InputError, MemoryError) as error:
            yield path, error_text(path, error)


def _summary(starts: Counter[str], seconds: float, elapsed_s: float) -> str:
    used = starts.total() - starts["unusable"]
    kinds = ", ".join(f"{number} {name}" for name, number in starts.items() if name != "unusable")
    return (
        f"{used} frames in {elapsed_s:.1f} s, {1e3 * seconds / used:.1f} ms a frame for the "
        f"separation ({kinds})"
    )
