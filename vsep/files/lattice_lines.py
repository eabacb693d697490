"""From result lines to the lattices of the interferers, and lines about them."""

import csv
import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from vsep._arrays import InputError
from vsep.analysis.lattice import Crossings, Lattice, fit_lattices
from vsep.signal.radar import ChirpSequence

_LONGEST_LINE = 2**26  # characters
_COLUMNS = ("file", "interferer", "ramp", "crossing_sample", "lattice_sample", "residual_samples")


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class FrameLattices:
    """The interferers of one frame.

    Parameters
    ----------
    file : str
        The frame.
    crossings : Crossings
        All bursts that a separation found.
    lattices : tuple of Lattice
        Those of the interferers.
    parallel_ramps : tuple of int
        Ramps with a tone that others lack.
    """

    file: str
    crossings: Crossings
    lattices: tuple[Lattice, ...]
    parallel_ramps: tuple[int, ...]


def read_lattices(path: str) -> Iterator[FrameLattices]:
    """Fit the lattices of every frame of a file of results; frames with an error are left out.

    Raises
    ------
    InputError
        In one sentence, if a line is no result line.
    """
    try:
        with open(path, encoding="utf-8") as lines:
            number = 0
            while text := lines.readline(_LONGEST_LINE):
                number += 1
                stored = _stored(path, number, text)
                if "error" not in stored:
                    yield _lattices(path, number, stored)
    except UnicodeDecodeError as error:
        raise InputError(f"{path} is no text; the results of vsep separate are needed.") from error


def fitted_lattices(line: Mapping[str, Any]) -> tuple[Lattice, ...]:
    """Fit the lattices of the interferers to the bursts of a result line.

    Raises
    ------
    InputError
        If it is no result line.
    """
    return _lattices(str(line.get("file")), 1, dict(line)).lattices


def lattice_line(frame: FrameLattices) -> dict[str, Any]:
    """Describe the interferers of a frame by numbers and texts.

    Returns
    -------
    dict
        ``file``; ``interferers`` with the lattice of each; ``bursts``, how many there are; with
        ``remark`` what cannot be separated.
    """
    line: dict[str, Any] = {
        "file": frame.file,
        "bursts": len(frame.crossings.ramps),
        "interferers": [_entry(lattice) for lattice in frame.lattices],
    }
    if frame.parallel_ramps:
        ramps = ", ".join(str(ramp) for ramp in frame.parallel_ramps[:10])
        more = " and more" if len(frame.parallel_ramps) > 10 else ""
        line["remark"] = (
            f"Ramps {ramps}{more} hold a strong tone that others lack: an interferer of the same "
            "slope, which cannot be told from objects within a ramp and is not separated."
        )
    return line


def write_lattice_table(path: str, frames: list[FrameLattices]) -> None:
    """Write every burst with its place on a lattice as CSV; without one the places are empty."""
    with open(path, "w", encoding="utf-8", newline="") as file:
        table = csv.writer(file)
        table.writerow(_COLUMNS)
        for frame in frames:
            table.writerows([frame.file, *row] for row in _rows(frame))


def _rows(frame: FrameLattices) -> Iterator[list[Any]]:
    used = set()
    for number, lattice in enumerate(frame.lattices):
        own = lattice.crossings
        for ramp, sample, residual in zip(
            own.ramps.tolist(), own.samples.tolist(), lattice.residuals.tolist(), strict=True
        ):
            used.add((ramp, sample))
            yield [number, ramp, sample, sample - residual, residual]
    places = zip(frame.crossings.ramps.tolist(), frame.crossings.samples.tolist(), strict=True)
    yield from (["", ramp, sample, "", ""] for ramp, sample in places if (ramp, sample) not in used)


def _entry(lattice: Lattice) -> dict[str, Any]:
    sequence = lattice.sequence()
    return {
        "slope_hz_per_s": lattice.slope_hz_per_s,
        "ramp_period_s": lattice.ramp_period_s,
        "time_offset_s": sequence.time_offset_s,
        "bursts": len(lattice.chirps),
        "predicted": len(lattice.predicted().ramps),
        "median_residual_samples": lattice.median_residual,
    }


def _stored(path: str, number: int, text: str) -> dict[str, Any]:
    try:
        stored = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise _no_result(path, number) from error
    if not isinstance(stored, dict):
        raise _no_result(path, number)
    return stored


def _lattices(path: str, number: int, stored: dict[str, Any]) -> FrameLattices:
    try:
        radar = ChirpSequence(**stored["radar"])
        bursts = np.array(
            [
                (burst["ramp"], burst["start_frequency_hz"], burst["slope_hz_per_s"])
                for burst in stored["interference"]
                if burst["num_components"] > 0 and burst["slope_hz_per_s"] != 0.0
            ],
            dtype=np.float64,
        ).reshape(-1, 3)
        crossings = Crossings(
            ramps=bursts[:, 0].astype(np.int64),
            samples=-bursts[:, 1] / bursts[:, 2] * radar.sample_rate_hz,
            slopes_hz_per_s=bursts[:, 2],
        )
        parallel = tuple(int(ramp) for ramp in stored.get("parallel_ramps", ()))
        file = str(stored["file"])
    except (KeyError, TypeError, ValueError) as error:
        raise _no_result(path, number) from error
    return FrameLattices(
        file=Path(file).name,
        crossings=crossings,
        lattices=fit_lattices(crossings, radar),
        parallel_ramps=parallel,
    )


def _no_result(path: str, number: int) -> InputError:
    return InputError(
        f"{path}: line {number} is no result line; write the file with vsep separate."
    )
