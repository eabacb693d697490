"""Range-Doppler map before and after cancellation, with true and estimated components."""

from typing import Any

import numpy as np
from bokeh.models import (
    BasicTicker,
    ColorBar,
    ColumnDataSource,
    CrosshairTool,
    CustomJSHover,
    HoverTool,
    Label,
    LinearColorMapper,
    Span,
)
from bokeh.plotting import figure

from vsep_app.model.markers import GroupMarks, Markers
from vsep_app.model.picture import NOTHING_CANCELLED, Picture
from vsep_app.model.score import Score
from vsep_app.model.text import resolution_cells
from vsep_app.teaching.staging import Zoom
from vsep_app.views.style import (
    COLOURS,
    LABEL_SIZE,
    MAP_PALETTE,
    Axis,
    lighten,
    mark_looks,
    plain_figure,
    put,
    short,
    tell_of_components,
)

MIN_MARK, MAX_MARK = 6.0, 18.0
MAX_MARK_DB = 50.0
_PLACE = ("range", "velocity")
_LEVEL = "return `${(scale.low + value / 255 * (scale.high - scale.low)).toFixed(0)} dB`"
_COLUMNS = ("range", "velocity", "snr", "size", "opacity", "shape", "colour", "width", "height")
_MISSES = ("range", "velocity", "nearest_range", "nearest_velocity")
_GROUPS = ("range", "velocity", "extent", "snr", "width", "height", "lines")
_POINTER: dict[str, Any] = {
    "x_offset": 9,
    "y_offset": 9,
    "text_color": "black",
    "text_font_size": "12px",
    "text_font_style": "bold",
    "background_fill_color": "white",
    "background_fill_alpha": 0.85,
    "padding": 3,
}


def mark_sizes(snr_db: "np.ndarray[Any, np.dtype[np.float64]]") -> Any:
    """Marker diameter in pixels that grows with the component SNR."""
    share = np.clip(np.nan_to_num(snr_db) / MAX_MARK_DB, 0.0, 1.0)
    return MIN_MARK + (MAX_MARK - MIN_MARK) * share


def mark_columns(
    marks: Markers,
    *,
    found: "np.ndarray[Any, np.dtype[np.bool_]] | None" = None,
    cell: tuple[float, float] = (0.0, 0.0),
) -> dict[str, Any]:
    """Return the columns of a source of marks.

    `found` says which of them have a true object, None where that is not known; `cell` is the
    resolution cell, in m and m/s, that each of them has around it.
    """
    number = len(marks.ranges_m)
    width, height = cell
    return {
        **mark_looks(number, found),
        # An estimate may be off by a whole cell on either side.
        "width": [2.0 * width] * number,
        "height": [2.0 * abs(height)] * number,
        "range": short(marks.ranges_m),
        "velocity": short(marks.velocities_mps),
        "snr": short(marks.snr_db),
        "size": short(mark_sizes(marks.snr_db)),
        "opacity": short(marks.opacity),
    }


def empty_image() -> ColumnDataSource:
    """Return the source of a map that shows nothing yet."""
    return ColumnDataSource(
        {"image": [np.zeros((2, 2), np.uint8)], "x": [0], "y": [0], "dw": [1], "dh": [1]}
    )


def empty_marks() -> ColumnDataSource:
    """Return the source of marks that are not there yet."""
    return ColumnDataSource({column: [] for column in _COLUMNS})


def miss_columns(score: Score | None, true_objects: Markers, objects: Markers) -> dict[str, Any]:
    """Return the columns of a source of misses, each with its nearest estimate, if any."""
    if score is None or not objects.ranges_m.size:
        return {column: [] for column in _MISSES}
    columns = {
        "range": true_objects.ranges_m[score.missed],
        "velocity": true_objects.velocities_mps[score.missed],
    }
    columns["nearest_range"] = objects.ranges_m[score.nearest]
    columns["nearest_velocity"] = objects.velocities_mps[score.nearest]
    return {name: short(column) for name, column in columns.items()}


def empty_misses() -> ColumnDataSource:
    """Return the source of misses that are not there yet."""
    return ColumnDataSource({column: [] for column in _MISSES})


def map_figure(
    source: ColumnDataSource,
    *,
    title: str,
    y_label: str,
    axes: tuple[Axis, Axis],
    name: str,
    scale: LinearColorMapper,
) -> figure:
    """Return a figure of a range-Doppler map; the ends of the scale are those of its levels."""
    plot = plain_figure(f"range-doppler-{name}", title, ("range [m]", y_label), axes)
    place = {each: each for each in ("image", "x", "y", "dw", "dh")}
    colours = LinearColorMapper(palette=MAP_PALETTE, low=0, high=255)
    image = plot.image(**place, source=source, color_mapper=colours)
    level = CustomJSHover(args={"scale": scale}, code=_LEVEL)
    place_tips = [("range", "$x{0.0} m"), ("velocity", "$y{+0.0} m/s"), ("level", "@image{custom}")]
    plot.add_tools(HoverTool(renderers=[image], tooltips=place_tips, formatters={"@image": level}))
    plot.grid.visible = False
    return plot


def add_colour_bar(plot: figure, scale: LinearColorMapper) -> None:
    """Put the levels of a map beside it."""
    plot.add_layout(
        ColorBar(
            color_mapper=scale,
            width=8,
            padding=2,
            title="dB",
            title_text_font_size=LABEL_SIZE,
            major_label_text_font_size=LABEL_SIZE,
            ticker=BasicTicker(desired_num_ticks=5),
            background_fill_color=None,
            syncable=False,
        ),
        "right",
    )


def mark_objects(
    plot: figure,
    objects: ColumnDataSource,
    true_objects: ColumnDataSource,
    misses: ColumnDataSource,
) -> None:
    """Ring the estimates on a map and cross the true objects, each in its resolution cell.

    A miss has a dashed ring, and a line to the estimate nearest to it.
    """
    cell = {"line_color": "white", "line_alpha": 0.45, "fill_color": None}
    plot.ellipse(*_PLACE, width="width", height="height", source=true_objects, **cell)
    dashed = {"line_color": "white", "line_dash": [4, 3], "line_width": 1.6}
    ends = (*_PLACE, "nearest_range", "nearest_velocity")
    plot.segment(*ends, source=misses, line_alpha=0.6, **dashed)
    plot.scatter(*_PLACE, source=misses, marker="circle", size=22, fill_color=None, **dashed)
    for colour, width in (("black", 4.5), ("white", 3.0), ("colour", 1.8)):
        line = {"line_color": colour, "line_width": width}
        estimates = plot.scatter(
            *_PLACE, source=objects, marker="shape", size="size", fill_color=None, **line
        )
    for colour, width in (("black", 3.5), (COLOURS["true"], 1.8)):
        line = {"line_color": colour, "line_width": width}
        truth = plot.scatter(*_PLACE, source=true_objects, marker="cross", size=11, **line)
    for label, renderer in (("estimate", estimates), ("true object", truth)):
        tell_of_components(plot, renderer, label, "@range{0.00} m, @velocity{+0.00} m/s")


def group_columns(groups: GroupMarks) -> dict[str, Any]:
    """Return the columns of a source of extended objects; each ellipse is larger than its lines."""
    return {
        "range": short(groups.ranges_m),
        "velocity": short(groups.velocities_mps),
        "extent": short(groups.extents_m),
        "snr": short(groups.snr_db),
        "width": short(1.2 * groups.extents_m + 0.4),
        "height": short(groups.spreads_mps + 1.0),
        "lines": list(groups.lines),
    }


def mark_groups(plot: figure, groups: ColumnDataSource) -> None:
    """Draw an ellipse around each extended object; the pointer tells its lines."""
    look = {"line_color": "white", "line_width": 2.0, "line_dash": "dotdash", "fill_alpha": 0.0}
    shape = plot.ellipse(*_PLACE, width="width", height="height", source=groups, **look)
    tips = [
        ("extended object", "@range{0.00} m, @velocity{+0.00} m/s"),
        ("extent", "@extent{0.00} m"),
        ("strongest line", "@snr{0.0} dB"),
        ("lines", "@lines"),
    ]
    plot.add_tools(HoverTool(renderers=[shape], tooltips=tips))


class RangeDopplerView:
    """Two maps with common axes; the range axis is that of the delay view."""

    def __init__(self, x_axis: Axis, crosshair: Span) -> None:
        self._x, self._y = x_axis, Axis()
        self._images = {name: empty_image() for name in ("before", "after")}
        self._marks = {
            name: empty_marks() for name in ("true_objects", "objects", "added", "pruned")
        }
        self._misses = empty_misses()
        self._groups = ColumnDataSource({column: [] for column in _GROUPS})
        self._scale = LinearColorMapper(palette=MAP_PALETTE, low=0.0, high=1.0)
        self._crosshair = crosshair
        self._drawn_before: Any = None
        self.figures = self._make()
        self._pointers = []
        for plot in self.figures:
            self._mark(plot)
            self._mark_changes(plot)
            pointer = Label(x=0.0, y=0.0, text="", visible=False, **_POINTER)
            self._pointers.append(pointer)
            plot.add_layout(pointer)
            lighten(plot)

    def _make(self) -> tuple[figure, ...]:
        """Make the figures, without marks."""
        self.before = self._figure("before", "Range-Doppler, received", "radial velocity [m/s]")
        self.after = self._figure("after", NOTHING_CANCELLED, "")
        add_colour_bar(self.after, self._scale)
        return self.before, self.after

    def _say(self, picture: Picture) -> None:
        """Say what is shown."""
        self.after.title.text = picture.title_after

    def zoom(self, zoom: Zoom | None) -> None:
        """Show a part of the maps, with an arrow at a place of it; None shows all."""
        for axis, ends in ((self._x, zoom and zoom.range), (self._y, zoom and zoom.velocity)):
            axis.zoom(ends or None)
        place = zoom.arrow if zoom is not None else None
        for label in self._pointers:
            label.visible = place is not None
            if zoom is not None and place is not None:
                label.update(x=place[0], y=place[1], text=f"\u2199 {zoom.label}")

    def companion(self, source: ColumnDataSource, *, name: str, title: str) -> figure:
        """Return a map of another frame with the same axes and marks."""
        plot = map_figure(
            source, title=title, y_label="", axes=(self._x, self._y), name=name, scale=self._scale
        )
        add_colour_bar(plot, self._scale)
        self._mark(plot)
        return plot

    def _mark(self, plot: figure) -> None:
        mark_groups(plot, self._groups)
        mark_objects(plot, self._marks["objects"], self._marks["true_objects"], self._misses)
        plot.add_tools(CrosshairTool(overlay=self._crosshair))

    def _figure(self, name: str, title: str, y_label: str) -> figure:
        axes, scale = (self._x, self._y), self._scale
        return map_figure(
            self._images[name], title=title, y_label=y_label, axes=axes, name=name, scale=scale
        )

    def _mark_changes(self, plot: figure) -> None:
        marks = self._marks
        line = {"line_color": "white", "line_alpha": "opacity"}
        ring = {"marker": "circle", "size": 26, "fill_color": None, "line_width": 2.5}
        plot.scatter(*_PLACE, source=marks["added"], **ring, **line)
        cross = {"marker": "x", "size": 16, "line_width": 2.5}
        plot.scatter(*_PLACE, source=marks["pruned"], **cross, **line)

    def update(self, picture: Picture, *, with_image: bool = True) -> None:
        """Draw another picture; the map before cancellation is sent once a scene."""
        static_picture = picture.static_picture
        box = image_box(static_picture.map_ranges_m, static_picture.map_velocities_mps)
        if self._drawn_before is not static_picture.map_before:
            self._drawn_before = static_picture.map_before
            low, high = static_picture.map_limits_db
            self._scale.update(low=low, high=high)
            self._images["before"].data = {"image": [static_picture.map_before], **box}
        full = (box["y"][0], box["y"][0] + box["dh"][0])
        limits = static_picture.shown_velocities_mps or full
        places = picture.objects.velocities_mps
        self._y.hold(limits, places, run_number=picture.run_number)
        if not picture.is_changed:
            # Dark until there is something to show: it would be a copy of the first map.
            put(self._images["after"], {"image": [np.zeros_like(picture.map_after)], **box})
        elif with_image:
            self._images["after"].data = {"image": [picture.map_after], **box}
        self._say(picture)
        found = None if picture.score is None else picture.score.found
        for name, source in self._marks.items():
            seen = found if name == "objects" else None
            cell = resolution_cells(static_picture.radar) if name == "true_objects" else (0.0, 0.0)
            put(source, mark_columns(getattr(picture, name), found=seen, cell=cell))
        put(self._groups, group_columns(picture.groups))
        put(self._misses, miss_columns(picture.score, picture.true_objects, picture.objects))


def image_box(ranges_m: Any, velocities_mps: Any) -> dict[str, list[float]]:
    """Place of an image whose pixels are centred on the axes' values."""
    box: dict[str, list[float]] = {}
    for start, size, values in (("x", "dw", ranges_m), ("y", "dh", velocities_mps)):
        spacing = float(values[1] - values[0]) if len(values) > 1 else 1.0
        box[start] = [float(values[0]) - spacing / 2.0]
        box[size] = [spacing * len(values)]
    return box
