"""A separability map on the page: zoom stays, and a click opens a cell in the live view."""

from typing import Any

from bokeh.events import Tap
from bokeh.models import CustomJS, HoverTool

from vsep.separability.map import SeparabilityMap
from vsep.separability.trial_word import word_parts
from vsep_app.figures.backends import bokeh_figure, holoviews
from vsep_app.figures.map_elements import cell_edges, map_overlay, tips
from vsep_app.views.style import Axis, dress

_OPEN = """
const [start, columns, rows, x, dx, y, dy] = plot.tags
const column = Math.floor((cb_obj.x - x) / dx), row = Math.floor((cb_obj.y - y) / dy)
if (!(column in columns) || !(row in rows)) { return }
const link = "./?trial=" + encodeURIComponent(start + columns[column] + "," + rows[row])
window.dispatchEvent(new CustomEvent("vsep-go", {detail: link}))
"""


class MapView:
    """One map, drawn at the first `update`; later ones give the same figure other numbers.

    Several maps may share the ranges `x_axis` and `y_axis`.
    """

    def __init__(self, x_axis: Axis, y_axis: Axis) -> None:
        self._x, self._y = x_axis, y_axis
        self._pipe: Any = None
        self.figure: Any = None

    def update(self, separability_map: SeparabilityMap, layer: str) -> Any:
        """Draw a layer of a map and return the figure."""
        spec, shown = separability_map.spec, (separability_map, layer)
        if self._pipe is None:
            library = holoviews("bokeh")
            pipe = library.streams.Pipe(data=shown)
            overlay = library.DynamicMap(_overlay, streams=[pipe])
            self.figure = bokeh_figure(overlay, x_range=self._x.range, y_range=self._y.range)
            dress(self.figure)
            self.figure.update(
                width=None, height=None, sizing_mode="stretch_both", name="separability-map"
            )
            self.figure.title.text_font_size = "12px"
            self.figure.js_on_event(Tap, CustomJS(args={"plot": self.figure}, code=_OPEN))
            self._pipe = pipe
        else:
            self._pipe.send(shown)
        (x, dx, num_columns), (y, dy, num_rows) = cell_edges(spec.x), cell_edges(spec.y)
        self._x.set((x, x + dx * num_columns))
        self._y.set((y, y + dy * num_rows))
        self.figure.tags = [*word_parts(spec), x, dx, y, dy]
        self.figure.select_one(HoverTool).tooltips = tips(separability_map)
        return self.figure


def _overlay(data: tuple[SeparabilityMap, str]) -> Any:
    return map_overlay(*data, "bokeh")
