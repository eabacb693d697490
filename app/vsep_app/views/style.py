"""Style of all figures: colours by role, small type, limits that respect the user's zoom.

Colours are those of Okabe and Ito, safe for colour-blind readers and at least 3:1 against both
white and the dark page. The role is never told by colour alone: truth is dashed or a cross, an
estimate is a line or a ring.
"""

from collections.abc import Mapping, Sequence
from html import escape
from typing import Any

import numpy as np
from bokeh.events import DoubleTap
from bokeh.models import (
    AllIndices,
    BoxZoomTool,
    ColumnDataSource,
    CustomJS,
    HoverTool,
    Legend,
    PanTool,
    Range1d,
    ResetTool,
    SaveTool,
    Span,
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
LEGEND = {"click_policy": "hide", "border_line_color": None, "spacing": 10}
_SAMPLES = {
    "line": '<path d="M1 5H17"/>',
    "dashed": '<path d="M1 5H17" stroke-dasharray="5 3"/>',
    "cross": '<path d="M6 2L12 8M12 2L6 8"/>',
    "circle": '<circle cx="9" cy="5" r="3.5"/>',
    "square": '<path d="M5.5 1.5H12.5V8.5H5.5Z"/>',
    "diamond": '<path d="M9 1L13 5L9 9L5 5Z"/>',
}

EDGE_SHARE = 0.03  # of an axis: so far from its end is what it was widened for
# The zoom tool's own answer to a double click is the view that the figure had before its first
# picture; this one comes after it.
_SHOW_ALL = """
setTimeout(() => {
  for (const range of [x, y]) range.setv({start: range.reset_start, end: range.reset_end})
}, 0)
"""

Limits = tuple[float, float]


class Axis:
    """One range whose limits are set by the scene and whose zoom belongs to the user."""

    def __init__(self) -> None:
        self.range = Range1d(start=0.0, end=1.0)
        self._limits: Limits | None = None
        self._held: tuple[Limits, int] | None = None
        self._zoomed: Limits | None = None
        #: Whether the limits stay, whatever is drawn: what is dragged stays under the pointer.
        self.is_frozen = False

    def set(self, limits: Limits) -> None:
        """Take new limits, to which a reset returns; a range the user has zoomed keeps its zoom."""
        if limits == self._limits or self.is_frozen:
            return
        untouched = self._zoomed is None and (
            self._limits is None or (self.range.start, self.range.end) == self._limits
        )
        self._limits = limits
        self.range.update(reset_start=limits[0], reset_end=limits[1])
        if untouched:
            self.range.update(start=limits[0], end=limits[1])

    def zoom(self, ends: Limits | None) -> None:
        """Show a part, as a user does who zooms; None shows all again where a part was shown."""
        shown = ends or (self._limits if self._zoomed is not None else None)
        self._zoomed = ends
        if shown is not None:
            self.range.update(start=shown[0], end=shown[1])

    def grow(self, limits: Limits, *, fresh: bool) -> None:
        """Widen the limits so that they hold `limits`; `fresh` forgets what was held before."""
        if self._limits is not None and not fresh:
            lowest, highest = self._limits
            limits = (min(lowest, limits[0]), max(highest, limits[1]))
        self.set(limits)

    def hold(
        self, limits: Limits, places: "np.ndarray[Any, np.dtype[np.float64]]", *, run_number: int
    ) -> None:
        """Take the limits of a scene, widened to show all places there have been in a run."""
        fresh = self._held != (limits, run_number)
        self._held = limits, run_number
        margin = EDGE_SHARE * (limits[1] - limits[0])
        lowest, highest = limits
        if places.size:
            least, most = float(places.min()), float(places.max())
            lowest = least - margin if least < lowest else lowest
            highest = most + margin if most > highest else highest
        self.grow((lowest, highest), fresh=fresh)


def mark_looks(
    number: int, found: "np.ndarray[Any, np.dtype[np.bool_]] | None"
) -> dict[str, list[str]]:
    """Return shape and colour of estimates: false ones are square, found ones green.

    `found` is None where the truth is not known, and with it neither is.
    """
    if found is None:
        return {"shape": ["circle"] * number, "colour": [COLOURS["object"]] * number}
    return {
        "shape": ["circle" if each else "square" for each in found],
        "colour": [COLOURS["cleaned" if each else "interference"] for each in found],
    }


def put(source: ColumnDataSource, columns: Mapping[str, Any]) -> None:
    """Give a source new columns, unless it has them already: less for the browser to draw."""
    held = source.data
    if held.keys() == columns.keys() and all(
        _same(held[name], column) for name, column in columns.items()
    ):
        return
    source.data = dict(columns)


def short(column: Any) -> list[float]:
    """Return a short column as a list: an array would be two messages of its own to the browser."""
    return [float(value) for value in column]


def _same(held: Any, column: Any) -> bool:
    if isinstance(column, np.ndarray) and isinstance(held, np.ndarray):
        return np.array_equal(held, column, equal_nan=column.dtype.kind == "f")
    if not isinstance(column, list) or not isinstance(held, list) or len(held) != len(column):
        return False
    if any(isinstance(each, np.ndarray) for each in (*held, *column)):
        return all(_same(*each) for each in zip(held, column, strict=True))
    return held == column


def plain_figure(
    name: str, title: str, labels: tuple[str, str], axes: tuple[Axis, Axis], *, tools: bool = True
) -> figure:
    """Return an empty figure in the common look; labels, of x and y, carry their units."""
    plot = figure(
        title=title,
        x_axis_label=labels[0],
        y_axis_label=labels[1],
        x_range=axes[0].range,
        y_range=axes[1].range,
        tools=[],
        sizing_mode="stretch_both",
        min_height=60,
        min_border=4,
        name=name,
        # What the headline and the tables say is there to be read; this says what the canvas is.
        html_attributes={"role": "group", "aria-label": _described(title or name, labels)},
        styles={"font-size": LABEL_SIZE},
        stylesheets=[f":host {{ --bokeh-font-size: {LABEL_SIZE}; font-size: {LABEL_SIZE}; }}"],
    )
    if tools:
        zoom, wheel = BoxZoomTool(), WheelZoomTool()
        plot.add_tools(zoom, PanTool(), wheel, ResetTool(), SaveTool())
        plot.toolbar.update(active_drag=zoom, active_scroll=wheel)
        ranges = {"x": axes[0].range, "y": axes[1].range}
        plot.js_on_event(DoubleTap, CustomJS(args=ranges, code=_SHOW_ALL))
    else:
        # A small figure has no room for a tool bar: it lies on the figure, under the pointer only.
        plot.add_tools(SaveTool())
        plot.toolbar_inner = True
    dress(plot)
    plot.title.text_font_size = "12px"
    plot.title.standoff = 2
    keep_to_the_browser(plot, plot.title, plot.toolbar, *plot.axis, *plot.grid)
    return plot


def keep_to_the_browser(*parts: Any) -> None:
    """Let the browser keep to itself how large parts of a figure are and in which colours.

    It gives them those of the theme, which is some three hundred messages' worth a page.
    """
    for part in parts:
        part.syncable = False


def _described(title: str, labels: tuple[str, str]) -> str:
    x, y = labels
    return f"Figure: {title}" + (f", {y} over {x}" if x and y else "")


def crosshair() -> Span:
    """Return the line at the pointer, for all figures with the same range axis."""
    return Span(dimension="height", line_dash=[4, 3], line_color="#8C8C8C")


def empty_figure() -> figure:
    """Return a figure without anything: the place of one that is still to come."""
    plot = figure(x_range=(0, 1), y_range=(0, 1), toolbar_location=None, outline_line_color=None)
    plot.scatter([], [])
    plot.axis.visible = plot.grid.visible = False
    return plot


def dress(plot: Any) -> None:
    """Give a figure the common look: small type, few ticks, a faint grid, a tool bar that hides."""
    plot.toolbar.logo = None
    plot.toolbar.autohide = True
    for axis in plot.axis:
        axis.axis_label_text_font_size = LABEL_SIZE
        axis.major_label_text_font_size = LABEL_SIZE
        axis.axis_label_text_font_style = "normal"
        axis.axis_label_standoff = 3
        axis.major_tick_in = 0
        axis.minor_tick_line_color = None
    plot.grid.grid_line_alpha = 0.35
    plot.min_border = 4
    plot.min_border_right = 14


def lighten(plot: figure) -> None:
    """Take out what a figure has for selecting and muting, which nobody does here.

    That is a third of its models; each of them costs time when the page is opened.
    """
    everything = AllIndices()
    for renderer in plot.renderers:
        renderer.update(nonselection_glyph=None, muted_glyph=None)
        renderer.view.filter = everything


def tell_of_components(plot: figure, marks: Any, label: str, place: str) -> None:
    """Let the pointer show place and SNR of the components that are marked."""
    tooltips = [(label, place), ("component SNR", "@snr{0.0} dB")]
    plot.add_tools(HoverTool(renderers=[marks], tooltips=tooltips))


def legend_of(plot: figure, entries: list[tuple[str, list[Any]]]) -> Legend:
    """Add a flat legend in the plot's upper right corner; a click hides a signal.

    For documents that stand still: a legend makes the browser lay out the page anew with every
    picture, which halves the rate (measured); a live page has `key_html` instead.
    """
    look = {"background_fill_alpha": 0.55, "padding": 1, "margin": 2, "label_standoff": 4}
    sizes = {"glyph_width": 16, "glyph_height": 12, "label_height": 12}
    legend = Legend(items=list(entries), orientation="horizontal", location="top_right")
    legend.update(**LEGEND, **look, **sizes, label_text_font_size=LABEL_SIZE)
    plot.add_layout(legend)
    return legend


def key_html(entries: Sequence[tuple[str, str, str]]) -> str:
    """Return a legend as HTML.

    Parameters
    ----------
    entries : sequence of (str, str, str)
        Role of the colour, label, and sample: line, dashed, cross, circle or diamond.
    """
    items = "".join(
        f'<span class="item"><svg width="18" height="10" aria-hidden="true" fill="none" '
        f'stroke="{COLOURS[role]}" stroke-width="2">{_SAMPLES[sample]}</svg>{escape(label)}</span>'
        for role, label, sample in entries
    )
    return f'<div class="key">{items}</div>'
