"""The figure of a study: HTML that opens from disk, or PNG and SVG for print.

Everything that is drawn was computed by `vsep.studies`; a row of panels shares one title.
"""

from collections.abc import Mapping, Sequence
from itertools import groupby
from pathlib import Path
from typing import Any

import numpy as np
from bokeh.embed import file_html
from bokeh.layouts import column, row
from bokeh.models import ColumnDataSource, Div, HoverTool, Legend, Title
from bokeh.plotting import figure
from bokeh.resources import INLINE

from vsep.errors import InputError
from vsep.studies.example import example_panels
from vsep.studies.figures import study_panels
from vsep.studies.panels import AnyPanel, Box, BoxPanel, FigurePanel, Series
from vsep.studies.trial import Row
from vsep_app.figures.study_print import write_print
from vsep_app.figures.study_style import DASHES, colour, marker, width

SUFFIXES = (".html", ".png", ".svg")
WIDTH, HEIGHT = 400, 330
_FONT_SIZE = "11px"
_NOTE, _SERIES = "note", "series-"
_WHISKERS, _HALVES, _OUTLIERS, _COUNTS = "whiskers", "halves", "outliers", "counts"
_NOTE_STYLE = {"text_font_size": "9px", "text_font_style": "normal", "text_color": "#555555"}


def write_study_figure(rows: Sequence[Row], out: Path) -> None:
    """Draw the rows of one or several studies into a file.

    Parameters
    ----------
    rows : sequence of dict
        As `vsep study run` writes them.
    out : Path
        File to write, ``.html``, ``.png`` or ``.svg``.

    Raises
    ------
    InputError
        If the suffix is another one, or nothing in the rows can be drawn.
    OSError
        If the file cannot be written.
    """
    suffix = out.suffix.lower()
    if suffix not in SUFFIXES:
        raise InputError(f"The figure {out.name!r} must end in .html, .png or .svg.")
    panels = figure_panels(rows)
    if suffix == ".html":
        title = f"vsep: {', '.join(dict.fromkeys(row['study'] for row in rows))}"
        out.write_text(figure_html(panels, title=title), encoding="utf-8")
    else:
        write_print(panels, out, suffix=suffix)


def figure_panels(rows: Sequence[Row]) -> list[AnyPanel]:
    """Return the panels of rows, examples first; `InputError` if there is none."""
    panels: list[AnyPanel] = [*example_panels(rows), *study_panels(rows)]
    if not panels:
        raise InputError("The rows hold no finished trial of a known study; run one first.")
    return panels


def figure_html(panels: Sequence[AnyPanel], *, title: str) -> str:
    """Return the panels as one HTML document that asks for nothing else."""
    rows: list[Any] = []
    for name, members in groupby(panels, key=lambda panel: panel.title):
        own = list(members)
        rows.append(Div(text=f"<b>{name}</b>"))
        rows.append(row([draw_panel(panel) for panel in own]))
    document: str = file_html(column(rows), resources=INLINE, title=title)
    return document


def draw_panel(panel: AnyPanel) -> figure:
    """Draw one panel as a Bokeh figure; `update_panel` gives it newer numbers."""
    columns = panel_columns(panel)
    sources = {name: ColumnDataSource(data, name=name) for name, data in columns.items()}
    if isinstance(panel, BoxPanel):
        return _draw_boxes(panel, sources)
    return _draw_curves(panel, sources)


def panel_shape(panel: AnyPanel) -> tuple[Any, ...]:
    """Return what two panels share if one figure can show both, one after the other."""
    if isinstance(panel, BoxPanel):
        return panel.title, panel.y_label, *[box.role for box in panel.boxes]
    series = [(one.label, one.role, one.kind, one.variant) for one in panel.series]
    return panel.title, panel.y_label, *series


def update_panel(plot: figure, panel: AnyPanel) -> None:
    """Give a figure of the same shape the numbers of another panel; its zoom stays."""
    columns = panel_columns(panel)
    for source in plot.select({"type": ColumnDataSource}):
        source.data = columns[source.name]
    for title in plot.select({"type": Title, "name": _NOTE}):
        title.text = panel.note


def panel_columns(panel: AnyPanel) -> dict[str, dict[str, Any]]:
    """Return the columns of all that a panel draws, by the name of its source."""
    if isinstance(panel, BoxPanel):
        return _box_columns(panel.boxes)
    return {
        f"{_SERIES}{number}": _series_columns(series, log_y=panel.log_y)
        for number, series in enumerate(panel.series)
    }


def _dressed(plot: figure, panel: AnyPanel) -> figure:
    plot.yaxis.axis_label = panel.y_label
    plot.add_layout(Title(text=panel.note, name=_NOTE, **_NOTE_STYLE), "above")
    plot.toolbar.logo = None
    plot.toolbar.autohide = True
    for axis in plot.axis:
        axis.axis_label_text_font_size = _FONT_SIZE
        axis.axis_label_text_font_style = "normal"
        axis.minor_tick_line_color = None
    plot.grid.grid_line_alpha = 0.4
    return plot


def _draw_curves(panel: FigurePanel, sources: Mapping[str, ColumnDataSource]) -> figure:
    plot = figure(
        width=WIDTH,
        height=HEIGHT,
        x_axis_label=panel.x_label,
        x_axis_type="log" if panel.log_x else "linear",
        y_axis_type="log" if panel.log_y else "linear",
        tools="box_zoom,pan,wheel_zoom,reset,save",
    )
    entries = []
    for number, series in enumerate(panel.series):
        entries.append((series.label, _draw_series(plot, series, sources[f"{_SERIES}{number}"])))
    legend = Legend(
        items=entries,
        ncols=2,
        click_policy="hide",
        label_text_font_size="10px",
        border_line_color=None,
        padding=2,
        spacing=10,
        margin=0,
        location="bottom_left",
        glyph_height=14,
        label_height=14,
    )
    plot.add_layout(legend, "below")
    return _dressed(plot, panel)


def _series_columns(series: Series, *, log_y: bool) -> dict[str, Any]:
    values = {"x": series.x, "y": series.y, "low": series.low, "high": series.high}
    if log_y:
        # A logarithm has no place for zero; the point is left out, not moved.
        for name in ("y", "low", "high"):
            values[name] = np.where(values[name] > 0.0, values[name], np.nan)
    return values


def _draw_series(plot: figure, series: Series, source: ColumnDataSource) -> list[Any]:
    shade, dash = colour(series.role), DASHES[series.variant % len(DASHES)]
    if series.kind == "crosses":
        return [plot.scatter("x", "y", source=source, marker="x", size=9, color=shade)]
    if series.kind == "stems":
        stems = plot.segment("x", "low", "x", "y", source=source, color=shade, alpha=0.5)
        heads = plot.scatter("x", "y", source=source, size=7, line_color=shade, fill_color=None)
        return [stems, heads]
    if series.kind == "dashed":
        drawn = [plot.line("x", "y", source=source, color=shade, line_dash="dashed")]
        if np.any(np.isfinite(series.low)):
            drawn.append(plot.varea("x", "low", "high", source=source, color=shade, alpha=0.12))
        return drawn
    line = plot.line(
        "x", "y", source=source, color=shade, line_dash=dash, line_width=width(series.role)
    )
    if series.kind == "line":
        return [line]
    bars = plot.segment("x", "low", "x", "high", source=source, color=shade, alpha=0.7)
    heads = plot.scatter("x", "y", source=source, marker=marker(series.role), size=6, color=shade)
    tips = [("", series.label), ("x", "@x"), ("value", "@y"), ("interval", "@low to @high")]
    plot.add_tools(HoverTool(renderers=[heads], tooltips=tips))
    return [line, bars, heads]


def _draw_boxes(panel: BoxPanel, sources: Mapping[str, ColumnDataSource]) -> figure:
    plot = figure(
        width=WIDTH,
        height=HEIGHT,
        x_range=[box.role for box in panel.boxes],
        y_axis_type="log" if panel.log_y else "linear",
        tools="box_zoom,pan,wheel_zoom,reset,save",
    )
    plot.segment("role", "foot", "role", "top", color="shade", source=sources[_WHISKERS])
    plot.vbar(
        x="role",
        width=0.6,
        bottom="foot",
        top="top",
        fill_color="shade",
        fill_alpha=0.25,
        line_color="shade",
        line_width=1.5,
        source=sources[_HALVES],
    )
    plot.scatter("role", "y", marker="cross", color="shade", size=6, source=sources[_OUTLIERS])
    plot.text(
        x="role",
        y="y",
        text="text",
        y_offset=-4,
        text_align="center",
        text_font_size="10px",
        source=sources[_COUNTS],
    )
    plot.xaxis.major_label_orientation = 0.5
    return _dressed(plot, panel)


def _box_columns(boxes: Sequence[Box]) -> dict[str, dict[str, Any]]:
    whiskers = [
        (box.role, foot, top)
        for box in boxes
        for foot, top in ((box.low, box.first), (box.third, box.high))
    ]
    # Two halves: their common edge is the median.
    halves = [
        (box.role, foot, top)
        for box in boxes
        for foot, top in ((box.first, box.middle), (box.middle, box.third))
    ]
    outliers = [(box.role, value) for box in boxes for value in box.outliers]
    counted = [box for box in boxes if box.outliers]
    return {
        _WHISKERS: _shaded(whiskers, "foot", "top"),
        _HALVES: _shaded(halves, "foot", "top"),
        _OUTLIERS: _shaded(outliers, "y"),
        _COUNTS: {
            "role": [box.role for box in counted],
            "y": [max(box.outliers) for box in counted],
            "text": [str(len(box.outliers)) for box in counted],
        },
    }


def _shaded(items: Sequence[tuple[Any, ...]], *names: str) -> dict[str, Any]:
    """Return roles, their colours and the named values as columns."""
    columns = {name: [item[1 + place] for item in items] for place, name in enumerate(names)}
    roles = [item[0] for item in items]
    return {"role": roles, "shade": [colour(role) for role in roles], **columns}
