"""Starts of dithered ramps in frame files: ``start_times_s`` and ``start_frequencies_hz``, (P,)."""

from typing import Any

from vsep.errors import InputError
from vsep.files.archive import Archive
from vsep.signal.radar import ChirpSequence

KEYS = ("start_times_s", "start_frequencies_hz")


def dithering_arrays(radar: ChirpSequence) -> dict[str, Any]:
    """Return what a frame file holds of dithered ramps, nothing where they are equal."""
    return {key: getattr(radar, key) for key in KEYS if getattr(radar, key)}


def read_dithering(archive: Archive) -> dict[str, tuple[float, ...]]:
    """Read the starts of the ramps as `ChirpSequence` takes them.

    Raises
    ------
    InputError
        If they are no lists of numbers.
    """
    found = {}
    for key in KEYS:
        if key in archive:
            values = archive.array(key)
            if values.ndim != 1 or values.dtype.kind not in "iuf":
                raise InputError(
                    f"{key} has type {values.dtype} and {values.ndim} axes; a list of numbers, one "
                    "for each ramp, is needed."
                )
            found[key] = tuple(float(each) for each in values)
    return found
