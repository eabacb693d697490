"""Specifications of the panels of a study's figure."""

from dataclasses import dataclass
from typing import TypeAlias

ERROR_MISSES_FALSE_ALARMS = (
    ("mean_assigned_error", "mean assigned error [cycles]"),
    ("misses", "misses a frame"),
    ("false_alarms", "false alarms a frame"),
)
"""Metrics of scenes of several objects, with their labels."""


@dataclass(frozen=True, kw_only=True, slots=True)
class PanelSpec:
    """Curves of one metric over one parameter."""

    panel: str  #: the points that it shows, those of this panel
    metric: str  #: one of `vsep.studies.measures.METRICS`
    x: str  #: the parameter of the points that it is drawn over
    #: for the reader; panels of one title make one figure
    y_label: str
    title: str
    x_label: str = ""  #: the parameter's own by default
    variant: str | None = None  #: parameter that tells several curves of one method apart
    methods: tuple[str, ...] | None = None  #: those that are drawn; all that have rows by default
    of_scene: bool = False  #: whether the metric is the same for all methods, and drawn once
    #: whether an axis is logarithmic
    log_x: bool = False
    log_y: bool = False
    guides: tuple[tuple[str, float], ...] = ()  #: dashed lines with their labels
    with_bound: bool = False  #: whether the root of the Cramer-Rao bound is drawn, too


@dataclass(frozen=True, kw_only=True, slots=True)
class BoxSpec:
    """Boxes of error, misses and false alarms at one point of a panel."""

    panel: str
    title: str
    snr_db: float
    sir_db: float
    methods: tuple[str, ...] | None = None  #: those that are drawn; all that have rows by default


@dataclass(frozen=True, kw_only=True, slots=True)
class QuantileSpec:
    """Quantiles of the errors over their reported deviations, of all points of a panel."""

    panel: str
    title: str


AnySpec: TypeAlias = PanelSpec | BoxSpec | QuantileSpec
