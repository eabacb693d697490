"""Ghost of a pinned run in the views of another: its objects, and its cleaned signal."""

from typing import Any

import numpy as np
from bokeh.models import ColumnDataSource
from bokeh.plotting import figure

from vsep_app.model.picture import Picture
from vsep_app.views.style import COLOURS, lighten, put, short

_NOTHING: dict[str, list[float]] = {"range": [], "velocity": [], "level": []}
_NO_LINE = {"axis": [np.nan], "cleaned": [np.nan]}


class PinnedMarks:
    """Diamonds where a pinned run had its objects, a dotted line for what it had cleaned.

    They are put into the figures when a run is pinned for the first time: each model costs time
    when the page is opened.
    """

    def __init__(self, *, fast_time: figure, delay: figure, range_doppler: figure) -> None:
        self._figures = fast_time, delay, range_doppler
        self._marks, self._line = ColumnDataSource(_NOTHING), ColumnDataSource(_NO_LINE)
        self._pinned: Picture | None = None
        self._is_made = False

    def pin(self, pinned: Picture | None, shown: Picture) -> None:
        """Show the ghost of a picture beside another one; None takes it away."""
        if not self._is_made and pinned is not None:
            self._make()
        self._pinned = pinned
        marks = None if pinned is None else pinned.objects
        columns: dict[str, Any] = dict(_NOTHING)
        if marks is not None:
            places = marks.ranges_m, marks.velocities_mps, marks.levels_db
            columns = dict(zip(_NOTHING, map(short, places), strict=True))
        put(self._marks, columns)
        self.follow(shown)

    def follow(self, shown: Picture) -> None:
        """Show the pinned signal where the picture shows the same ramp in the same way."""
        pinned = self._pinned
        if not self._is_made:
            return
        if pinned is None or (pinned.ramp, pinned.fast_time_mode) != (
            shown.ramp,
            shown.fast_time_mode,
        ):
            put(self._line, _NO_LINE)
            return
        signals = pinned.fast_time
        columns = {"axis": signals.axis, "cleaned": signals.cleaned}
        put(self._line, {name: each.astype(np.float32) for name, each in columns.items()})

    def _make(self) -> None:
        fast_time, delay, range_doppler = self._figures
        dotted = {"line_dash": [2, 3], "line_width": 1.6}
        fast_time.line("axis", "cleaned", source=self._line, color=COLOURS["received"], **dotted)
        look = {"marker": "diamond", "size": 17, "fill_color": None, "source": self._marks}
        delay.scatter("range", "level", line_color=COLOURS["received"], line_width=1.6, **look)
        range_doppler.scatter("range", "velocity", line_color="white", line_width=1.6, **look)
        for plot in self._figures:
            lighten(plot)
        self._is_made = True
