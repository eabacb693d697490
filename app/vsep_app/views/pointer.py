"""Dragging in a figure: what the browser tells of the pointer, and the ends of what it may tell."""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from bokeh.events import Pan, PanEnd, PanStart
from bokeh.models import ColumnDataSource, CustomJS
from bokeh.plotting import figure

from vsep_app.assets import path

PHASES = START, MOVE, END = range(3)
REACH_PX = 14.0  # so near the pointer must be to what it takes


class Drag(NamedTuple):
    """Where the pointer is while something is dragged."""

    phase: int  #: `START`, `MOVE` or `END`.
    #: In the units of the axes.
    x: float
    y: float
    #: Width and height of a pixel.
    dx: float
    dy: float


class PointerDrag:
    """Hands on what is dragged in a figure, ten times a second or more.

    The box zoom of the figure, which a drag means elsewhere, waits in its tool bar.
    """

    def __init__(self, plot: figure, take: Callable[[Drag], None]) -> None:
        self._take = take
        first = {**Drag(MOVE, 0.0, 0.0, 1.0, 1.0)._asdict(), "number": 0}
        self.source = ColumnDataSource({k: [v] for k, v in first.items()}, name="dragged")
        self.source.on_change("data", self._told)
        code = path("page/drag.js").read_text(encoding="utf-8")
        answer = CustomJS(args={"dragged": self.source, "plot": plot}, code=code)
        for event in (PanStart, Pan, PanEnd):
            plot.js_on_event(event, answer)
        plot.toolbar.active_drag = None

    def _told(self, attr: str, old: Any, new: Any) -> None:
        del attr, old
        phase, *place = (new[name][0] for name in Drag._fields)
        numbers = isinstance(phase, int) and all(isinstance(each, int | float) for each in place)
        if numbers and phase in PHASES and np.all(np.isfinite(place)):
            self._take(Drag(phase, *map(float, place)))
