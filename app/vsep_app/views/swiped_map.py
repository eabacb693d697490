"""Range-Doppler map with a line to be moved: before the bursts are cancelled, and after."""

from typing import Any

from bokeh.models import CustomJS, Span
from bokeh.plotting import figure

from vsep_app.assets import path
from vsep_app.model.picture import Picture
from vsep_app.views.range_doppler import (
    NOT_YET,
    RangeDopplerView,
    add_colour_bar,
    empty_image,
    map_figure,
)

_SWIPED = "Range-Doppler: left of the line as received, right of it bursts cancelled"
_END_SHARE = 0.02  # of the axis


class SwipedMap(RangeDopplerView):
    """One map; left of a line it is the frame as received, right of it bursts are cancelled.

    The line is moved by the pointer, or by `swipe` from one end to the other.
    """

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
            title=NOT_YET,
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
        if self._line.location is None:
            self._line.location = sum(picture.static_picture.shown_ranges_m) / 2.0
        super().update(picture, with_image=with_image)
        self._line.visible = picture.is_cleaned

    def _say(self, *, is_cleaned: bool) -> None:
        self.after.title.text = _SWIPED if is_cleaned else "Range-Doppler, received"
