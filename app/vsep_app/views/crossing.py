"""Frequency over time: the victim's chirps with their band, and the chirps that cross it."""

from collections.abc import Callable
from typing import Any

import numpy as np
from bokeh.events import Tap
from bokeh.models import BoxAnnotation, ColumnDataSource, HoverTool, LinearColorMapper

from vsep_app.model.crossing import Courses, Crossing, CrossingPlane
from vsep_app.model.picture import Picture
from vsep_app.views.pointer import Drag, PointerDrag
from vsep_app.views.style import (
    COLOURS,
    MAP_PALETTE,
    Axis,
    key_html,
    lighten,
    mark_looks,
    plain_figure,
    put,
    short,
)

_ENDS = ("x0", "y0", "x1", "y1")
_SEGMENT = dict(zip(_ENDS, _ENDS, strict=True))
_HANDLE = ("handle_x", "handle_y")


class CrossingView:
    """All ramps of a frame with the chirps that cross them; a click selects a ramp.

    Parameters
    ----------
    select : callable
        Called with a ramp that is clicked.
    drag : callable
        Called with every `Drag` and what is drawn, ten times a second or more.
    """

    key = key_html(
        [
            ("object", "own chirps and their band", "line"),
            ("interference", "other radar", "line"),
            ("cleaned", "burst found", "circle"),
        ]
    )

    def __init__(
        self, select: Callable[[int], None], drag: Callable[[Drag, Crossing], None]
    ) -> None:
        self._select, self._drag = select, drag
        self._x, self._y = Axis(), Axis()
        self._crossing: Crossing | None = None
        self.figure = plain_figure("crossing", "Chirps", ("", "frequency"), (self._x, self._y))
        self.figure.grid.visible = False
        self._bands = ColumnDataSource({"x": [], "y": []})
        self._sweeps, self._lit = _segments(), _segments()
        self._true = _segments("ramp", "slope", *_HANDLE)
        self._found = _segments("ramp", "slope", "x", "y", "shape", "colour")
        self._image = ColumnDataSource({name: [] for name in ("image", "x", "y", "dw", "dh")})
        self._draw()
        lighten(self.figure)
        self.pointer = PointerDrag(self.figure, self._dragged)
        self.figure.on_event(Tap, self._tapped)

    def _draw(self) -> None:
        plot, colour = self.figure, COLOURS
        place = {each: each for each in ("image", "x", "y", "dw", "dh")}
        scale = LinearColorMapper(palette=MAP_PALETTE, low=0, high=255)
        plot.image(**place, source=self._image, color_mapper=scale)
        own = {"source": self._sweeps, "line_color": colour["object"]}
        # One patch with gaps: BokehJS 3.10 looks up patches that a shorter frame has no more.
        plot.patch(
            "x", "y", source=self._bands, fill_color=colour["object"], fill_alpha=0.16,
            line_color=None,
        )  # fmt: skip
        plot.segment(**_SEGMENT, line_width=1.6, **own)
        other = {"line_color": colour["interference"]}
        chirps = plot.segment(
            **_SEGMENT, source=self._true, line_width=1.6, line_alpha=0.75, **other
        )
        plot.segment(**_SEGMENT, source=self._lit, line_width=4.5, **other)
        self._handles = plot.scatter(
            *_HANDLE, source=self._true, marker="square", size=8, fill_color=colour["interference"],
            line_color="white",
        )  # fmt: skip
        look = {"source": self._found, "line_color": "colour"}
        plot.segment(**_SEGMENT, line_width=1.8, line_dash=[5, 3], **look)
        rings = plot.scatter("x", "y", marker="shape", size=17, fill_color=None, line_width=2.4,
                             **look)  # fmt: skip
        for label, marks in (("other radar", chirps), ("burst found", rings)):
            tips = [(label, "ramp @ramp"), ("slope difference", "@slope{+0.000} MHz/µs")]
            plot.add_tools(HoverTool(renderers=[marks], tooltips=tips))
        self._selected = BoxAnnotation(
            left=0.0, right=1.0, fill_alpha=0.0, line_color=COLOURS["object"], line_width=2.0
        )
        plot.add_layout(self._selected)

    def _dragged(self, drag: Drag) -> None:
        if self._crossing is not None:
            self._drag(drag, self._crossing)

    def _tapped(self, event: Tap) -> None:
        crossing = self._crossing
        if event.x is not None and crossing is not None and crossing.plane.ramp is None:
            last = crossing.plane.num_ramps - 1
            self._select(min(max(int(np.floor(float(event.x))), 0), last))

    def update(self, picture: Picture, *, can_drag: bool) -> None:
        """Draw another picture; what can be dragged has handles."""
        crossing, plane = picture.crossing, picture.crossing.plane
        if self._crossing is None or plane != self._crossing.plane:
            self._show_plane(plane)
        self._crossing = crossing
        _put_courses(self._true, plane, crossing.true, plane.reach_mhz, handles=True)
        _put_courses(self._lit, plane, crossing.true, plane.band_mhz)
        self._put_found(crossing)
        self._handles.visible = can_drag
        ramp = picture.ramp
        self._selected.update(left=ramp, right=ramp + 1.0, visible=plane.ramp is None)
        self.figure.title.text = _title(plane)
        if crossing.image is not None:
            height = 2.0 * plane.nyquist_mhz
            box = {"x": [0.0], "y": [-plane.nyquist_mhz], "dw": [plane.ramp_us], "dh": [height]}
            put(self._image, {"image": [crossing.image], **box})
        elif self._image.data["image"]:
            self._image.data = {name: [] for name in self._image.data}

    def _show_plane(self, plane: CrossingPlane) -> None:
        """Draw the victim's own chirps and their bands."""
        across, upwards = plane.limits
        self._x.set(across)
        self._y.set(upwards)
        ramps = np.arange(1 if plane.ramp is not None else plane.num_ramps)
        zero, end = np.zeros(len(ramps)), np.full(len(ramps), plane.ramp_us)
        band = np.full(len(ramps), plane.band_mhz)
        corners = [
            plane.place(ramps, times, levels)
            for times, levels in ((zero, -band), (end, -band), (end, band), (zero, band))
        ]
        gap = np.full(len(ramps), np.nan)
        outlines = np.array([*corners, (gap, gap)])  # (corner, axis, ramp)
        x, y = outlines.transpose(1, 2, 0).reshape(2, -1)
        self._bands.data = {"x": short(x), "y": short(y)}
        ends = [*plane.place(ramps, zero, zero), *plane.place(ramps, end, zero)]
        self._sweeps.data = dict(zip(_ENDS, map(short, ends), strict=True))
        alone = plane.ramp is not None
        self.figure.xaxis.axis_label = "fast time [µs]" if alone else ""
        self.figure.yaxis.axis_label = "frequency [MHz]" if alone else "frequency"
        # Of all ramps the rise is drawn shortened, so that numbers would be wrong.
        self.figure.yaxis.major_label_text_alpha = 1.0 if alone else 0.0

    def _put_found(self, crossing: Crossing) -> None:
        plane, found = crossing.plane, crossing.found
        times = found.crossings_us(plane.ramp_us)
        x, y = plane.place(found.ramps, times, np.zeros(len(times)))
        looks = mark_looks(len(times), crossing.is_true)
        columns = {"x": short(x), "y": short(y), **looks}
        _put_courses(self._found, plane, found, plane.band_mhz, more=columns)


def _segments(*more: str) -> ColumnDataSource:
    return ColumnDataSource({name: [] for name in (*_ENDS, *more)})


def _put_courses(
    source: ColumnDataSource,
    plane: CrossingPlane,
    courses: Courses,
    limit_mhz: float,
    *,
    handles: bool = False,
    more: dict[str, Any] | None = None,
) -> None:
    """Show the part of courses that lies within +-limit."""
    first, last = courses.within(limit_mhz, plane.ramp_us)
    last = np.maximum(first, last)
    finite = np.isfinite(first)
    first, last = np.where(finite, first, 0.0), np.where(finite, last, 0.0)
    begin = plane.place(courses.ramps, first, courses.at(first))
    end = plane.place(courses.ramps, last, courses.at(last))
    columns = dict(zip(_ENDS, map(short, (*begin, *end)), strict=True))
    if handles:
        times = courses.handles_us(limit_mhz, plane.ramp_us)
        place = plane.place(courses.ramps, times, courses.at(times))
        columns |= dict(zip(_HANDLE, map(short, place), strict=True))
    if handles or more is not None:
        columns |= {"ramp": short(courses.ramps), "slope": short(courses.slopes)}
    put(source, {**columns, **(more or {})})


def _title(plane: CrossingPlane) -> str:
    what = "Chirps over all ramps" if plane.ramp is None else f"Spectrogram of ramp {plane.ramp}"
    return f"{what}, band ±{plane.band_mhz:.3g} MHz"
