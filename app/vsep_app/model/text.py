"""Events and components of a run in plain words and in the units of the display."""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from vsep._typing import BoolArray, FloatArray
from vsep.inference.core.progress import ComponentEvent, EventKind, IterationInfo, Step, Termination
from vsep.signal.radar import SPEED_OF_LIGHT_MPS, ChirpSequence

_OBJECT_EVENTS = (EventKind.OBJECT_ADDED, EventKind.OBJECT_PRUNED)
_BURST_EVENTS = (EventKind.CHIRP_STARTED, EventKind.CHIRP_DROPPED, EventKind.CHIRP_RESTARTED)
_COUNTED = {
    EventKind.CHANNEL_ADDED: ("interference path added", "interference paths added"),
    EventKind.CHANNEL_PRUNED: ("interference path pruned", "interference paths pruned"),
    EventKind.FILTER_ADDED: ("filter correction added", "filter corrections added"),
    EventKind.FILTER_PRUNED: ("filter correction pruned", "filter corrections pruned"),
}


@dataclass(frozen=True, kw_only=True)
class LogLine:
    """One line of the event log; `kind` names its colour: added, pruned, burst, quiet or end."""

    iteration: int
    text: str
    kind: str


@dataclass(frozen=True, kw_only=True)
class TableRow:
    """One object, estimate against truth; None where there is no counterpart."""

    #: Identity of the estimate; None for a true object that is not found.
    component_id: int | None = None
    #: Distance in m.
    range_m: float | None = None
    range_std_m: float | None = None
    true_range_m: float | None = None
    #: Radial velocity in m/s, positive for a receding object.
    velocity_mps: float | None = None
    velocity_std_mps: float | None = None
    true_velocity_mps: float | None = None
    #: Component SNR in dB; of several antennas their mean.
    snr_db: float | None = None
    true_snr_db: float | None = None
    #: Direction from broadside in degrees, positive towards the last antenna.
    angle_deg: float | None = None
    angle_std_deg: float | None = None
    true_angle_deg: float | None = None


def counted(number: int, noun: str) -> str:
    """Return a number with its noun.

    Examples
    --------
    >>> counted(1, "object"), counted(3, "object")
    ('1 object', '3 objects')
    """
    return f"{number} {noun if number == 1 else noun + 's'}"


def log_lines(steps: Sequence[Step], radar: ChirpSequence) -> tuple[LogLine, ...]:
    """Return the log of a run, oldest line first."""
    lines: list[LogLine] = []
    for step in steps:
        lines.extend(iteration_lines(step.state.iteration, step.info, radar))
        if step.termination is not Termination.RUNNING:
            lines.append(
                LogLine(iteration=step.state.iteration, text=step.termination.value, kind="end")
            )
    return tuple(lines)


def iteration_lines(
    iteration: int, info: IterationInfo, radar: ChirpSequence
) -> tuple[LogLine, ...]:
    """Return the lines of one iteration; frequent small events are counted, not listed."""
    lines = []
    for event in info.events:
        if event.kind in _OBJECT_EVENTS:
            kind = "added" if event.kind is EventKind.OBJECT_ADDED else "pruned"
            text = f"{event.kind.value} at {_place(event, radar)}, {_level(event.snr_db)}"
            lines.append(LogLine(iteration=iteration, text=text, kind=kind))
        elif event.kind in _BURST_EVENTS:
            text = f"{event.kind.value} in ramp {event.ramp}, {_level(event.snr_db)}"
            lines.append(LogLine(iteration=iteration, text=text, kind="burst"))
        elif event.kind is EventKind.OBJECT_REJECTED:
            text = f"object candidate rejected, {_level(event.snr_db)}"
            text += f" (threshold {event.threshold_db:.1f} dB)"
            lines.append(LogLine(iteration=iteration, text=text, kind="quiet"))
    counts = Counter(event.kind for event in info.events if event.kind in _COUNTED)
    for event_kind, count in counts.items():
        singular, plural = _COUNTED[event_kind]
        text = f"1 {singular}" if count == 1 else f"{count} {plural}"
        ramps = {e.ramp for e in info.events if e.kind is event_kind and e.ramp >= 0}
        where = f" in ramp {min(ramps)}" if len(ramps) == 1 else f" in {len(ramps)} ramps"
        text += where if radar.num_ramps > 1 and ramps else ""
        lines.append(LogLine(iteration=iteration, text=text, kind="quiet"))
    return tuple(lines)


def _level(level_db: float) -> str:
    return f"{level_db:.0f} dB" if np.isfinite(level_db) else "level unknown"


def _place(event: ComponentEvent, radar: ChirpSequence) -> str:
    distance = f"{float(radar.range_from_beat(np.asarray(event.beat))):.1f} m"
    if radar.num_ramps == 1:
        return distance
    velocity = round(float(radar.velocity_from_doppler(np.asarray(event.doppler))), 1) + 0.0
    return f"{distance}, {velocity:+.1f} m/s"


@dataclass(frozen=True, kw_only=True, eq=False)
class Located:
    """Components in display units, as `TableRow` names them; stds may be NaN."""

    ids: tuple[int, ...]
    ranges_m: FloatArray
    velocities_mps: FloatArray
    range_std_m: FloatArray
    velocity_std_mps: FloatArray
    snr_db: FloatArray


@dataclass(frozen=True, kw_only=True, eq=False)
class AngleColumns:
    """Directions of the components of a `Located`, and of the true objects where they are known."""

    angles_deg: FloatArray
    stds_deg: FloatArray
    true_deg: FloatArray | None = None


def table_rows(
    found: Located,
    true_ranges_m: FloatArray,
    true_velocities_mps: FloatArray,
    true_snr_db: FloatArray,
    radar: ChirpSequence,
    angles: AngleColumns | None = None,
) -> tuple[TableRow, ...]:
    """Return the component table sorted by distance; each true object has at most one estimate.

    An estimate belongs to the nearest true object if it lies within one resolution cell, nearest
    pairs first. This serves the eye; the metrics of a study live in `vsep`.
    """
    cell_m, cell_mps = resolution_cells(radar)
    moves = radar.num_ramps > 1
    distance = np.abs(found.ranges_m[:, None] - true_ranges_m[None, :]) / cell_m
    if moves:
        away = np.abs(found.velocities_mps[:, None] - true_velocities_mps[None, :]) / cell_mps
        distance = np.hypot(distance, np.minimum(away, radar.num_ramps - away))
    partner = _pairs(distance)
    estimates: dict[str, Any] = {"component_id": found.ids, "snr_db": found.snr_db}
    estimates |= {"range_m": found.ranges_m, "range_std_m": found.range_std_m}
    truth = {"true_range_m": true_ranges_m, "true_snr_db": true_snr_db}
    if moves:
        estimates |= {"velocity_mps": found.velocities_mps}
        estimates |= {"velocity_std_mps": found.velocity_std_mps}
        truth |= {"true_velocity_mps": true_velocities_mps}
    if angles is not None:
        estimates |= {"angle_deg": angles.angles_deg, "angle_std_deg": angles.stds_deg}
        truth |= {} if angles.true_deg is None else {"true_angle_deg": angles.true_deg}
    rows = [
        TableRow(**_at(index, estimates), **_at(partner.get(index), truth))
        for index in range(len(found.ids))
    ]
    missed = sorted(set(range(len(true_ranges_m))) - set(partner.values()))
    rows += [TableRow(**_at(true, truth)) for true in missed]
    return tuple(sorted(rows, key=_place_of))


def _at(index: int | None, columns: Mapping[str, Any]) -> dict[str, Any]:
    """Return the values at a place of columns as plain numbers, none without a place."""
    if index is None:
        return {}
    return {
        name: column[index] if name == "component_id" else float(column[index])
        for name, column in columns.items()
    }


def resolution_cells(radar: ChirpSequence) -> tuple[float, float]:
    """Width of one resolution cell, 1/N and 1/P, in m and m/s."""
    metres = SPEED_OF_LIGHT_MPS * radar.sample_rate_hz / (2.0 * abs(radar.slope_hz_per_s))
    velocity = float(radar.velocity_from_doppler(np.asarray(1.0 / radar.num_ramps)))
    return metres / radar.num_samples, velocity


def _place_of(row: TableRow) -> float:
    place = row.true_range_m if row.range_m is None else row.range_m
    return place or 0.0


def _pairs(distance: FloatArray) -> dict[int, int]:
    """Pair rows with columns at less than one cell, nearest first."""
    open_pairs: BoolArray = distance < 1.0
    pairs: dict[int, int] = {}
    order = np.argsort(distance, axis=None)
    for row, column in zip(*np.unravel_index(order, distance.shape), strict=True):
        if not open_pairs[row, column]:
            continue
        pairs[int(row)] = int(column)
        open_pairs[row, :] = False
        open_pairs[:, column] = False
    return pairs
