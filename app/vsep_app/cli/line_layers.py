"""Additions to result lines: extended objects, lines of several transmitters."""

import argparse
from typing import Any

from vsep._typing import ComplexArray
from vsep.errors import InputError
from vsep.files.frame import Frame
from vsep.files.results import groups_entry, targets_entry
from vsep.grouping.groups import find_groups
from vsep.inference.core.progress import Solution
from vsep.signal.doppler_division import DopplerDivision, parse_doppler_division
from vsep.waveforms.doppler_division import join_lines


def add_division_option(parser: Any, what: str) -> None:
    """Add ``--doppler-division``."""
    parser.add_argument(
        "--doppler-division",
        metavar="T/K",
        type=division,
        help=what,
    )


def division(text: str) -> DopplerDivision:
    """Read the transmitters and bands of a Doppler division."""
    try:
        return parse_doppler_division(text)
    except InputError as error:
        raise argparse.ArgumentTypeError(str(error)) from None


def line_layers(
    received: ComplexArray,
    solution: Solution,
    frame: Frame,
    given: DopplerDivision | None,
    *,
    together: bool,
) -> dict[str, Any]:
    """Return ``groups`` and ``targets`` of a line.

    Raises `InputError` if lines cannot be joined.
    """
    missing, spacing = frame.missing_rows(together=together), frame.antenna_spacing_wavelengths
    told = frame.settings.get("doppler_division")
    waveform = parse_doppler_division(told) if given is None and told is not None else given
    entries = groups_entry(find_groups(received, solution.state, frame.radar, missing=missing))
    if waveform is None:
        return entries
    joined = join_lines(received, solution.state, frame.radar, waveform)
    return entries | targets_entry(joined, frame.radar, spacing if together else None)
