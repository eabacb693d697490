"""Interferer timings of result files, and their output as JSON and CSV."""

import json
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from vsep.analysis.crossings import Crossings, InterfererTiming
from vsep.analysis.interferer_timing import fit_interferer_timings
from vsep.analysis.timing_search import MIN_BURSTS
from vsep.errors import InputError
from vsep.files.writing import printable, write_table
from vsep.signal.radar import ChirpSequence

_MAX_LINE = 2**26  # characters
_MOST = 0.7  # of the bursts, which timings should explain
_SURE_MERIT = 0.6  # from here on a multiple or fraction of an interval was hardly ever found
_COLUMNS = ("file", "interferer", "ramp", "crossing_sample", "predicted_sample", "residual_samples")


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class FrameTimings:
    """The interferers of one frame."""

    file: str  #: the frame
    radar: ChirpSequence  #: this radar
    crossings: Crossings  #: all bursts that a separation found
    timings: tuple[InterfererTiming, ...]  #: those of the interferers
    parallel_ramps: tuple[int, ...]  #: ramps with a tone that others lack


def read_timings(path: str) -> Iterator[FrameTimings]:
    """Fit the timings of every frame of a file of results; frames with an error are left out.

    Raises `InputError` if a line is no result line.
    """
    try:
        with open(path, encoding="utf-8") as lines:
            number = 0
            while text := lines.readline(_MAX_LINE):
                number += 1
                stored = _stored(path, number, text)
                if "error" not in stored:
                    yield _timings(path, number, stored)
    except UnicodeDecodeError as error:
        raise InputError(f"{path} is no text; the results of vsep separate are needed.") from error


def timing_line(frame: FrameTimings) -> dict[str, Any]:
    """Describe the interferers of a frame by numbers and texts.

    Returns
    -------
    dict
        ``file``; ``interferers`` with the timing of each; ``bursts``, how many there are; with
        ``remark`` what cannot be separated.
    """
    line: dict[str, Any] = {
        "file": frame.file,
        "bursts": len(frame.crossings.ramps),
        "interferers": [_entry(timing) for timing in frame.timings],
    }
    remarks = []
    explained = sum(len(timing.chirps) for timing in frame.timings)
    if not frame.timings and len(frame.crossings.ramps) >= MIN_BURSTS:
        remarks.append(
            f"Not enough evidence for a timing: no equal intervals explain the "
            f"{len(frame.crossings.ramps)} bursts better than chance, with a fifth of the bursts "
            "that they predict."
        )
    elif 0 < len(frame.crossings.ramps) < MIN_BURSTS:
        remarks.append(
            f"Not enough evidence for a timing: {len(frame.crossings.ramps)} bursts, of "
            f"{MIN_BURSTS} at least."
        )
    elif frame.timings and explained < _MOST * len(frame.crossings.ramps):
        remarks.append(
            f"Not enough evidence for the other {len(frame.crossings.ramps) - explained} bursts."
        )
    least = min((timing.merit for timing in frame.timings), default=1.0)
    if least < _SURE_MERIT:
        remarks.append(
            f"Only {least:.0%} of the bursts that a timing predicts were found: its interval may "
            "be a whole fraction or multiple of the right one."
        )
    if frame.parallel_ramps:
        ramps = ", ".join(str(ramp) for ramp in frame.parallel_ramps[:10])
        more = " and more" if len(frame.parallel_ramps) > 10 else ""
        remarks.append(
            f"Ramps {ramps}{more} hold a strong tone that others lack: an interferer of the same "
            "slope, which cannot be told from objects within a ramp and is not separated."
        )
    return line | ({"remark": " ".join(remarks)} if remarks else {})


def write_timing_table(path: str, frames: list[FrameTimings]) -> None:
    """Write every burst with its place in a timing as CSV; without one the places are empty."""
    rows = ([frame.file, *row] for frame in frames for row in _rows(frame))
    write_table(path, _COLUMNS, rows)


def _rows(frame: FrameTimings) -> Iterator[list[Any]]:
    used = set()
    for number, timing in enumerate(frame.timings):
        own = timing.crossings
        for ramp, sample, residual in zip(
            own.ramps.tolist(), own.samples.tolist(), timing.residuals.tolist(), strict=True
        ):
            used.add((ramp, sample))
            yield [number, ramp, sample, sample - residual, residual]
    places = zip(frame.crossings.ramps.tolist(), frame.crossings.samples.tolist(), strict=True)
    yield from (["", ramp, sample, "", ""] for ramp, sample in places if (ramp, sample) not in used)


def _entry(timing: InterfererTiming) -> dict[str, Any]:
    sequence = timing.sequence()
    return {
        "slope_hz_per_s": timing.slope_hz_per_s,
        "ramp_period_s": timing.ramp_period_s,
        "time_offset_s": sequence.time_offset_s,
        "bursts": len(timing.chirps),
        "predicted": len(timing.predicted().ramps),
        "median_residual_samples": timing.median_residual,
        "merit": round(timing.merit, 4),
        **({} if timing.part is None else {"ramps": list(timing.part)}),
    }


def _stored(path: str, number: int, text: str) -> dict[str, Any]:
    try:
        stored = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise _no_result(path, number) from error
    if not isinstance(stored, dict):
        raise _no_result(path, number)
    return stored


def _timings(path: str, number: int, stored: dict[str, Any]) -> FrameTimings:
    try:
        radar = ChirpSequence(**stored["radar"])
        bursts = np.array(
            [
                (burst["ramp"], burst["start_frequency_hz"], burst["slope_hz_per_s"])
                for burst in stored["interference"]
                if burst["num_components"] > 0
            ],
            dtype=np.float64,
        ).reshape(-1, 3)
        ramps, starts, slopes = bursts.T
        if not (np.isfinite(bursts).all() and np.isin(ramps, np.arange(radar.num_ramps)).all()):
            raise _no_result(path, number)
        with np.errstate(over="ignore"):  # to infinity, which is refused
            crossings = Crossings.of_chirps(ramps, starts, slopes, radar.sample_rate_hz)
        parallel = tuple(int(ramp) for ramp in stored.get("parallel_ramps", ()))
        file = str(stored["file"])
    # OverflowError: an integer that is larger than all floating-point numbers.
    except (KeyError, TypeError, ValueError, OverflowError) as error:
        raise _no_result(path, number) from error
    return FrameTimings(
        file=printable(Path(file).name),
        radar=radar,
        crossings=crossings,
        timings=fit_interferer_timings(crossings, radar),
        parallel_ramps=parallel,
    )


def _no_result(path: str, number: int) -> InputError:
    return InputError(
        f"{path}: line {number} is no result line; write the file with vsep separate."
    )
