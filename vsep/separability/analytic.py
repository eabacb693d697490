"""Analytic map: every layer in every cell, without any estimator.

Few parameters decide on the objects (their number, a delay) and few on the bursts (slope, share,
filter); levels only shift (27). So the layers are evaluated for the distinct values of these, and
spread over the cells.
"""

from dataclasses import dataclass, replace

import numpy as np

from vsep._typing import FloatArray, IntArray
from vsep.presets.scenes import interferer_sequence
from vsep.separability.bursts import Interferers
from vsep.separability.layers import PairLayers, pair_layers
from vsep.separability.map_spec import MapSpec, default_value, ramps_of_share
from vsep.separability.objects import make_table
from vsep.signal.filters import RaisedCosineFilter
from vsep.studies.trial_scenario import simulate_trial


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class AnalyticMap:
    """Layers over the cells, (ny, nx) each; see `vsep.separability.layers.PairLayers`."""

    whole_db: FloatArray
    weakest_db: FloatArray
    coherence: FloatArray
    bound_loss_db: FloatArray


def analytic_map(spec: MapSpec) -> AnalyticMap:
    """Evaluate condition (27), the coherence and the bound's loss in every cell.

    They are those of the scene of the map's first realisation, and of the *true* filter.

    Parameters
    ----------
    spec : MapSpec
        The map.

    Returns
    -------
    AnalyticMap
        NaN where no burst crosses the band.
    """
    cutoffs = _given(spec, "filter_cutoff_hz", default_value(spec.scene, "filter_cutoff_hz"))
    courses, course_of = _distinct(cutoffs, _slopes(spec))
    ramp_counts, ramps_of = _distinct(_ramps(spec))
    object_counts, count_of = _distinct(_given(spec, "num_objects", 0.0))
    delays, delay_of = _distinct(_given(spec, "object_delay_s", -np.inf))
    layers = _layers(
        spec,
        courses,
        [int(count) for (count,) in ramp_counts],
        [int(count) for (count,) in object_counts],
        [delay_s for (delay_s,) in delays if np.isfinite(delay_s)],
    )
    cells = course_of, ramps_of, count_of, delay_of
    sir_db = _given(spec, "sir_db", default_value(spec.scene, "sir_db"))
    return AnalyticMap(
        whole_db=layers.whole_db[cells] + sir_db,
        weakest_db=layers.weakest_db[cells] + sir_db,
        coherence=layers.coherence[cells],
        bound_loss_db=layers.bound_loss_db[cells],
    )


def _given(spec: MapSpec, name: str, otherwise: float) -> FloatArray:
    values = spec.over_cells(name)
    return np.full(spec.shape, otherwise, dtype=np.float64) if values is None else values


def _slopes(spec: MapSpec) -> FloatArray:
    """Slopes of the interferer; added up as the point of a cell does, to the bit."""
    differences = spec.over_cells("slope_difference_hz_per_s")
    if differences is None:
        return np.full(spec.shape, interferer_sequence(spec.scene).slope_hz_per_s)
    return np.asarray(spec.radar.slope_hz_per_s + differences)


def _ramps(spec: MapSpec) -> FloatArray:
    """Numbers of interfered ramps; those that Table I makes count as 0."""
    shares = spec.over_cells("interfered_share")
    if shares is None:
        return np.zeros(spec.shape)
    counts = {share: ramps_of_share(spec.radar, share) for share in set(shares.flat)}
    return np.array([[counts[share] for share in row] for row in shares], dtype=np.float64)


def _distinct(*values: FloatArray) -> tuple[list[tuple[float, ...]], IntArray]:
    """Return the distinct combinations, ascending, and which of them every cell has, (ny, nx)."""
    stacked = np.stack([value.ravel() for value in values], axis=1)
    found, places = np.unique(stacked, axis=0, return_inverse=True)
    return [tuple(row) for row in found.tolist()], places.reshape(values[0].shape)


def _layers(
    spec: MapSpec,
    courses: list[tuple[float, ...]],
    ramp_counts: list[int],
    object_counts: list[int],
    delays_s: list[float],
) -> PairLayers:
    """Layers of the courses (cut-off, slope), numbers of ramps and objects, and delays."""
    trial = spec.trial((0, 0))
    # Zero stands for what the scene has by itself.
    most = object_counts[-1] or None
    drawn = simulate_trial(
        replace(trial, point=replace(trial.point, num_objects=most, object_delay_s=None))
    ).scenario
    own = drawn.anti_aliasing_filter
    assert isinstance(own, RaisedCosineFilter)  # points of a map have no other
    sequences = {
        slope: interferer_sequence(
            spec.scene, slope_hz_per_s=slope, num_interfered_ramps=ramp_counts[-1] or None
        )
        for slope in sorted({slope for _, slope in courses})
    }
    filters = {cutoff: replace(own, cutoff_hz=cutoff) for cutoff in {each[0] for each in courses}}
    interferers = Interferers(
        sequences=[sequences[slope] for _, slope in courses],
        filters=[filters[cutoff] for cutoff, _ in courses],
        ramp_counts=(*ramp_counts[:-1], next(iter(sequences.values())).num_ramps),
    )
    return pair_layers(
        drawn.radar,
        drawn.scene.interferers[0].channel,
        interferers,
        make_table(drawn.radar, drawn.scene.objects, delays_s),
        [count or drawn.scene.objects.num_paths for count in object_counts],
    )
