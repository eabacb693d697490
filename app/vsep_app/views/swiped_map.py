"""Range-Doppler map with a line to be moved: before the bursts are cancelled, and after."""

from typing import Any, Protocol

from bokeh.events import DoubleTap, Tap
from bokeh.models import CustomJS, Span
from bokeh.plotting import figure

from vsep_app.assets import path
from vsep_app.model.markers import Markers, no_marks
from vsep_app.model.picture import Picture
from vsep_app.views.pointer import START, Drag, PointerDrag
from vsep_app.views.range_doppler import (
    RangeDopplerView,
    add_colour_bar,
    empty_image,
    map_figure,
)
from vsep_app.views.style import Axis

_SWIPED = "Range-Doppler: left of the line as received, right of it {}"
_RECEIVED = "Range-Doppler, received"
_END_SHARE = 0.02  # of the axis
_USUAL_PX = 400.0  # that an axis is long, more or less


class MapObjects(Protocol):
    """What is done to the true objects of a map."""

    def take(self, drag: Drag, true_objects: Markers) -> None:
        """Follow the pointer."""

    def choose(self, drag: Drag, true_objects: Markers) -> None:
        """Take note of the object that is clicked."""

    def add(self, x: float, y: float, true_objects: Markers) -> None:
        """Add an object."""


class SwipedMap(RangeDopplerView):
    """One map; left of a line it is the frame as received, right of it bursts are cancelled.

    The line is moved by the pointer, or by `swipe` from one end to the other.

    Parameters
    ----------
    x_axis, crosshair
        As of `RangeDopplerView`.
    objects : MapObjects or None
        Hears what is done to the true objects.
    """

    def __init__(self, x_axis: Axis, crosshair: Span, objects: "MapObjects | None" = None) -> None:
        super().__init__(x_axis, crosshair)
        self._objects, self._true = objects, no_marks()
        if objects is not None:
            self.pointer = PointerDrag(self.after, lambda drag: objects.take(drag, self._true))
            # A double click adds an object here; the reset tool shows all.
            self.after.js_event_callbacks = {
                name: answers
                for name, answers in self.after.js_event_callbacks.items()
                if name != DoubleTap.event_name
            }
            self.after.on_event(Tap, self._tapped)
            self.after.on_event(DoubleTap, self._tapped_twice)

    def freeze(self, wanted: bool) -> None:
        """Let both axes stay as they are, or follow what is drawn again."""
        self._x.is_frozen = self._y.is_frozen = wanted

    def _tapped(self, event: Tap) -> None:
        if self._objects is not None and event.x is not None and event.y is not None:
            x, y = self._x.range, self._y.range
            pixel = (abs(each.end - each.start) / _USUAL_PX for each in (x, y))
            place = Drag(START, float(event.x), float(event.y), *pixel)
            self._objects.choose(place, self._true)

    def _tapped_twice(self, event: DoubleTap) -> None:
        if self._objects is not None and event.x is not None and event.y is not None:
            self._objects.add(float(event.x), float(event.y), self._true)

    def _make(self) -> tuple[figure, ...]:
        self._shown = empty_image()
        self._shown.syncable = False  # it is put together in the browser
        self._line = Span(
            dimension="height",
            editable=True,
            visible=False,
            line_color="white",
            line_width=4,
            line_alpha=0.9,
            hover_line_color="white",
            hover_line_alpha=1.0,
        )
        self.after = map_figure(
            self._shown,
            title=_RECEIVED,
            y_label="radial velocity [m/s]",
            axes=(self._x, self._y),
            name="after",
            scale=self._scale,
        )
        self.after.add_layout(self._line)
        add_colour_bar(self.after, self._scale)
        code = path("page/swipe.js").read_text(encoding="utf-8")
        parts: dict[str, Any] = {**self._images, "shown": self._shown, "line": self._line}
        compose = CustomJS(args=parts, code=code)
        for source in self._images.values():
            source.js_on_change("data", compose)
        for name in ("location", "visible"):
            self._line.js_on_change(name, compose)
        return (self.after,)

    def swipe(self) -> None:
        """Move the line to the left end, or from there to the right one."""
        start, end = self._x.range.start, self._x.range.end
        is_left = self._line.location < start + _END_SHARE * (end - start)
        self._line.location = end if is_left else start

    def update(self, picture: Picture, *, with_image: bool = True) -> None:
        """Draw another picture; as long as nothing is cancelled, all of it is as received."""
        self._true = picture.true_objects
        if self._line.location is None:
            self._line.location = sum(picture.static_picture.shown_ranges_m) / 2.0
        super().update(picture, with_image=with_image)
        self._line.visible = picture.is_changed

    def _say(self, picture: Picture) -> None:
        done = picture.title_after.removeprefix("Range-Doppler, ")
        self.after.title.text = _SWIPED.format(done) if picture.is_changed else _RECEIVED
