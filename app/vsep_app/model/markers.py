"""Components in display units: what the views mark on the range and velocity axes."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from vsep._typing import ComplexArray, FloatArray
from vsep.grouping.groups import ObjectGroup
from vsep.inference.core.progress import ComponentEvent, EventKind, Step
from vsep.inference.core.state import SeparationState
from vsep.signal.template import CHANNEL_GRID_FACTOR
from vsep.units import to_db
from vsep.waveforms.doppler_division import can_be_joined, join_lines
from vsep_app.model.static_picture import StaticPicture

ADDED, PRUNED = EventKind.OBJECT_ADDED, EventKind.OBJECT_PRUNED


@dataclass(frozen=True, kw_only=True, eq=False)
class Markers:
    """Components on the range axis and, where it applies, on the velocity axis."""

    #: (L,) float: Position, peak in the delay spectrum of one ramp, component SNR.
    ranges_m: FloatArray
    velocities_mps: FloatArray
    levels_db: FloatArray
    snr_db: FloatArray
    #: (L,) float: 1 for what is there; falls with the age of a flash or of a pruned component.
    opacity: FloatArray


@dataclass(frozen=True, kw_only=True, eq=False)
class GroupMarks:
    """Extended objects on the axes of the map."""

    #: (G,) float: Centre, extent, velocity and what its lines spread over it, SNR of the strongest.
    ranges_m: FloatArray
    extents_m: FloatArray
    velocities_mps: FloatArray
    spreads_mps: FloatArray
    snr_db: FloatArray
    lines: tuple[str, ...]  #: The lines of each in words, the nearest first.


@dataclass(frozen=True, kw_only=True, eq=False)
class TargetMarks:
    """Objects that several transmitters see as a line each."""

    #: (L,) float: Distance and own velocity, SNR of the strongest line.
    ranges_m: FloatArray
    velocities_mps: FloatArray
    snr_db: FloatArray
    lines: tuple[str, ...]  #: Identities of the lines of each, transmitter by transmitter.


def target_marks(
    static_picture: StaticPicture, received: ComplexArray, state: SeparationState
) -> TargetMarks | None:
    """Join the lines of an estimate; None where one transmitter sends at a time."""
    division, radar = static_picture.antenna.division, static_picture.radar
    if division is None or not can_be_joined(radar):
        return None
    joined = join_lines(received, state, radar, division)
    ids, snr = state.objects.component_ids, np.append(state.component_snr, 0.0)
    return TargetMarks(
        ranges_m=radar.range_from_beat(joined.beats),
        velocities_mps=radar.velocity_from_doppler(joined.dopplers),
        snr_db=to_db(snr[joined.lines].max(axis=1, initial=1e-20)),
        lines=tuple(
            ", ".join("weak" if line < 0 else str(ids[line]) for line in lines)
            for lines in joined.lines.tolist()
        ),
    )


def group_marks(groups: Sequence[ObjectGroup]) -> GroupMarks:
    """Return the extended objects of an estimate."""
    return GroupMarks(
        ranges_m=np.array([group.range_m for group in groups]),
        extents_m=np.array([group.extent_m for group in groups]),
        velocities_mps=np.array([group.velocity_mps for group in groups]),
        spreads_mps=np.array([np.ptp(group.velocities_mps) for group in groups]),
        snr_db=to_db(np.array([group.snr.max() for group in groups])),
        lines=tuple(_lines_text(group) for group in groups),
    )


def _lines_text(group: ObjectGroup) -> str:
    """Return range and SNR of every line; those below the threshold of points in brackets."""
    texts = [
        f"{place:.2f} m {level:.0f} dB"
        for place, level in zip(group.ranges_m, to_db(group.snr), strict=True)
    ]
    known = len(group.members)
    texts = [text if n < known else f"({text})" for n, text in enumerate(texts)]
    return ", ".join(texts[index] for index in np.argsort(group.ranges_m))


def object_marks(static_picture: StaticPicture, state: SeparationState) -> Markers:
    """Return the estimated objects of a state."""
    objects, radar = state.objects, static_picture.radar
    return Markers(
        ranges_m=radar.range_from_beat(objects.beats),
        velocities_mps=radar.velocity_from_doppler(objects.dopplers),
        levels_db=static_picture.level_db(np.abs(objects.amplitudes) ** 2 / radar.num_ramps),
        snr_db=to_db(state.component_snr),
        opacity=np.ones(objects.num_components),
    )


def true_marks(static_picture: StaticPicture) -> Markers:
    """Return the true objects."""
    true = static_picture.true_objects
    return Markers(
        ranges_m=true.ranges_m,
        velocities_mps=true.velocities_mps,
        levels_db=true.levels_db,
        snr_db=true.snr_db,
        opacity=np.ones(len(true.ranges_m)),
    )


def added_marks(
    static_picture: StaticPicture, state: SeparationState, steps: Sequence[Step], lifetime: int
) -> Markers:
    """Return the objects added in the last `lifetime` steps to a state; the newest are opaque."""
    recent = {event.component_id: age for event, age in _recent(steps, ADDED, lifetime)}
    ages = [recent.get(int(number), -1) for number in state.objects.component_ids]
    chosen = np.array([age >= 0 for age in ages], dtype=np.bool_)
    if not chosen.any():
        return no_marks()
    every = object_marks(static_picture, state)
    return Markers(
        ranges_m=every.ranges_m[chosen],
        velocities_mps=every.velocities_mps[chosen],
        levels_db=every.levels_db[chosen],
        snr_db=every.snr_db[chosen],
        opacity=1.0 - np.array(ages)[chosen] / lifetime,
    )


def pruned_marks(static_picture: StaticPicture, steps: Sequence[Step], lifetime: int) -> Markers:
    """Return the objects pruned in the last `lifetime` steps where they were; they fade."""
    recent = _recent(steps, PRUNED, lifetime)
    if not recent:
        return no_marks()
    radar = static_picture.radar
    events = [event for event, _ in recent]
    snr_db = np.array([event.snr_db for event in events])
    noise_db = -to_db(steps[-1].state.noise_precision * static_picture.reference_power)
    return Markers(
        ranges_m=radar.range_from_beat(np.array([event.beat for event in events])),
        velocities_mps=radar.velocity_from_doppler(np.array([event.doppler for event in events])),
        levels_db=snr_db + noise_db - to_db(radar.num_ramps),
        snr_db=snr_db,
        opacity=np.array([1.0 - age / lifetime for _, age in recent]),
    )


def _recent(
    steps: Sequence[Step], kind: EventKind, lifetime: int
) -> list[tuple[ComponentEvent, int]]:
    """Events of one kind with their age in steps, newest first."""
    return [
        (event, age)
        for age, step in enumerate(reversed(steps[-lifetime:]))
        for event in step.info.events
        if event.kind is kind
    ]


def no_marks() -> Markers:
    """Return no mark at all."""
    empty = np.zeros(0)
    return Markers(
        ranges_m=empty, velocities_mps=empty, levels_db=empty, snr_db=empty, opacity=empty
    )


def channel_marks(static_picture: StaticPicture, state: SeparationState, ramp: int) -> Markers:
    """Return the channel components of a ramp; a bin is read as the beat of an object."""
    bursts, radar = state.bursts_in(ramp), static_picture.radar
    if not bursts:
        return no_marks()
    bins_per_cycle = CHANNEL_GRID_FACTOR * radar.num_samples
    bins = np.concatenate([burst.active_bins for burst in bursts])
    power = np.concatenate([np.abs(burst.amplitudes) ** 2 for burst in bursts])
    variance = np.concatenate([np.real(np.diagonal(burst.covariance)) for burst in bursts])
    return Markers(
        ranges_m=radar.range_from_beat(bins / bins_per_cycle),
        velocities_mps=np.zeros(len(bins)),
        levels_db=static_picture.level_db(power / radar.num_samples),
        snr_db=to_db(power / variance),
        opacity=np.ones(len(bins)),
    )
