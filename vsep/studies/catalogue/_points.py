"""Points that several studies are made of."""

from typing import Any

from vsep.presets.registry import SCENES
from vsep.studies.methods import estimator_names
from vsep.studies.panel_specs import ERROR_MISSES_FALSE_ALARMS, PanelSpec
from vsep.studies.study import Point, Study

VICTIM_SLOPE_HZ_PER_S = 1e13
_PAPER_THRESHOLD_DB = 9.0
_SIMULATION_2_THRESHOLD_DB = 11.0
_ONE_OBJECT, _MANY_OBJECTS = "simulation-1", "simulation-2"


def levels(lowest: int, highest: int, step: int = 5) -> list[float]:
    """Levels in dB, both ends included."""
    return [float(level) for level in range(lowest, highest + 1, step)]


def one_object(panel: str, **parameters: Any) -> Point:
    """Return a point of Simulation I, at SIR 0 dB if nothing else is said."""
    values = {"sir_db": 0.0, "object_threshold_db": _PAPER_THRESHOLD_DB, **parameters}
    return _point(panel, _ONE_OBJECT, values)


def many_objects(panel: str, **parameters: Any) -> Point:
    """Return a point of Simulation II."""
    return _point(
        panel, _MANY_OBJECTS, {"object_threshold_db": _SIMULATION_2_THRESHOLD_DB, **parameters}
    )


def example_signals(name: str, title: str, *points: Point) -> Study:
    """Return a study whose figure shows the signals of one realisation of each point."""
    return Study(
        name=name,
        title=f"Example signals of {title}",
        realizations=1,
        points=points,
        methods=estimator_names(),
        example="signals",
    )


def error_misses_false_alarms(**common: Any) -> list[PanelSpec]:
    """Return three panels with the metrics of scenes of several objects."""
    return [
        PanelSpec(metric=metric, y_label=label, log_y=metric == "mean_assigned_error", **common)
        for metric, label in ERROR_MISSES_FALSE_ALARMS
    ]


def _point(panel: str, scene: str, values: dict[str, Any]) -> Point:
    """Return a point with the usual levels of its scene."""
    usual, *_ = SCENES[scene]
    return Point(
        panel=panel, scene=scene, **{"snr_db": usual.snr_db, "sir_db": usual.sir_db, **values}
    )
