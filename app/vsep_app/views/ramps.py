"""Strip of all ramps: which truly hold a burst, and in which one is estimated."""

from collections.abc import Callable
from typing import Any

import numpy as np
from bokeh.events import Tap
from bokeh.models import BoxAnnotation, ColumnDataSource, FactorRange, HoverTool

from vsep_app.model.picture import Picture
from vsep_app.views.style import COLOURS, Axis, plain_figure, put

_ROWS = ("estimated bursts", "true bursts")


class RampStrip:
    """Two rows of cells, one cell a ramp; a click selects the ramp.

    `select` is called with it; None where nobody listens.
    """

    def __init__(self, select: Callable[[int], None] | None = None) -> None:
        self._select = select
        self._num_ramps = 1
        self._x = Axis()
        self.figure = plain_figure("ramps", "", ("", ""), (self._x, _Rows()), tools=False)
        self.figure.grid.visible = False
        self._source = ColumnDataSource(
            {name: [] for name in ("ramp", "row", "opacity", "colour", "level")}
        )
        fill = {"fill_color": "colour", "fill_alpha": "opacity"}
        edge = {"line_color": COLOURS["received"], "line_alpha": 0.35}
        cells = self.figure.rect(
            "ramp", "row", width=0.86, height=0.8, source=self._source, **fill, **edge
        )
        self._selected = BoxAnnotation(
            left=-0.5, right=0.5, fill_alpha=0.0, line_color=COLOURS["object"], line_width=2.5
        )
        self.figure.add_layout(self._selected)
        self.figure.add_tools(
            HoverTool(renderers=[cells], tooltips=[("ramp", "@ramp"), ("@row", "@level")])
        )
        if select is not None:
            self.figure.on_event(Tap, self._tapped)

    def _tapped(self, event: Tap) -> None:
        if event.x is not None and self._select is not None:
            self._select(min(max(round(float(event.x)), 0), self._num_ramps - 1))

    def update(self, picture: Picture) -> None:
        """Draw another picture."""
        self._num_ramps = count = len(picture.true_ramps)
        self._x.set((-0.5, count - 0.5))
        known = picture.static_picture.observation.truth is not None
        rows = list(_ROWS if known else _ROWS[:1])
        if self.figure.y_range.factors != rows:
            self.figure.y_range.factors = rows
        levels = picture.burst_level_db
        lowest, highest = picture.static_picture.level_limits_db
        opacity = np.clip((levels - lowest) / (highest - lowest), 0.35, 1.0)
        ramps = np.arange(count)
        columns = {
            "ramp": np.concatenate([ramps, ramps]),
            "row": [*[_ROWS[0]] * count, *[_ROWS[1]] * count],
            "opacity": np.nan_to_num(np.concatenate([opacity, picture.true_ramps * 1.0])),
            "colour": [*[COLOURS["interference"]] * count, *[COLOURS["true"]] * count],
            "level": [
                *("none" if np.isnan(level) else f"{level:.0f} dB" for level in levels),
                *("present" if present else "none" for present in picture.true_ramps),
            ],
        }
        shown = count * len(rows)
        put(self._source, {name: column[:shown] for name, column in columns.items()})
        self._selected.update(left=picture.ramp - 0.5, right=picture.ramp + 0.5)


class _Rows(Axis):
    """The categorical axis of the strip."""

    def __init__(self) -> None:
        super().__init__()
        self.range: Any = FactorRange(*_ROWS)
