"""One look for all figures: colours by role, small type, limits that respect the user's zoom.

Colours are those of Okabe and Ito, safe for colour-blind readers and at least 3:1 against both
white and the dark page. The role is never told by colour alone: truth is dashed or a cross, an
estimate is a line or a ring.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np
from bokeh.models import (
    BoxZoomTool,
    ColumnDataSource,
    CustomJS,
    Legend,
    PanTool,
    Range1d,
    ResetTool,
    WheelZoomTool,
)
from bokeh.plotting import figure

COLOURS = {
    "received": "#8C8C8C",
    "true": "#CC79A7",
    "object": "#0A84C6",
    "interference": "#D55E00",
    "cleaned": "#009E73",
}
MAP_PALETTE = "Viridis256"
LABEL_SIZE = "11px"

Limits = tuple[float, float]


class Axis:
    """One range whose limits are set by the scene and whose zoom belongs to the user."""

    def __init__(self) -> None:
        self.range = Range1d(start=0.0, end=1.0)
        self._limits: Limits | None = None

    def set(self, limits: Limits, *, full: Limits | None = None) -> None:
        """Take new limits; a range the user has zoomed keeps its zoom.

        The reset tool shows `full`, all there is, which may be more than the limits.
        """
        if limits == self._limits:
            return
        untouched = self._limits is None or (self.range.start, self.range.end) == self._limits
        self._limits = limits
        lowest, highest = full or limits
        self.range.update(reset_start=lowest, reset_end=highest)
        if untouched:
            self.range.update(start=limits[0], end=limits[1])

    def grow(self, limits: Limits, *, fresh: bool) -> None:
        """Widen the limits so that they hold `limits`; `fresh` forgets what was held before."""
        if self._limits is not None and not fresh:
            lowest, highest = self._limits
            limits = (min(lowest, limits[0]), max(highest, limits[1]))
        self.set(limits)


def put(source: ColumnDataSource, columns: Mapping[str, Any]) -> None:
    """Give a source new columns, unless they are those it has: the browser then has less to draw."""
    held = source.data
    if held.keys() == columns.keys() and all(
        _same(held[name], column) for name, column in columns.items()
    ):
        return
    source.data = dict(columns)


def _same(held: Any, column: Any) -> bool:
    if isinstance(column, np.ndarray) and isinstance(held, np.ndarray):
        return np.array_equal(held, column, equal_nan=column.dtype.kind == "f")
    return isinstance(column, list) and bool(held == column)


def plain_figure(
    *,
    title: str,
    x_label: str,
    y_label: str,
    x_axis: Axis,
    y_axis: Axis,
    name: str,
    tools: bool = True,
    **options: Any,
) -> figure:
    """Return an empty figure in the common look; labels carry their units."""
    plot = figure(
        title=title,
        x_axis_label=x_label,
        y_axis_label=y_label,
        x_range=x_axis.range,
        y_range=y_axis.range,
        tools=[],
        sizing_mode="stretch_both",
        min_height=60,
        min_border=4,
        name=name,
        styles={"font-size": LABEL_SIZE},
        stylesheets=[f":host {{ --bokeh-font-size: {LABEL_SIZE}; font-size: {LABEL_SIZE}; }}"],
        **options,
    )
    if tools:
        zoom = BoxZoomTool()
        plot.add_tools(zoom, PanTool(), WheelZoomTool(), ResetTool())
        plot.toolbar.active_drag = zoom
    plot.toolbar.logo = None
    plot.toolbar.autohide = True
    plot.title.text_font_size = "12px"
    plot.title.standoff = 2
    for axis in plot.axis:
        axis.axis_label_text_font_size = LABEL_SIZE
        axis.major_label_text_font_size = LABEL_SIZE
        axis.axis_label_text_font_style = "normal"
        axis.axis_label_standoff = 3
        axis.major_tick_in = 0
        axis.minor_tick_line_color = None
    plot.grid.grid_line_alpha = 0.35
    plot.min_border_right = 14
    return plot


def legend_of(
    plot: figure, entries: list[tuple[str, list[Any]]], source: ColumnDataSource
) -> Legend:
    """Add a flat legend in the plot's upper right corner; a click hides a signal.

    A themed page restyles a legend after it was painted, which loses the samples of the lines; they
    are painted anew after the first data of `source` and after each change of the theme.
    """
    legend = Legend(
        items=list(entries),
        orientation="horizontal",
        location="top_right",
        click_policy="hide",
        label_text_font_size=LABEL_SIZE,
        border_line_color=None,
        background_fill_alpha=0.55,
        padding=1,
        margin=2,
        spacing=10,
        glyph_width=16,
        glyph_height=12,
        label_standoff=4,
        label_height=12,
    )
    plot.add_layout(legend)
    repaint = """
const repaint = () => [100, 1000, 3000].forEach(
  (delay) => setTimeout(() => legend.change.emit(), delay)
)
if (!source.legend_painted) {
  source.legend_painted = true
  legend.properties.label_text_color.change.connect(repaint)
  repaint()
}
"""
    source.js_on_change("data", CustomJS(args={"source": source, "legend": legend}, code=repaint))
    return legend
