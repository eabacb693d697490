"""Events and components of a run in plain words and in the units of the display."""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from vsep._typing import FloatArray
from vsep.inference.core.progress import ComponentEvent, EventKind, IterationInfo, Step, Termination
from vsep.inference.core.state import SeparationState
from vsep.inference.evidence_choice import ChoiceState
from vsep.parameters import PARAMETERS
from vsep.parameters.receiver import RECEIVER_PARAMETERS
from vsep.signal.radar import SPEED_OF_LIGHT_MPS, ChirpSequence
from vsep_app.model.score import Score

_OBJECT_EVENTS = (EventKind.OBJECT_ADDED, EventKind.OBJECT_PRUNED)
_BURST_EVENTS = (EventKind.CHIRP_STARTED, EventKind.CHIRP_DROPPED, EventKind.CHIRP_RESTARTED)
_REJECTED = ("object candidate rejected", "object candidates rejected")
_COUNTED = {
    EventKind.CHANNEL_ADDED: ("interference path added", "interference paths added"),
    EventKind.CHANNEL_PRUNED: ("interference path pruned", "interference paths pruned"),
    EventKind.FILTER_ADDED: ("filter correction added", "filter corrections added"),
    EventKind.FILTER_PRUNED: ("filter correction pruned", "filter corrections pruned"),
}
_PLURALS = dict([_REJECTED, *_COUNTED.values()])
_LIMIT = PARAMETERS["max_iterations"].title
_END_LINES = {Termination.MAX_ITERATIONS: f"stopped at the limit; raise {_LIMIT} to go on"}
_ENDS = {
    Termination.CONVERGED: "Converged after {}",
    Termination.MAX_ITERATIONS: "Stopped at the limit of {}",
    Termination.NONFINITE: "Stopped after {}: no finite value",
}


@dataclass(frozen=True, kw_only=True)
class LogLine:
    """One line of the log; `kind` names its colour: added, pruned, burst, receiver, quiet or end.

    A quiet line is one of many alike: it has a number and the noun of what it counts.
    """

    iteration: int
    text: str
    kind: str
    number: int = 0
    noun: str = ""


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
    #: Radial acceleration in m/s²; None where an object has none.
    acceleration_mps2: float | None = None
    true_acceleration_mps2: float | None = None


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
    told = ""
    for step in steps:
        lines.extend(iteration_lines(step.state.iteration, step.info, radar))
        if any(event.kind is EventKind.RECEIVER_CHANGED for event in step.info.events):
            text = receiver_text(step.state, radar)
            if text != told:
                lines.append(LogLine(iteration=step.state.iteration, text=text, kind="receiver"))
            told = text
        if step.termination is not Termination.RUNNING:
            text = _END_LINES.get(step.termination, step.termination.value)
            lines.append(LogLine(iteration=step.state.iteration, text=text, kind="end"))
            if isinstance(step.state, ChoiceState) and step.state.choice is not None:
                text = f"kept by evidence: {step.state.choice.value}"
                lines.append(LogLine(iteration=step.state.iteration, text=text, kind="end"))
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
            lines.append(_quiet(iteration, text, 1, _REJECTED[0]))
    counts = Counter(event.kind for event in info.events if event.kind in _COUNTED)
    for event_kind, count in counts.items():
        singular, plural = _COUNTED[event_kind]
        text = f"1 {singular}" if count == 1 else f"{count} {plural}"
        ramps = {e.ramp for e in info.events if e.kind is event_kind and e.ramp >= 0}
        where = f" in ramp {min(ramps)}" if len(ramps) == 1 else f" in {len(ramps)} ramps"
        text += where if radar.num_ramps > 1 and ramps else ""
        lines.append(_quiet(iteration, text, count, singular))
    return tuple(lines)


def receiver_text(state: SeparationState, radar: ChirpSequence) -> str:
    """Say which errors of oscillator and receivers are taken off the frame, in rounded figures."""
    if state.receiver is None:
        return "oscillator and receiver: no error is evident any more"
    figures = state.receiver.figures(radar.sample_rate_hz, state.noise_precision)
    parts = []
    for record in RECEIVER_PARAMETERS:
        name = record.option or record.name
        if name not in figures:
            continue
        value = figures[name]
        every = value if isinstance(value, list) else [value]
        shown = ", ".join(f"{one / record.scale:.3g}" for one in every)
        parts.append(f"{record.title} {shown} {record.unit or record.convention}".rstrip())
    if "settling_s" in figures:
        parts.append(f"settling in every ramp, {1e6 * max(figures['settling_s']):.3g} µs")
    return "oscillator and receiver: " + "; ".join(parts)


def _quiet(iteration: int, text: str, number: int, noun: str) -> LogLine:
    return LogLine(iteration=iteration, text=text, kind="quiet", number=number, noun=noun)


def quiet_text(lines: Sequence[LogLine]) -> str:
    """Return what the quiet lines of a log count together; empty where there is none.

    Examples
    --------
    >>> line = LogLine(iteration=1, text="", kind="quiet", number=2, noun="path")
    >>> quiet_text([line, line])
    '4 paths'
    """
    counts: Counter[str] = Counter()
    for line in lines:
        if line.kind == "quiet":
            counts[line.noun] += line.number
    return ", ".join(
        f"{number} {noun if number == 1 else _PLURALS.get(noun, noun + 's')}"
        for noun, number in counts.items()
    )


def headline(
    steps: Sequence[Step],
    radar: ChirpSequence,
    *,
    num_bursts: int,
    num_found: int,
    score: Score | None,
) -> str:
    """Say what happened in the last of the steps, and how much is found; one or two sentences.

    Parameters
    ----------
    steps : sequence of Step
        Up to the iteration shown.
    radar : ChirpSequence
        For the conversion to metres.
    num_bursts : int
        Ramps that truly hold a burst, as far as that is known.
    num_found : int
        Objects so far, which are counted where there is no score.
    score : Score or None
        None where the true objects are not known.
    """
    if not steps:
        objects = (
            "An unknown number of objects"
            if score is None
            else counted(score.num_true, "object").capitalize()
        )
        bursts = (
            f" and bursts of another radar in {counted(num_bursts, 'ramp')}" if num_bursts else ""
        )
        return f"{objects}{bursts}. Nothing is estimated yet."
    last = steps[-1]
    iteration = last.state.iteration
    so_far = f"{counted(num_found, 'object')} so far." if score is None else f"{score.text}."
    if last.termination is not Termination.RUNNING:
        end = _ENDS[last.termination].format(counted(iteration, "iteration"))
        return f"{end}. {so_far}"
    news = _news(last.info, radar)
    return f"Iteration {iteration}: {news}. {so_far}"


def _news(info: IterationInfo, radar: ChirpSequence) -> str:
    """Say which bursts were found, which objects were added and which were removed."""
    ramps = [e.ramp for e in info.events if e.kind is EventKind.CHIRP_STARTED]
    parts = [_told("burst", "found", [f"in ramp {ramp}" for ramp in ramps])]
    for kind, verb in ((EventKind.OBJECT_ADDED, "found"), (EventKind.OBJECT_PRUNED, "removed")):
        beats = [event.beat for event in info.events if event.kind is kind]
        parts.append(_told("object", verb, [f"at {_distance(beat, radar)}" for beat in beats]))
    return ", ".join(part for part in parts if part) or "nothing new, the estimates settle"


def _told(noun: str, verb: str, places: Sequence[str]) -> str:
    """Say where one thing is; several are counted.

    Examples
    --------
    >>> _told("object", "found", ["at 6.9 m"]), _told("burst", "found", ["here", "there"])
    ('object found at 6.9 m', '2 bursts found')
    """
    if len(places) > 1:
        return f"{len(places)} {noun}s {verb}"
    return f"{noun} {verb} {places[0]}" if places else ""


def _distance(beat: float, radar: ChirpSequence) -> str:
    return f"{float(radar.range_from_beat(np.asarray(beat))):.1f} m"


def _level(level_db: float) -> str:
    return f"{level_db:.0f} dB" if np.isfinite(level_db) else "level unknown"


def _place(event: ComponentEvent, radar: ChirpSequence) -> str:
    distance = _distance(event.beat, radar)
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
    partners: Mapping[int, int],
    angles: AngleColumns | None = None,
) -> tuple[TableRow, ...]:
    """Return the component table sorted by distance; each true object has at most one estimate.

    `partners` leads from an estimate to its true object.
    """
    moves = radar.num_ramps > 1
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
        TableRow(**_at(index, estimates), **_at(partners.get(index), truth))
        for index in range(len(found.ids))
    ]
    missed = sorted(set(range(len(true_ranges_m))) - set(partners.values()))
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
