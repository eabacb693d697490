"""Result lines of a sequence: what a frame holds, and the tracks up to it."""

from collections.abc import Iterable, Iterator
from dataclasses import replace
from typing import Any

from vsep.errors import InputError
from vsep.files.frame import Frame
from vsep.files.results import groups_entry, result_line
from vsep.tracking.sequence import SequenceSeparator, SequenceState, TrackedFrame
from vsep.tracking.tracks import Track
from vsep.units import to_db


def tracked_line(result: TrackedFrame) -> dict[str, Any]:
    """Describe a frame of a sequence by numbers, texts, lists and dictionaries.

    Parameters
    ----------
    result : TrackedFrame
        Of `vsep.track`.

    Returns
    -------
    dict
        As of `vsep.files.results.result_line`, and ``frame``, its number; ``start``, what it was
        separated from; ``tracks``; ``groups`` where any are evident, each with its ``tracks`` and
        ``track``, the oldest of these; its ``seconds`` are those of the whole frame.
    """
    frame = result.frame
    spacing, received = frame.antenna_spacing_wavelengths, frame.received
    line = result_line(frame.name, result.solution, frame.radar, spacing, received=received)
    ids = result.solution.objects.component_ids.tolist()
    return (
        line
        | _groups_entry(result)
        | {
            "frame": result.number,
            "start": result.start,
            "tracks": [_track_entry(track, ids) for track in result.tracks],
            "seconds": round(result.seconds, 6),
        }
    )


def _groups_entry(result: TrackedFrame) -> dict[str, Any]:
    """Return extended objects with the tracks of their lines."""
    groups = result.groups
    entry = groups_entry(groups)
    for group, described in zip(groups, entry.get("groups", ()), strict=True):
        tracks = result.tracks_of(group)
        described |= {"tracks": list(tracks), "track": tracks[0] if tracks else None}
    return entry


def _track_entry(track: Track, component_ids: list[int]) -> dict[str, Any]:
    """Describe a track; ``object`` is its place among the frame's objects, null if predicted."""
    return {
        "track": track.track_id,
        "confirmed": track.is_confirmed,
        "object": None if track.missed else component_ids.index(track.component_id),
        "range_m": track.range_m,
        "range_std_m": track.range_std_m,
        "velocity_mps": track.velocity_mps,
        "velocity_std_mps": track.velocity_std_mps,
        "component_snr_db": float(to_db(track.snr)),
        "hits": track.hits,
        "missed": track.missed,
        "born": track.born,
    }


def sequence_lines(
    separator: SequenceSeparator, frames: Iterable[Frame | tuple[str, str]]
) -> Iterator[dict[str, Any]]:
    """Yield the result line of every frame of a sequence, as soon as it is separated.

    Parameters
    ----------
    separator : SequenceSeparator
        Settings.
    frames : iterable of Frame or (str, str)
        In place of a frame that cannot be read its name and what is wrong: its line has ``error``,
        and the sequence goes on after a gap.
    """
    state = SequenceState()
    for frame in frames:
        try:
            if not isinstance(frame, Frame):
                name, sentence = frame
                raise InputError(sentence)
            name = frame.name
            state, result = separator.step(frame, state)
            line = tracked_line(result)
        except InputError as error:
            line = {"file": name, "frame": state.num_frames, "error": str(error)}
            state = replace(
                state, num_frames=state.num_frames + 1, cycles=state.cycles + 1, before=None
            )
        yield line
