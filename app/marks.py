"""Components in display units: what the views mark on the range and velocity axes."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from app.backdrop import Backdrop
from vsep._arrays import FloatArray, to_db
from vsep.inference.progress import ComponentEvent, EventKind, Step
from vsep.inference.state import SeparationState
from vsep.signal.template import CHANNEL_GRID_FACTOR

ADDED, PRUNED = EventKind.OBJECT_ADDED, EventKind.OBJECT_PRUNED


@dataclass(frozen=True, kw_only=True, eq=False)
class Marks:
    """Components on the range axis and, where it applies, on the velocity axis.

    Parameters
    ----------
    ranges_m, velocities_mps, levels_db, snr_db : (L,) float
        Position, peak in the delay spectrum of one ramp, component SNR.
    opacity : (L,) float
        1 for what is there; falls with the age of a flash or of a pruned component.
    """

    ranges_m: FloatArray
    velocities_mps: FloatArray
    levels_db: FloatArray
    snr_db: FloatArray
    opacity: FloatArray


def object_marks(backdrop: Backdrop, state: SeparationState) -> Marks:
    """Return the estimated objects of a state."""
    objects, radar = state.objects, backdrop.radar
    return Marks(
        ranges_m=radar.range_from_beat(objects.beats),
        velocities_mps=radar.velocity_from_doppler(objects.dopplers),
        levels_db=backdrop.level_db(np.abs(objects.amplitudes) ** 2 / radar.num_ramps),
        snr_db=to_db(objects.component_snr),
        opacity=np.ones(objects.num_components),
    )


def true_marks(backdrop: Backdrop) -> Marks:
    """Return the true objects."""
    true = backdrop.true_objects
    return Marks(
        ranges_m=true.ranges_m,
        velocities_mps=true.velocities_mps,
        levels_db=true.levels_db,
        snr_db=true.snr_db,
        opacity=np.ones(len(true.ranges_m)),
    )


def added_marks(
    backdrop: Backdrop, state: SeparationState, steps: Sequence[Step], lifetime: int
) -> Marks:
    """Return the objects added in the last `lifetime` steps to a state; the newest are opaque."""
    recent = {event.component_id: age for event, age in _recent(steps, ADDED, lifetime)}
    ages = [recent.get(int(number), -1) for number in state.objects.component_ids]
    chosen = np.array([age >= 0 for age in ages], dtype=np.bool_)
    if not chosen.any():
        return no_marks()
    every = object_marks(backdrop, state)
    return Marks(
        ranges_m=every.ranges_m[chosen],
        velocities_mps=every.velocities_mps[chosen],
        levels_db=every.levels_db[chosen],
        snr_db=every.snr_db[chosen],
        opacity=1.0 - np.array(ages)[chosen] / lifetime,
    )


def pruned_marks(backdrop: Backdrop, steps: Sequence[Step], lifetime: int) -> Marks:
    """Return the objects pruned in the last `lifetime` steps where they were; they fade."""
    recent = _recent(steps, PRUNED, lifetime)
    if not recent:
        return no_marks()
    radar = backdrop.radar
    events = [event for event, _ in recent]
    snr_db = np.array([event.snr_db for event in events])
    noise_db = -to_db(steps[-1].state.noise_precision * backdrop.reference_power)
    return Marks(
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


def no_marks() -> Marks:
    """Return no mark at all."""
    empty = np.zeros(0)
    return Marks(ranges_m=empty, velocities_mps=empty, levels_db=empty, snr_db=empty, opacity=empty)


def channel_marks(backdrop: Backdrop, state: SeparationState, ramp: int) -> Marks:
    """Return the channel components of a ramp; a bin is read as the beat of an object."""
    bursts, radar = state.bursts_in(ramp), backdrop.radar
    if not bursts:
        return no_marks()
    bins_per_cycle = CHANNEL_GRID_FACTOR * radar.num_samples
    bins = np.concatenate([burst.active_bins for burst in bursts])
    power = np.concatenate([np.abs(burst.amplitudes) ** 2 for burst in bursts])
    variance = np.concatenate([np.real(np.diagonal(burst.covariance)) for burst in bursts])
    return Marks(
        ranges_m=radar.range_from_beat(bins / bins_per_cycle),
        velocities_mps=np.zeros(len(bins)),
        levels_db=backdrop.level_db(power / radar.num_samples),
        snr_db=to_db(power / variance),
        opacity=np.ones(len(bins)),
    )
