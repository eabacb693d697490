"""All layers of a map by name, with what a reader must know of each: label, range of colours."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from vsep._typing import BoolArray, FloatArray
from vsep._version import __version__
from vsep.analysis.intervals import binomial_interval
from vsep.separability.analytic import AnalyticMap
from vsep.separability.cells import CellResult, coarser
from vsep.separability.map_spec import Cell, MapSpec


@dataclass(frozen=True, kw_only=True, slots=True)
class Layer:
    """One layer of a map."""

    label: str  #: for a reader, with its unit
    diverging: bool = False  #: whether zero is the middle of its colours
    empirical: bool = False  #: whether it comes from trials
    #: the colours reach at least, and at most, up to these
    floor: float = 1.0
    cap: float = 1.0


LAYERS: dict[str, Layer] = {
    "whole_db": Layer(
        label="condition (27), all objects [dB]", diverging=True, floor=10.0, cap=40.0
    ),
    "weakest_db": Layer(
        label="condition (27), weakest object [dB]", diverging=True, floor=10.0, cap=40.0
    ),
    "coherence": Layer(label="coherence of the bases", floor=0.05, cap=1.0),
    "bound_loss_db": Layer(
        label="loss of the CRLB by unknown interference [dB]", floor=1e-3, cap=30.0
    ),
    "detection": Layer(label="objects found, share", empirical=True),
    "rmse_over_crlb": Layer(label="RMSE / root CRLB", empirical=True, floor=2.0, cap=5.0),
    "false_alarms": Layer(label="false alarms a frame", empirical=True, floor=1.0, cap=20.0),
}
_MEASURES: dict[str, Callable[[CellResult], float]] = {
    "detection": lambda cell_result: cell_result.detection,
    "rmse_over_crlb": lambda cell_result: cell_result.rmse_over_crlb,
    "false_alarms": lambda cell_result: cell_result.false_alarms,
}


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class SeparabilityMap:
    """The layers of a map."""

    spec: MapSpec  #: what they are of
    #: by the names of `LAYERS`. A cell that has no trials yet shows those of the coarser grid.
    layers: Mapping[str, FloatArray]
    trials: FloatArray  #: (ny, nx) trials made in each cell
    #: (2, ny, nx) interval of the share of objects found, at 95 %; NaN where there are no trials
    detection_interval: FloatArray

    @property
    def finished(self) -> BoolArray:
        """(ny, nx) whether the trials of a cell are made."""
        return self.trials > 0

    def limits(self, name: str) -> tuple[float, float]:
        """Return the range of colours of a layer."""
        layer, values = LAYERS[name], self.layers[name]
        known = np.abs(values[np.isfinite(values)])
        largest = float(known.max()) if len(known) else 0.0
        top = min(max(largest, layer.floor), layer.cap)
        return (-top if layer.diverging else 0.0), top


def make_separability_map(
    spec: MapSpec, analytic: AnalyticMap, cell_results: Mapping[Cell, CellResult]
) -> SeparabilityMap:
    """Put all layers of a map together.

    Parameters
    ----------
    spec : MapSpec
        The map.
    analytic : AnalyticMap
        Its layers that need no estimator.
    cell_results : mapping of (int, int) to CellResult
        What trials gave so far.
    """
    shape = spec.shape
    trials = np.zeros(shape)
    interval = np.full((2, *shape), np.nan)
    measured = {name: np.full(shape, np.nan) for name in _MEASURES}
    for row, column in np.ndindex(shape):
        cell = column, row
        if cell in cell_results:
            result = cell_results[cell]
            trials[row, column] = result.num_trials
            found = binomial_interval(result.num_found, result.num_objects)
            interval[:, row, column] = found.low, found.high
        nearest = next(
            (other for other in coarser(cell, shape[1], shape[0]) if other in cell_results), None
        )
        if nearest is not None:
            for name, measure in _MEASURES.items():
                measured[name][row, column] = measure(cell_results[nearest])
    return SeparabilityMap(
        spec=spec,
        layers={
            "whole_db": analytic.whole_db,
            "weakest_db": analytic.weakest_db,
            "coherence": analytic.coherence,
            "bound_loss_db": analytic.bound_loss_db,
            **measured,
        },
        trials=trials,
        detection_interval=interval,
    )


def table_rows(separability_map: SeparabilityMap) -> list[dict[str, Any]]:
    """Return one row a cell: its parameters, all layers, number of trials, version of vsep.

    A layer that comes from trials is empty where there are none.
    """
    spec, rows = separability_map.spec, []
    for row, column in np.ndindex(spec.shape):
        values: dict[str, Any] = {"scene": spec.scene, **spec.parameters((column, row))}
        made = bool(separability_map.finished[row, column])
        for name, layer in LAYERS.items():
            shown = made or not layer.empirical
            values[name] = (
                float(f"{separability_map.layers[name][row, column]:.7g}") if shown else None
            )
        trials = int(separability_map.trials[row, column])
        rows.append({**values, "trials": trials, "version": __version__})
    return rows
