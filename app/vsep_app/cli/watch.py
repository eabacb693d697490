"""``vsep watch``: captures of a folder, each converted and separated as it comes."""

import argparse
import time
from collections import deque
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any, Final, NamedTuple

from vsep.errors import InputError
from vsep.files.frame import Frame, write_frame
from vsep.files.frame_mask import SET_ASIDE, frame_mask, set_aside_same_slope
from vsep.files.line_file import lines_of_a_run
from vsep.files.results import as_json, result_line
from vsep.inference.core.run import run as run_estimator
from vsep.inference.registry import ESTIMATORS, make_estimator
from vsep.recordings.captures_in_folder import (
    FolderState,
    copy_captures,
    existing,
    next_captures,
)
from vsep.recordings.configurations.registry import (
    completed,
    for_recording,
    merged,
    read_configuration_file,
)
from vsep.recordings.convert import convert_recording
from vsep.recordings.guess import guess_layouts
from vsep.recordings.interference_figures import InterferenceFigures, interference_figures
from vsep.recordings.raw_words import num_frames
from vsep.recordings.settings import RAW_FORMATS, RecordingSettings, parse_settings
from vsep.signal.clutter import remove_static_clutter
from vsep.signal.template import SignalModel
from vsep_app.cli.estimator_options import (
    DEFAULT_ESTIMATOR,
    ESTIMATOR_SETTINGS,
    add_estimator_options,
    add_same_slope_option,
    estimator_settings,
)
from vsep_app.cli.progress import say
from vsep_app.cli.shared_options import (
    EXIT_INPUT,
    add_clutter_option,
    add_file,
    add_number,
    add_out,
    error_text,
    given,
    integer,
    refuse_unused,
    require_folder,
)

DESCRIPTION = (
    "Follow a folder: convert and separate every new capture as it comes, with the share of "
    "samples and ramps that are hit, saturated samples, the interference-to-noise ratio, and "
    "whether both radars can run side by side."
)
EXAMPLES = """\
examples:
  vsep watch captures --settings radar.cfg --out night.jsonl
  vsep watch captures --settings radar.cfg --out night.jsonl --clips clips --last-s 30
  vsep watch captures --settings radar.cfg --out all.jsonl --existing --idle-s 5

A capture is taken when its file has stopped growing. With --clips, the captures of the last
--last-s seconds are copied into a folder of their own whenever one is interfered. It ends with
Ctrl-C, after --count captures, or when nothing has come for --idle-s.
"""
_POLL_S: Final = 0.5
_LAST_S: Final = 30.0


class Separated(NamedTuple):
    """A frame of a capture with its result line."""

    line: dict[str, Any]
    figures: InterferenceFigures | None


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of the command."""
    parser.add_argument("folder", metavar="DIR", help="the folder that is being written")
    add_file(
        parser,
        "--settings",
        "what the captures are, as for vsep convert; a layout that is left open is guessed from "
        "the first capture",
        required=True,
        action="append",
    )
    add_out(parser, "the results, one JSON line per frame, written as they come")
    add_file(parser, "--frames", "folder, made if need be, for the frame files", metavar="DIR")
    add_file(parser, "--clips", "folder, made if need be, for clips", metavar="DIR")
    add_number(
        parser,
        "--last-s",
        f"with --clips: how many seconds a clip reaches back (default: {_LAST_S:g})",
        default=_LAST_S,
    )
    parser.add_argument(
        "--existing", action="store_true", help="take the captures that are there already, too"
    )
    add_number(parser, "--count", "end after so many captures", kind=integer(1, 2**31))
    add_number(parser, "--idle-s", "end when no capture has come for so many seconds")
    add_clutter_option(parser, "estimated like all others, or left out")
    add_same_slope_option(parser)
    add_estimator_options(parser)


def run(options: argparse.Namespace) -> int:
    """Take captures as they come, one result line a frame; 2 if one could not be used."""
    options.estimator = options.estimator or DEFAULT_ESTIMATOR
    refuse_unused(given(options, ESTIMATOR_SETTINGS), (options.estimator,), estimator_settings())
    require_folder(options.out)
    for folder in filter(None, (options.frames, options.clips)):
        Path(folder).mkdir(parents=True, exist_ok=True)
    said = merged({path: read_configuration_file(path) for path in options.settings})
    state = FolderState() if options.existing else existing(options.folder)
    recent: deque[tuple[str, float]] = deque()
    failed = False

    def settings_of(path: str) -> RecordingSettings:
        nonlocal said
        own = for_recording(said, path)
        if own.values.get("format") in (None, *RAW_FORMATS) and "num_samples" not in own.values:
            said = own = completed(own, guess_layouts(path)[0])
        return parse_settings(own.values)

    with lines_of_a_run(options.out) as results:
        for path, written_s in _captures(options, state):
            recent.append((path, written_s))
            while recent[0][1] < written_s - options.last_s:
                recent.popleft()
            interfered = False
            for frame in _separated(path, settings_of, options):
                results.write(as_json(frame.line) + "\n")
                failed |= frame.figures is None
                interfered |= frame.figures is not None and frame.figures.sample_share > 0.0
                say(_sentence(frame))
            if interfered and options.clips is not None:
                clip = Path(options.clips) / Path(path).stem
                copy_captures([each for each, _ in recent], clip)
    return EXIT_INPUT if failed else 0


def _captures(options: argparse.Namespace, state: FolderState) -> Iterator[tuple[str, float]]:
    """Yield captures as they are complete, until the end that the options name."""
    count, last = 0, time.monotonic()
    while True:
        state, captures = next_captures(options.folder, state)
        for capture in captures:
            yield capture
            count += 1
            last = time.monotonic()
            if options.count is not None and count >= options.count:
                return
        if options.idle_s is not None and time.monotonic() - last >= options.idle_s:
            return
        time.sleep(_POLL_S)


def _separated(
    path: str, settings_of: Callable[[str], RecordingSettings], options: argparse.Namespace
) -> Iterator[Separated]:
    """Yield all frames of a capture; one with ``error`` where one cannot be used."""
    try:
        settings = settings_of(path)
        number = num_frames(path, settings) if settings.format in RAW_FORMATS else 1
        for frame in range(settings.frame, max(number, settings.frame + 1)):
            yield _separated_frame(path, replace(settings, frame=frame), options)
    except (InputError, MemoryError) as error:
        yield Separated({"file": path, "error": error_text(path, error)}, None)


def _separated_frame(
    path: str, settings: RecordingSettings, options: argparse.Namespace
) -> Separated:
    frame, remarks = convert_recording(path, settings)
    if options.frames is not None:
        name = f"{Path(path).stem}-{settings.frame}.npz"
        write_frame(Path(options.frames) / name, frame)
    frame = _separable(frame, settings, options)
    signal = frame.received if frame.antennas is None else frame.antennas
    received = remove_static_clutter(signal, path) if options.clutter == "remove" else signal
    together = frame.antennas is not None
    model = SignalModel.of_radar(frame.radar, frame.assumed_filter, frame.num_antennas)
    needs_mask = ESTIMATORS.require(options.estimator).needs_mask
    mask = frame_mask(frame, options.mask, received) if needs_mask else None
    said: Any = given(options, ESTIMATOR_SETTINGS) | {"mask": mask}
    missing = frame.missing_rows(together=together)
    estimator = make_estimator(options.estimator, model, missing=missing, **said)
    solution = run_estimator(estimator, received)
    figures = interference_figures(frame, solution.state)
    spacing = frame.antenna_spacing_wavelengths
    line = result_line(path, solution, frame.radar, spacing, received=received)
    more = {"frame": settings.frame, "figures": figures.line(), "remarks": list(remarks)}
    return Separated(line | more, figures)


def _separable(frame: Frame, settings: RecordingSettings, options: argparse.Namespace) -> Frame:
    """Return the antennas that are separated together: those of one transmitter."""
    if options.same_slope == SET_ASIDE:
        frame = set_aside_same_slope(frame)
    several = ESTIMATORS.require(options.estimator).several_antennas
    if several and settings.num_transmitters == 1:
        return frame
    return frame.of_antenna(0)


def _sentence(separated: Separated) -> str:
    """Return what happened in a capture on a line."""
    line, figures = separated
    if figures is None:
        return str(line["error"])
    return (
        f"{Path(line['file']).name} frame {line['frame']}: {len(line['objects'])} objects, "
        f"{figures.summary}"
    )
