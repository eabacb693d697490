"""The map of a question without any estimator: every layer in every cell.

Few parameters decide on the objects (their number, a delay) and few on the bursts (slope, share,
filter); levels only shift (27). So the layers are evaluated for distinct interferers and distinct
sets of objects, and spread over the cells.
"""

import math
from dataclasses import dataclass, replace
from typing import TypeAlias

import numpy as np

from vsep._arrays import FloatArray, IntArray
from vsep.laboratory.bursts import BurstKey, make_bursts
from vsep.laboratory.layers import pair_layers
from vsep.laboratory.objects import make_table
from vsep.laboratory.question import Question, default_value, ramps_of_share
from vsep.signal.filters import AntiAliasingFilter, RaisedCosineFilter
from vsep.signal.presets import interferer_sequence
from vsep.studies.bench import draw_bench

# Interferers at work at a time.
_MOST_KEYS = 256
_NAMES = ("whole_db", "weakest_db", "coherence", "bound_loss_db")

_Sets: TypeAlias = dict[int, tuple[IntArray, IntArray]]


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class AnalyticMap:
    """Layers over the cells, (ny, nx) each; see `vsep.laboratory.layers.PairLayers`."""

    whole_db: FloatArray
    weakest_db: FloatArray
    coherence: FloatArray
    bound_loss_db: FloatArray


def analytic_map(question: Question) -> AnalyticMap:
    """Evaluate condition (27), the coherence and the bound's loss in every cell.

    They are those of the scene of the question's first realisation, and of the *true* filter.

    Parameters
    ----------
    question : Question
        The map.

    Returns
    -------
    AnalyticMap
        NaN where no burst crosses the band.
    """
    bursts, burst_of = _distinct(
        _given(question, "filter_cutoff_hz", default_value(question.scene, "filter_cutoff_hz")),
        _slopes(question),
        _ramps(question),
    )
    objects, objects_of = _distinct(
        _given(question, "num_objects", 0.0), _given(question, "object_delay_s", -np.inf)
    )
    layers = _layers(question, bursts, objects)
    over_cells = {name: layer[burst_of, objects_of] for name, layer in layers.items()}
    sir_db = _given(question, "sir_db", default_value(question.scene, "sir_db"))
    for name in ("whole_db", "weakest_db"):
        over_cells[name] = over_cells[name] + sir_db
    return AnalyticMap(**over_cells)


def _given(question: Question, name: str, otherwise: float) -> FloatArray:
    values = question.over_cells(name)
    return np.full(question.shape, otherwise, dtype=np.float64) if values is None else values


def _slopes(question: Question) -> FloatArray:
    """Slopes of the interferer; added up as the point of a cell does, to the bit."""
    differences = question.over_cells("slope_difference_hz_per_s")
    if differences is None:
        return np.full(question.shape, interferer_sequence(question.scene).slope_hz_per_s)
    return np.asarray(question.radar.slope_hz_per_s + differences)


def _ramps(question: Question) -> FloatArray:
    """Numbers of interfered ramps; those that Table I makes count as 0."""
    shares = question.over_cells("interfered_share")
    if shares is None:
        return np.zeros(question.shape)
    counts = {share: ramps_of_share(question.radar, share) for share in set(shares.flat)}
    return np.array([[counts[share] for share in row] for row in shares], dtype=np.float64)


def _distinct(*values: FloatArray) -> tuple[list[tuple[float, ...]], IntArray]:
    """Return the distinct combinations, ascending, and which of them every cell has, (ny, nx)."""
    stacked = np.stack([value.ravel() for value in values], axis=1)
    found, places = np.unique(stacked, axis=0, return_inverse=True)
    return [tuple(row) for row in found.tolist()], places.reshape(values[0].shape)


def _layers(
    question: Question, bursts: list[tuple[float, ...]], objects: list[tuple[float, ...]]
) -> dict[str, FloatArray]:
    """Layers of B distinct interferers and O distinct sets of objects, (B, O) each."""
    trial = question.trial((0, 0))
    most = int(max(count for count, _ in objects)) or None
    drawn = draw_bench(
        replace(trial, point=replace(trial.point, num_objects=most, object_delay_s=None))
    ).scenario
    delays_s = sorted({delay_s for _, delay_s in objects if math.isfinite(delay_s)})
    table = make_table(drawn.radar, drawn.scene.objects, delays_s)
    sets = _members(drawn.scene.objects.num_paths, delays_s, objects)
    keys = [_key(question, drawn.anti_aliasing_filter, *burst) for burst in bursts]
    channel = drawn.scene.interferers[0].channel
    layers = {name: np.empty((len(bursts), len(objects))) for name in _NAMES}
    for start in range(0, len(keys), _MOST_KEYS):
        some = keys[start : start + _MOST_KEYS]
        rows = make_bursts(drawn.radar, channel, some)
        for places, members in sets.values():
            found = pair_layers(table, rows, len(some), members)
            for name, layer in layers.items():
                layer[start : start + len(some), places] = getattr(found, name)
    return layers


def _key(
    question: Question, own: AntiAliasingFilter, cutoff_hz: float, slope: float, num_ramps: float
) -> BurstKey:
    assert isinstance(own, RaisedCosineFilter)  # a point of the laboratory has no other
    return BurstKey(
        sequence=interferer_sequence(
            question.scene, slope_hz_per_s=slope, num_interfered_ramps=int(num_ramps) or None
        ),
        anti_aliasing_filter=replace(own, cutoff_hz=cutoff_hz),
    )


def _members(num_objects: int, delays_s: list[float], objects: list[tuple[float, ...]]) -> _Sets:
    """Return sets of objects by their number: where each stands, and its lines (O, L)."""
    sets: dict[int, tuple[list[int], list[IntArray]]] = {}
    for place, (count, delay_s) in enumerate(objects):
        lines = np.arange(int(count) or num_objects)
        if math.isfinite(delay_s):
            lines[0] = num_objects + delays_s.index(delay_s)
        places, members = sets.setdefault(len(lines), ([], []))
        places.append(place)
        members.append(lines)
    return {
        count: (np.array(places), np.stack(members)) for count, (places, members) in sets.items()
    }
