"""Fast time and delay of the selected ramp: the same five signals on two axes."""

from typing import Any

import numpy as np
from bokeh.models import ColumnDataSource, CrosshairTool, HoverTool, Span
from bokeh.plotting import figure

from vsep_app.model.markers import Markers
from vsep_app.model.picture import Picture, Signals
from vsep_app.views.style import (
    COLOURS,
    Axis,
    key_html,
    legend_of,
    lighten,
    mark_looks,
    plain_figure,
    put,
    short,
    tell_of_components,
)

_LINES = (
    ("received", "received", "received", "line", {"line_width": 2.2, "line_alpha": 0.65}),
    ("interference", "interference", "interference", "line", {"line_width": 1.6}),
    ("cleaned", "cleaned", "cleaned", "line", {"line_width": 1.4}),
    ("true_object", "true", "true objects", "dashed", {"line_width": 3.2, "line_dash": [7, 4]}),
    ("object_estimate", "object", "estimate", "line", {"line_width": 1.6}),
)


def _columns(signals: Signals) -> dict[str, Any]:
    columns = {name: getattr(signals, name).astype(np.float32) for name, *_ in _LINES}
    return {"axis": signals.axis.astype(np.float32), **columns}


def _empty_lines() -> ColumnDataSource:
    """Return a source of one undefined point; a legend draws no sample of an empty line."""
    return ColumnDataSource({name: [np.nan] for name in ("axis", *(c for c, *_ in _LINES))})


def _draw(
    plot: figure, source: ColumnDataSource, place: tuple[str, str]
) -> list[tuple[str, list[Any]]]:
    """Draw all signals; the pointer shows the place, under a name and in a format, and levels."""
    entries = []
    for column, role, label, _, look in _LINES:
        line = plot.line("axis", column, source=source, color=COLOURS[role], **look)
        entries.append((label, [line]))
    received = entries[0][1]
    levels = [(name, f"@{name}{{0.0}}") for name in ("received", "cleaned")]
    plot.add_tools(HoverTool(renderers=received, mode="vline", tooltips=[place, *levels]))
    return entries


def _keys(entries: list[tuple[str, str, str]]) -> tuple[str, str]:
    """Return the key of a view, and that where the truth is hardly ever known."""
    return key_html(entries), key_html([entry for entry in entries if entry[0] != "true"])


class FastTimeView:
    """Received, true, estimated, interference and cleaned signal over fast time.

    The figure has its own legend, or `key` is to be shown beside it.
    """

    key, untrue_key = _keys([(role, label, sample) for _, role, label, sample, _ in _LINES])
    #: Of a recording with simulated bursts: it is known without them, its objects are not.
    recorded_key = key.replace("true objects", "without bursts")

    def __init__(self, *, legend: bool = False) -> None:
        self._x, self._y = Axis(), Axis()
        labels = "fast time [µs]", "level [dB]"
        self.figure = plain_figure("fast-time", "Fast time", labels, (self._x, self._y))
        self.source = _empty_lines()
        entries = _draw(self.figure, self.source, ("time", "$x{0.00} µs"))
        if legend:
            legend_of(self.figure, entries)
        lighten(self.figure)

    def update(self, picture: Picture) -> None:
        """Draw another picture."""
        static_picture, real = picture.static_picture, picture.fast_time_mode == "real"
        times = static_picture.times_us
        self._x.set((0.0, float(times[-1] + times[1])))
        self._y.set(static_picture.real_limits if real else static_picture.level_limits_db)
        self.figure.yaxis.axis_label = "real part [arb. unit]" if real else "level [dB]"
        self.figure.title.text = f"Fast time, ramp {picture.ramp}"
        self.source.data = _columns(picture.fast_time)


def mark_peaks(
    plot: figure,
    source: ColumnDataSource,
    label: str,
    *,
    colour: str,
    marker: str,
    size: int = 9,
) -> Any:
    """Mark components at range and level, with what the pointer shows; return the marks."""
    look = {"marker": marker, "size": size, "fill_color": None}
    marks = plot.scatter("range", "level", source=source, line_color=colour, line_width=2, **look)
    tell_of_components(plot, marks, label, "@range{0.00} m")
    return marks


def _stem_columns(marks: Markers, floor: float) -> dict[str, Any]:
    return {
        "range": short(marks.ranges_m),
        "level": short(marks.levels_db),
        "floor": [floor] * len(marks.ranges_m),
        "snr": short(marks.snr_db),
        "opacity": short(marks.opacity),
    }


class DelayView:
    """Delay spectra in metres, components as stems.

    Range axis and crosshair, the line at the pointer, are shared with the maps. The figure has its
    own legend, or `key` is to be shown beside it.
    """

    key = key_html(
        [
            ("true", "true object", "cross"),
            ("cleaned", "found", "circle"),
            ("interference", "false", "square"),
        ]
    )
    untrue_key = key_html([("object", "estimate", "circle")])

    def __init__(self, x_axis: Axis, crosshair: Span, *, legend: bool = False) -> None:
        self._x, self._y = x_axis, Axis()
        labels = "range [m]", "level [dB]"
        self.figure = plain_figure("delay", "Delay spectrum", labels, (self._x, self._y))
        self._source = _empty_lines()
        entries = _draw(self.figure, self._source, ("range", "$x{0.0} m"))
        self._stems = {
            name: ColumnDataSource(
                {
                    column: []
                    for column in ("range", "level", "floor", "snr", "opacity", "shape", "colour")
                }
            )
            for name in ("true_objects", "objects", "added", "pruned")
        }
        entries += [
            ("true", self._stem("true_objects", "true", "x", 9)),
            ("estimate", self._stem("objects", "object", "shape", 8)),
        ]
        for name, role in (("added", "object"), ("pruned", "received")):
            line = {"line_color": COLOURS[role], "line_width": 3, "line_alpha": "opacity"}
            ring = {"marker": "circle", "size": 20, "fill_color": None}
            self.figure.scatter("range", "level", source=self._stems[name], **ring, **line)
        if legend:
            legend_of(self.figure, entries[len(_LINES) :])
        self.figure.add_tools(CrosshairTool(overlay=crosshair))
        lighten(self.figure)

    def _stem(self, name: str, role: str, marker: str, size: int) -> list[Any]:
        source = self._stems[name]
        colour = "colour" if name == "objects" else COLOURS[role]
        stem = self.figure.segment(
            "range", "floor", "range", "level", source=source, color=colour, line_alpha=0.55
        )
        label = {"true_objects": "true object", "objects": "estimate"}[name]
        head = mark_peaks(self.figure, source, label, colour=colour, marker=marker, size=size)
        return [head, stem]

    def update(self, picture: Picture) -> None:
        """Draw another picture."""
        static_picture = picture.static_picture
        places = picture.objects.ranges_m
        self._x.hold(static_picture.shown_ranges_m, places, run_number=picture.run_number)
        self._y.set(static_picture.spectrum_limits_db)
        self.figure.title.text = f"Delay spectrum, ramp {picture.ramp}"
        put(self._source, _columns(picture.delay))
        for name, source in self._stems.items():
            marks, floor = getattr(picture, name), static_picture.spectrum_limits_db[0]
            found = None if picture.score is None else picture.score.found
            look = mark_looks(len(marks.ranges_m), found if name == "objects" else None)
            put(source, {**_stem_columns(marks, floor), **look})
