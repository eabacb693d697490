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
    """Curves of one metric over one parameter.

    Parameters
    ----------
    panel : str
        The points that it shows, those of this panel.
    metric : str
        One of `vsep.studies.measures.METRICS`.
    x : str
        The parameter of the points that it is drawn over.
    y_label, title : str
        For the reader; panels of one title make one figure.
    x_label : str
        The parameter's own by default.
    variant : str, optional
        Parameter that tells several curves of one method apart.
    methods : tuple of str, optional
        Those that are drawn; all that have rows by default.
    of_scene : bool
        Whether the metric is the same for all methods, and drawn once.
    log_x, log_y : bool
        Whether an axis is logarithmic.
    guides : tuple of (str, float)
        Dashed lines with their labels.
    with_bound : bool
        Whether the root of the Cramer-Rao bound is drawn, too.
    """

    panel: str
    metric: str
    x: str
    y_label: str
    title: str
    x_label: str = ""
    variant: str | None = None
    methods: tuple[str, ...] | None = None
    of_scene: bool = False
    log_x: bool = False
    log_y: bool = False
    guides: tuple[tuple[str, float], ...] = ()
    with_bound: bool = False


@dataclass(frozen=True, kw_only=True, slots=True)
class BoxSpec:
    """Boxes of error, misses and false alarms at one point of a panel."""

    panel: str
    title: str
    snr_db: float
    sir_db: float


@dataclass(frozen=True, kw_only=True, slots=True)
class QuantileSpec:
    """Quantiles of the errors over their reported deviations, of all points of a panel."""

    panel: str
    title: str


AnySpec: TypeAlias = PanelSpec | BoxSpec | QuantileSpec
