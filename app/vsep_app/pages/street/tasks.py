"""Frames of the street: simulated, separated and made into a picture, by a worker."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from vsep._typing import FloatArray
from vsep.presets.street import StreetFrame, street_frame
from vsep.presets.street_settings import street_options
from vsep.presets.street_traffic import RADAR
from vsep.signal.spectra import range_doppler_map
from vsep.tracking.sequence import SequenceSeparator, SequenceState, TrackedFrame
from vsep.tracking.sources import frame_of_street
from vsep.tracking.tracks import Track, resolution_cells
from vsep.units import to_db
from vsep_app.model.static_picture import ByteArray

MAP_PADDING = 2
RANGES_M = (0.0, 74.0)
VELOCITIES_MPS = (-27.0, 5.0)
MAP_LIMITS_DB = (-3.0, 45.0)  # over the noise, which a picture takes as the map's median


@dataclass(frozen=True, kw_only=True)
class StreetPlan:
    """All that determines the next frame, beside the state: settings by name."""

    values: Mapping[str, Any]


@dataclass(frozen=True, kw_only=True)
class TrackRow:
    """A track as the page shows it."""

    number: int  #: Its identity.
    name: str  #: Of the true object at its place; empty where there is none.
    range_m: float
    range_std_m: float
    velocity_mps: float
    velocity_std_mps: float
    snr_db: float
    is_seen: bool  #: Whether the frame shows it; else it is predicted.


@dataclass(frozen=True, kw_only=True, eq=False)
class StreetPicture:
    """All that is drawn of one frame."""

    number: int
    start: str  #: What the frame was separated from.
    seconds: float  #: For its separation.
    num_bursts: int
    num_interferers: int
    iterations: int
    #: (Mp, Mn) uint8: Range-Doppler maps; 0 and 255 are the ends of `MAP_LIMITS_DB`.
    map_before: ByteArray
    map_after: ByteArray
    ranges_m: FloatArray  #: Axes of the maps.
    velocities_mps: FloatArray
    #: True objects.
    true_ranges_m: FloatArray
    true_velocities_mps: FloatArray
    true_names: tuple[str, ...]
    tracks: tuple[TrackRow, ...]  #: Confirmed ones, by distance.


@dataclass(frozen=True, kw_only=True, eq=False)
class PlayedStreet:
    """A separated frame, and the state for the next one."""

    state: SequenceState
    picture: StreetPicture


def play_street(
    plan: StreetPlan, state: SequenceState | None, number: int, cycles: int
) -> PlayedStreet:
    """Simulate and separate a frame; `cycles` have passed since the last one that was separated."""
    values = plan.values
    street = street_frame(number, **street_options(values))
    separator = SequenceSeparator(
        false_alarm_rate=values["false_alarm_rate"],
        object_threshold_db=values["object_threshold_db"],
    )
    if state is None:
        state = SequenceState()
    elif cycles > 1:
        state = replace(state, cycles=state.cycles + cycles - 1, before=None)
    state, result = separator.step(frame_of_street(street), state)
    return PlayedStreet(state=state, picture=street_picture(street, result))


def street_picture(street: StreetFrame, result: TrackedFrame) -> StreetPicture:
    """Make the picture of a separated frame."""
    received, truth = street.observation.received, street.observation.truth
    assert truth is not None  # the simulator knows it
    dopplers, beats, before = range_doppler_map(received, zero_padding=MAP_PADDING)
    after = range_doppler_map(result.state.cleaned(received), zero_padding=MAP_PADDING).power
    ranges, velocities = RADAR.range_from_beat(beats), RADAR.velocity_from_doppler(dopplers)
    rows = (velocities >= VELOCITIES_MPS[0]) & (velocities <= VELOCITIES_MPS[1])
    columns = (ranges >= RANGES_M[0]) & (ranges <= RANGES_M[1])
    noise = float(np.median(after))
    true_ranges = RADAR.range_from_beat(truth.beats)
    true_velocities = RADAR.velocity_from_doppler(truth.dopplers)
    tracks = sorted(result.confirmed_tracks, key=lambda track: track.range_m)
    places = true_ranges, true_velocities
    return StreetPicture(
        number=street.number,
        start=result.start,
        seconds=result.seconds,
        num_bursts=len(result.state.bursts),
        num_interferers=len(street.scene.interferers) if truth.bursts else 0,
        iterations=len(result.solution.infos),
        map_before=_quantised(before[np.ix_(rows, columns)] / noise),
        map_after=_quantised(after[np.ix_(rows, columns)] / noise),
        ranges_m=ranges[columns],
        velocities_mps=velocities[rows],
        true_ranges_m=true_ranges,
        true_velocities_mps=true_velocities,
        true_names=street.names,
        tracks=tuple(_row(track, street.names, places) for track in tracks),
    )


def _quantised(power: FloatArray) -> ByteArray:
    lowest, highest = MAP_LIMITS_DB
    share = (to_db(power) - lowest) / (highest - lowest)
    return np.asarray(np.round(255.0 * np.clip(share, 0.0, 1.0)), dtype=np.uint8)


def _row(track: Track, names: tuple[str, ...], places: tuple[FloatArray, FloatArray]) -> TrackRow:
    cell_m, cell_mps = resolution_cells(RADAR)
    apart = np.hypot(
        (places[0] - track.range_m) / cell_m, (places[1] - track.velocity_mps) / cell_mps
    )
    nearest = int(np.argmin(apart)) if len(apart) else -1
    return TrackRow(
        number=track.track_id,
        name=names[nearest] if nearest >= 0 and apart[nearest] < 1.0 else "",
        range_m=track.range_m,
        range_std_m=track.range_std_m,
        velocity_mps=track.velocity_mps,
        velocity_std_mps=track.velocity_std_mps,
        snr_db=float(to_db(track.snr)),
        is_seen=track.missed == 0,
    )
