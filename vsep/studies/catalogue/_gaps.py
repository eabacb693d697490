"""Points and panels that the studies of compressive sensing are made of."""

from collections.abc import Iterator
from typing import Any

from vsep.studies.panel_specs import PanelSpec
from vsep.studies.study import GAPS, GapPoint

METRICS = (
    ("gap_error_db", "error in the gaps [dB]"),
    ("iterations_to_plain", "iterations to the plain accuracy"),
    ("false_alarms", "false objects a frame"),
    ("misses", "missed objects a frame"),
)


def gaps(panel: str, **parameters: Any) -> GapPoint:
    """Return a point: half of every ramp lost, 0 dB a sample, chirps 20 dB above the objects."""
    values = {"snr_db": 0.0, "sir_db": -20.0, **parameters}
    return GapPoint(panel=panel, scene=GAPS, **values)


def gap_panels(panel: str, x: str, title: str, **more: Any) -> Iterator[PanelSpec]:
    """Yield the panels of a sweep."""
    for metric, label in METRICS:
        yield PanelSpec(panel=panel, metric=metric, x=x, y_label=label, title=title, **more)
