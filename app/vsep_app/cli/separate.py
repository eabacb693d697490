"""``vsep separate``: objects and interference of frame files, one result line each."""

import argparse
import sys
import time
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from dataclasses import replace
from functools import partial
from itertools import repeat
from pathlib import Path
from typing import Any

import numpy as np

from vsep._processes import available_cores, worker_pool
from vsep._typing import BoolArray, ComplexArray
from vsep.analysis.crossings import InterfererTiming
from vsep.analysis.parallel import parallel_ramps
from vsep.calibration.calibrate import calibrate
from vsep.errors import InputError
from vsep.files.frame import Frame, read_frame
from vsep.files.frame_mask import SET_ASIDE, frame_mask, set_aside_same_slope
from vsep.files.line_file import lines_of_a_run
from vsep.files.response_file import read_response
from vsep.files.results import as_json, profile_entry, result_line, separated_signals
from vsep.files.writing import write_npz
from vsep.inference.core.estimator import Estimator
from vsep.inference.core.progress import Solution, Step
from vsep.inference.core.run import run as run_estimator
from vsep.inference.registry import ESTIMATORS, make_estimator
from vsep.signal.clutter import remove_static_clutter
from vsep.signal.filters import MeasuredFilter, NoFilter
from vsep.signal.template import SignalModel
from vsep.studies.cluster_map import map_on_cluster
from vsep.tracking.sources import frame_files
from vsep.two_pass import require_timing_support, run_twice
from vsep_app.cli.estimator_options import (
    DEFAULT_ESTIMATOR,
    ESTIMATOR_SETTINGS,
    add_estimator_options,
    add_same_slope_option,
    default_of,
    estimator_settings,
)
from vsep_app.cli.line_layers import add_division_option, line_layers
from vsep_app.cli.line_words import choice_words, same_slope_words, which_antenna_words
from vsep_app.cli.progress import IterationProgress, counted, say
from vsep_app.cli.shared_options import (
    EXIT_INPUT,
    add_antenna_option,
    add_clutter_option,
    add_file,
    add_frames,
    add_number,
    add_out,
    add_scheduler_option,
    error_text,
    given,
    integer,
    listed,
    lost_lines,
    refuse_unused,
    require_distinct_names,
    require_folder,
    require_other_file,
)

DESCRIPTION = "Separate frame files."
EXAMPLES = """\
examples:
  vsep separate frame.npz --out results.jsonl
  vsep separate night/*.npz --out night.jsonl --signals separated --false-alarm-rate 0.01

A frame that cannot be read gets a line with "file" and "error"; the others are separated all the
same, and the exit code is 2 at the end.
"""
OWN = "own"  # in place of a response file
_FRAMES_AT_A_TIME = 4  # handed to a process, so that handing over costs little
_FRAMES_WORTH_A_PROCESS = 16  # starting one takes as long as some frames


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of the command."""
    add_frames(parser, ", or a folder of them")
    add_out(parser, "the results, one JSON line per frame, in order")
    parser.add_argument(
        "--signals",
        metavar="DIR",
        help="folder, made if need be, for DIR/<frame>.npz with object_signal, "
        "interference_signal and cleaned",
    )
    add_antenna_option(
        parser,
        "all together, with angles of arrival, by "
        f"{listed([name for name, entry in ESTIMATORS.items() if entry.several_antennas])}; the "
        "others take one, antenna 0",
    )
    add_file(
        parser,
        "--response",
        "the receiver's response as vsep calibrate writes it, *.npz, in place of the filter "
        f"that a frame file names; {OWN!r} estimates it from the bursts of each frame itself",
    )
    add_clutter_option(parser, "estimated like all others, or left out")
    add_same_slope_option(parser)
    parser.add_argument(
        "--interferer-timing",
        action="store_true",
        help="two passes: fit slope, chirp interval and offset of the interfering radars to the "
        "bursts found, then search again, with a lower threshold, where these radars must have "
        "crossed the band",
    )
    add_division_option(
        parser,
        "T transmitters sent in every ramp, their Doppler frequencies 1/K cycle a ramp apart: join "
        "the lines that an object has, one for each of them (default: as the frame file says)",
    )
    add_number(
        parser,
        "--workers",
        "processes that share the frames (default: one for every core)",
        kind=integer(1, 4096),
    )
    add_scheduler_option(parser, "; they must see the files under the same names")
    parser.add_argument(
        "--profile",
        action="store_true",
        help='say where the time goes: "profile" in every line, and a table at the end',
    )
    add_estimator_options(parser)


def run(options: argparse.Namespace) -> int:
    """Separate every frame, one result line each; 2 if one of them could not be used."""
    options.estimator = options.estimator or DEFAULT_ESTIMATOR
    options.frames = frame_files(options.frames)
    if options.scheduler is not None and options.workers is not None:
        raise InputError(
            f"--workers is {options.workers} and --scheduler {options.scheduler}; give one of them."
        )
    _require_distinct(options.frames, options.out, options.signals)
    require_folder(options.out)
    _require_usable(options)
    assumed_filter(options)
    if options.signals is not None:
        Path(options.signals).mkdir(parents=True, exist_ok=True)
    start = time.perf_counter()
    workers = _num_workers(options)
    profile: Counter[str] = Counter()
    used = 0
    with (
        lines_of_a_run(options.out) as results,
        _result_lines(options, workers) as lines,
    ):
        for line in counted(lines, len(options.frames), "frame"):
            if "error" in line:
                say(line["error"])
            used += "error" not in line
            if "parallel_ramps" in line:
                say(same_slope_words(line, options.same_slope))
            if options.antenna is None and "antenna" in line:
                say(which_antenna_words(line))
            if "choice" in line:
                say(choice_words(line))
            profile.update(line.get("profile", {}))
            results.write(as_json(line) + "\n")
    if profile:
        sys.stderr.write("\n".join(_profile_table(profile, used)) + "\n")
    if used > 1:
        place = options.scheduler or ("1 process" if workers == 1 else f"{workers} processes")
        sys.stderr.write(_throughput(used, time.perf_counter() - start, place) + "\n")
    return 0 if used == len(options.frames) else EXIT_INPUT


def _num_workers(options: argparse.Namespace) -> int:
    """Return what was asked for, or one process a core unless there are only a few frames."""
    if options.workers is not None:
        return min(int(options.workers), len(options.frames))
    return max(1, min(available_cores(), len(options.frames) // _FRAMES_WORTH_A_PROCESS))


@contextmanager
def _result_lines(options: argparse.Namespace, workers: int) -> Iterator[Iterator[dict[str, Any]]]:
    """Make the result lines in the order of the frames, in this process or several."""
    if options.scheduler is not None:
        yield _cluster_lines(options)
        return
    if workers == 1:
        yield _watched_lines(options)
        return
    try:
        with worker_pool(workers) as pool:
            yield pool.map(
                separate_frame, options.frames, repeat(options), chunksize=_FRAMES_AT_A_TIME
            )
    except BrokenProcessPool:
        sentence = "A worker process ended abruptly, perhaps for lack of memory; try --workers 1."
        raise InputError(sentence) from None


def _cluster_lines(options: argparse.Namespace) -> Iterator[dict[str, Any]]:
    """Make the result lines on the workers of a scheduler, some at a time."""
    frames = options.frames
    parts = [
        frames[start : start + _FRAMES_AT_A_TIME]
        for start in range(0, len(frames), _FRAMES_AT_A_TIME)
    ]
    make = partial(separate_frames, options=options)
    for lines in map_on_cluster(make, parts, options.scheduler, lost=lost_lines):
        yield from lines


def separate_frames(paths: Sequence[str], options: argparse.Namespace) -> list[dict[str, Any]]:
    """Make the result lines of some frames."""
    return [separate_frame(path, options) for path in paths]


def _watched_lines(options: argparse.Namespace) -> Iterator[dict[str, Any]]:
    """Make the result lines in this process; the terminal shows the iterations of a long run."""
    most = options.max_iterations or default_of(options.estimator, "max_iterations")
    bar = IterationProgress(most)
    for path in options.frames:
        bar.begin(Path(path).name)
        try:
            line = separate_frame(path, options, bar.show)
        finally:
            bar.end()
        yield line


def _profile_table(profile: Mapping[str, float], frames: int) -> list[str]:
    """Return lines of a table of milliseconds a frame by part."""
    total = sum(profile.values())
    return [
        f"{name:22s} {1e3 * spent / frames:9.2f} ms a frame {100.0 * spent / total:5.1f} %"
        for name, spent in profile.items()
    ]


def _throughput(frames: int, seconds: float, place: str) -> str:
    rate = frames / seconds
    return f"{frames} frames in {seconds:.1f} s on {place}: {rate:.1f} frames per second"


def separate_frame(
    path: str, options: argparse.Namespace, watch: Callable[[Step], None] | None = None
) -> dict[str, Any]:
    """Make the result line of one frame; one with ``error`` if it could not be used."""
    try:
        frame = _read_frame(path, options)
        if options.same_slope == SET_ASIDE:
            frame = set_aside_same_slope(frame)
        together = _is_together(frame, options)
        received = frame.antennas if together and frame.antennas is not None else frame.received
        if options.clutter == "remove":
            received = remove_static_clutter(received, frame.name)
        estimator = _separator_of(options, frame, received)
        solution, timings = _solve(estimator, received, frame, options, watch)
        division = options.doppler_division
        layers = line_layers(received, solution, frame, division, together=together)
        if options.signals is not None:
            write_npz(_signals_path(options.signals, path), **separated_signals(frame, solution))
    except (InputError, MemoryError) as error:
        return {"file": path, "error": error_text(path, error)}
    spacing = frame.antenna_spacing_wavelengths
    line = result_line(path, solution, frame.radar, spacing, frame.num_transmitters, received)
    line |= layers
    if timings is not None:
        line["interferer_timings"] = len(timings)
    # A burst that the estimator has modelled is no tone.
    tones = set(np.flatnonzero(parallel_ramps(frame.received)).tolist())
    if parallel := sorted(tones - set(solution.state.interfered_ramps)):
        line["parallel_ramps"] = parallel
    if frame.num_antennas > 1:
        line |= {"num_antennas": frame.num_antennas}
    if frame.num_antennas > 1 and not together:
        line |= {"antenna": frame.antenna}
    return line | ({"profile": profile_entry(solution)} if options.profile else {})


def _solve(
    estimator: Estimator,
    received: ComplexArray,
    frame: Frame,
    options: argparse.Namespace,
    watch: Callable[[Step], None] | None,
) -> tuple[Solution, tuple[InterfererTiming, ...] | None]:
    """Run the estimator, in two passes if the interferers' timing is asked for."""
    if not options.interferer_timing:
        return run_estimator(estimator, received, watch=watch), None
    return run_twice(require_timing_support(estimator), received, frame.radar, watch=watch)


def _read_frame(path: str, options: argparse.Namespace) -> Frame:
    """Read a frame; a response that was given stands in for its filter."""
    frame = read_frame(path, antenna=options.antenna or 0)
    response = _own_response(frame) if options.response == OWN else assumed_filter(options)
    return frame if response is None else replace(frame, anti_aliasing_filter=response)


def _own_response(frame: Frame) -> MeasuredFilter:
    """Estimate the receiver's response from the bursts of the frame itself."""
    recording = frame.received[None] if frame.antennas is None else frame.antennas
    response = calibrate([recording], frame.radar.sample_rate_hz).estimate.response
    return response.filter_of(frame.antenna if frame.antennas is not None else 0)


def _is_together(frame: Frame, options: argparse.Namespace) -> bool:
    """Whether all antennas of a frame are separated together: unless one of them is asked for."""
    several = frame.num_antennas > 1 and options.antenna is None
    return several and ESTIMATORS.require(options.estimator).several_antennas


def assumed_filter(options: argparse.Namespace) -> MeasuredFilter | None:
    """Return the filter of ``--response``, or None.

    Raises
    ------
    InputError
        If the file is no response file, or has none of the antenna.
    """
    if options.response in (None, OWN):
        return None
    return read_response(options.response).filter_of(options.antenna or 0)


def _require_usable(options: argparse.Namespace) -> None:
    """Refuse bad estimator options at once, not once per frame: they are checked with any model."""
    ESTIMATORS.require(options.estimator)
    refuse_unused(given(options, ESTIMATOR_SETTINGS), (options.estimator,), estimator_settings())
    model = SignalModel(
        num_ramps=1, num_samples=8, sample_rate_hz=1e6, anti_aliasing_filter=NoFilter()
    )
    estimator = make_separator(options, model)
    if options.interferer_timing:
        require_timing_support(estimator)


def _separator_of(options: argparse.Namespace, frame: Frame, received: ComplexArray) -> Estimator:
    needs_mask = ESTIMATORS.require(options.estimator).needs_mask
    mask = frame_mask(frame, options.mask, received) if needs_mask else None
    together = _is_together(frame, options)
    num_antennas = frame.num_antennas if together else 1
    model = SignalModel.of_radar(frame.radar, frame.assumed_filter, num_antennas)
    return make_separator(options, model, mask, frame.missing_rows(together=together))


def make_separator(
    options: argparse.Namespace,
    model: SignalModel,
    mask: BoolArray | None = None,
    missing: BoolArray | None = None,
) -> Estimator:
    """Make the estimator that the options of ``separate`` describe."""
    settings: Any = given(options, ESTIMATOR_SETTINGS) | {"mask": mask}
    name = options.estimator or DEFAULT_ESTIMATOR
    return make_estimator(name, model, missing=missing, **settings)


def _signals_path(folder: str, frame: str) -> Path:
    return Path(folder) / f"{Path(frame).stem}.npz"


def _require_distinct(frames: Sequence[str], out: str, signals: str | None) -> None:
    """Refuse outputs that would overwrite a frame or each other."""
    require_other_file(out, frames, "is one of the frames")
    if signals is None:
        return
    require_distinct_names(frames)
    inputs = {Path(frame).resolve() for frame in frames}
    outputs = {_signals_path(signals, frame).resolve() for frame in frames}
    if outputs & inputs or Path(out).resolve() in outputs:
        raise InputError(
            f"--signals {signals} would overwrite a frame or the results; give another folder."
        )
