"""The panels of a study described once, as HoloViews elements for both back ends."""

from collections.abc import Callable, Iterator, Sequence
from typing import Any, NamedTuple, TypeAlias

import numpy as np

from vsep.studies.panels import AnyPanel, Box, BoxPanel, FigurePanel, ImagePanel, Series
from vsep_app.figures.backends import Backend, holoviews
from vsep_app.figures.study_style import DASHES, MARKERS, colour, is_filled, marker, width

Columns: TypeAlias = dict[str, Any]
Options: TypeAlias = dict[str, Any]
# Matplotlib's names, which Bokeh does not know, and widths in points, not pixels.
_LINE_STYLES = dict(zip(DASHES, ("-", "--", ":", "-."), strict=True))
_POINTS = 0.6
_BOX_WIDTH = 0.6


class Mark(NamedTuple):
    """One element of a panel."""

    kind: str  #: Its class in HoloViews.
    columns: Columns  #: Its data; the first `num_keys` are key dimensions.
    num_keys: int  #: Positions of the element: one of a curve, four of a segment.
    look: Callable[[Backend], Options]  #: Options of a back end.
    label: str = ""  #: For the legend; marks of one label are one entry.

    def element(self, backend: Backend) -> Any:
        """Return the element with the options of a back end."""
        names = list(self.columns)
        element = getattr(holoviews(backend), self.kind)(
            tuple(self.columns.values()),
            names[: self.num_keys],
            names[self.num_keys :],
            label=self.label,
        )
        return element.opts(**self.look(backend), backend=backend)

    @property
    def source(self) -> Columns:
        """The columns of the Bokeh source: an area is a closed line, an image has a corner."""
        if self.kind == "Image":
            x, y, levels = self.columns.values()
            step_x, step_y = x[1] - x[0], y[1] - y[0]
            return {
                "image": [levels],
                "x": [x[0] - 0.5 * step_x],
                "y": [y[0] - 0.5 * step_y],
                "dw": [len(x) * step_x],
                "dh": [len(y) * step_y],
            }
        if self.kind != "Area":
            return self.columns
        x, low, high = self.columns.values()
        return {"x": np.append(x, x[::-1]), "y": np.append(high, low[::-1])}


def overlay(marks: Sequence[Mark], backend: Backend, **options: Any) -> Any:
    """Return marks on common axes; the options are those that both back ends have."""
    if backend == "bokeh":
        options |= {"legend_position": "bottom", "active_tools": ["box_zoom"]}
    else:
        options |= {"aspect": "auto"}
    elements = holoviews(backend).Overlay([mark.element(backend) for mark in marks])
    return elements.opts(show_grid=True, legend_limit=1000, backend=backend, **options)


def panel_overlay(panel: AnyPanel, backend: Backend) -> Any:
    """Return a panel as one overlay with its axes, note and legend."""
    options: Options = {"title": panel.note, "ylabel": panel.y_label, "logy": panel.log_y}
    if isinstance(panel, BoxPanel):
        ticks = list(enumerate(box.role for box in panel.boxes))
        options |= {"xlabel": "", "xticks": ticks, "xrotation": 25, "show_legend": False}
    else:
        log_x = isinstance(panel, FigurePanel) and panel.log_x
        options |= {"xlabel": panel.x_label, "logx": log_x, "legend_cols": 2}
    return overlay(panel_marks(panel), backend, **options)


def panel_marks(panel: AnyPanel) -> list[Mark]:
    """Return all that a panel draws, in order."""
    if isinstance(panel, BoxPanel):
        return [mark for place, box in enumerate(panel.boxes) for mark in _box_marks(place, box)]
    image = []
    if isinstance(panel, ImagePanel):
        columns = {"x": panel.x, "y": panel.y, "level": panel.levels_db}
        image = [Mark("Image", columns, 2, _image_look)]
    marks = [mark for series in panel.series for mark in _series_marks(series, panel.log_y)]
    return image + marks


def panel_shape(panel: AnyPanel) -> tuple[Any, ...]:
    """Return what two panels share if one figure can show both, one after the other."""
    marks = [(mark.kind, mark.label) for mark in panel_marks(panel)]
    return panel.title, panel.y_label, *marks


def _series_marks(series: Series, log_y: bool) -> Iterator[Mark]:
    shade = colour(series.role)
    x, y, low, high = series.x, series.y, series.low, series.high
    if log_y:
        # A logarithm has no place for zero; the point is left out, not moved.
        y, low, high = (np.where(values > 0.0, values, np.nan) for values in (y, low, high))
    named = {"label": series.label}
    line = {"x": x, "y": y}
    if series.kind == "crosses":
        yield Mark("Scatter", line, 1, points("x", shade, size=9), **named)
    elif series.kind == "stems":
        yield Mark("Segments", {"x": x, "low": low, "x1": x, "y": y}, 4, _line(shade, alpha=0.5))
        yield Mark("Scatter", line, 1, points("circle", shade, size=7, fill=False), **named)
    elif series.kind == "dashed":
        yield Mark("Curve", line, 1, _line(shade, "dashed", 1.5), **named)
        known = np.isfinite(low) & np.isfinite(high)
        if known.any():
            band = {"x": x[known], "low": low[known], "high": high[known]}
            yield Mark("Area", band, 1, _area(shade), **named)
    else:
        dash = DASHES[series.variant % len(DASHES)]
        yield Mark("Curve", line, 1, _line(shade, dash, width(series.role)), **named)
        if series.kind == "curve":
            bars = {"x": x, "low": low, "x1": x, "high": high}
            yield Mark("Segments", bars, 4, _line(shade, alpha=0.7), **named)
            tips = [("", series.label), ("x", "@x"), ("value", "@y"), ("interval", "@low to @high")]
            look = points(marker(series.role), shade, size=6, tips=tips)
            yield Mark("Scatter", line | {"low": low, "high": high}, 1, look, **named)


def _box_marks(place: int, box: Box) -> Iterator[Mark]:
    shade, half = colour(box.role), 0.5 * _BOX_WIDTH
    feet, tops = np.array([box.low, box.third]), np.array([box.first, box.high])
    at = np.full(2, float(place))
    whiskers = {"x": at, "low": feet, "x1": at, "high": tops}
    yield Mark("Segments", whiskers, 4, _line(shade))
    # Two halves: their common edge is the median.
    edges = {"left": at - half, "bottom": np.array([box.first, box.middle])}
    edges |= {"right": at + half, "top": np.array([box.middle, box.third])}
    yield Mark("Rectangles", edges, 4, _area(shade, edge=True), label=box.role)
    outliers = np.array(box.outliers)
    dots = {"x": np.full(len(outliers), float(place)), "y": outliers}
    yield Mark("Scatter", dots, 1, points("cross", shade, size=6))
    count = {
        "x": at[: min(1, len(outliers))] + 0.3 * half,
        "y": outliers[[outliers.argmax()]] if len(outliers) else outliers,
        "text": [str(len(outliers))] if len(outliers) else [],
    }
    yield Mark("Labels", count, 2, _count_look)


def _line(
    shade: str, dash: str = "solid", line_width: float = 1.2, alpha: float = 1.0
) -> Callable[[Backend], Options]:
    def look(backend: Backend) -> Options:
        common: Options = {"color": shade, "alpha": alpha}
        if backend == "bokeh":
            return {**common, "line_dash": dash, "line_width": line_width}
        return {**common, "linestyle": _LINE_STYLES[dash], "linewidth": _POINTS * line_width}

    return look


def points(
    shape: str, shade: str, *, size: float, fill: bool = True, alpha: float = 1.0, tips: Any = None
) -> Callable[[Backend], Options]:
    """Return the look of markers; `tips` are what the pointer shows, on screen."""

    def look(backend: Backend) -> Options:
        if backend == "bokeh":
            fill_colour = shade if fill and is_filled(shape) else None
            hover = {"hover_tooltips": tips, "tools": ["hover"]} if tips else {}
            face = {"fill_color": fill_colour, "fill_alpha": alpha}
            return {"line_color": shade, "marker": shape, "size": size, **face, **hover}
        area = {"s": (_POINTS * size) ** 2, "marker": MARKERS[shape], "linewidth": 0.8}
        return {"facecolors": shade if fill else "none", "edgecolors": shade, **area}

    return look


def _area(shade: str, *, edge: bool = False) -> Callable[[Backend], Options]:
    alpha = 0.25 if edge else 0.12

    def look(backend: Backend) -> Options:
        if backend == "bokeh":
            line = {"line_color": shade, "line_width": 1.5} if edge else {"line_color": None}
            return {"fill_color": shade, "fill_alpha": alpha, **line}
        if edge:
            return {"facecolor": (shade, alpha), "edgecolor": shade, "linewidth": 0.9}
        return {"color": shade, "facecolor": shade, "alpha": alpha, "linewidth": 0}

    return look


def _image_look(backend: Backend) -> Options:
    del backend
    return {"cmap": "viridis"}


def _count_look(backend: Backend) -> Options:
    if backend == "bokeh":
        return {"text_font_size": "10px", "text_align": "left", "text_color": "#000000"}
    return {"size": 6, "horizontalalignment": "left", "color": "black"}
