"""A map over two parameters: one layer in colours, condition (27) as lines, all values on hover.

Bokeh's own glyphs: a HoloViews element costs the server twenty times as much at every update, and
its documents ask for style sheets from outside.
"""

from typing import Any

import numpy as np
from bokeh.events import Tap
from bokeh.models import ColorBar, ColumnDataSource, CustomJS, HoverTool, LinearColorMapper
from bokeh.palettes import RdBu11, Viridis256, interp_palette
from bokeh.plotting.contour import contour_data

from vsep.separability.axes import Axis as Parameter
from vsep.separability.map import LAYERS, SeparabilityMap
from vsep.separability.trial_word import word_parts
from vsep_app.views.style import LABEL_SIZE, Axis, plain_figure

DIVERGING = tuple(reversed(interp_palette(RdBu11, 256)))
# The lines of condition (27): which layer, and how it is dashed.
EQUALITY = {"whole_db": "solid", "weakest_db": "dashed"}
_OPEN = """
const [start, columns, rows, x, dx, y, dy] = plot.tags
const column = Math.floor((cb_obj.x - x) / dx), row = Math.floor((cb_obj.y - y) / dy)
if (!(column in columns) || !(row in rows)) { return }
window.open("./?trial=" + encodeURIComponent(start + columns[column] + "," + rows[row]), "_blank")
"""


class MapView:
    """One map; `update` gives it another separability map or another layer.

    Parameters
    ----------
    x_axis, y_axis : Axis
        Ranges, which several maps may share.
    opens : bool
        Whether a click opens its cell in the live view.
    """

    def __init__(self, x_axis: Axis, y_axis: Axis, *, opens: bool) -> None:
        self._x, self._y, self._opens = x_axis, y_axis, opens
        self.figure = plain_figure(
            title="", x_label="", y_label="", x_axis=x_axis, y_axis=y_axis, name="separability-map"
        )
        self.figure.grid.visible = False
        self.source = ColumnDataSource(
            {"shown": [np.zeros((2, 2), np.float32)], "x": [0], "y": [0], "dw": [1], "dh": [1]},
            name="separability-map",
        )
        self.scale = LinearColorMapper(
            palette=Viridis256, low=0.0, high=1.0, nan_color="rgba(128, 128, 128, 0.25)"
        )
        image = self.figure.image(
            "shown", x="x", y="y", dw="dw", dh="dh", source=self.source, color_mapper=self.scale
        )
        self._lines = {name: ColumnDataSource({"xs": [], "ys": []}) for name in EQUALITY}
        for name, dash in EQUALITY.items():
            for colour, width in (("black", 3.6), ("white", 1.6)):
                self.figure.multi_line(
                    "xs",
                    "ys",
                    source=self._lines[name],
                    line_color=colour,
                    line_width=width,
                    line_dash=dash,
                )
        self._hover = HoverTool(renderers=[image])
        self.figure.add_tools(self._hover)
        self.figure.add_layout(
            ColorBar(
                color_mapper=self.scale,
                width=10,
                padding=4,
                major_label_text_font_size=LABEL_SIZE,
                background_fill_color=None,
            ),
            "right",
        )
        if opens:
            self.figure.js_on_event(Tap, CustomJS(args={"plot": self.figure}, code=_OPEN))

    def update(self, separability_map: SeparabilityMap, layer: str) -> None:
        """Draw a layer of an separability_map."""
        spec, plot = separability_map.spec, self.figure
        places = [_place(axis) for axis in (spec.x, spec.y)]
        for axis, (start, step, count) in zip((self._x, self._y), places, strict=True):
            axis.set((start, start + step * count))
        (x, dx, num_columns), (y, dy, num_rows) = places
        plot.title.text = LAYERS[layer].label
        plot.xaxis.axis_label, plot.yaxis.axis_label = spec.x.kind.label, spec.y.kind.label
        low, high = separability_map.limits(layer)
        palette = DIVERGING if LAYERS[layer].diverging else Viridis256
        self.scale.update(palette=palette, low=low, high=high)
        if self._opens:
            plot.tags = [*word_parts(spec), x, dx, y, dy]
        self._hover.tooltips = tips(separability_map)
        self.source.data = {
            "shown": [separability_map.layers[layer].astype(np.float32)],
            **{
                name: [values.astype(np.float32)]
                for name, values in separability_map.layers.items()
            },
            **{name: [grid] for name, grid in _grids(separability_map).items()},
            **{"x": [x], "y": [y], "dw": [dx * num_columns], "dh": [dy * num_rows]},
        }
        for name, source in self._lines.items():
            source.data = equality_lines(separability_map, name)


def tips(separability_map: SeparabilityMap) -> list[tuple[str, str]]:
    """Return what the pointer shows: both parameters, all layers, and the number of trials."""
    spec = separability_map.spec
    shown = [(axis.kind.label, f"@{name}_value{{0.[000]}}") for name, axis in _named(spec)]
    shown += [
        (layer.label, f"@{name}{{0.[0000]}}")
        for name, layer in LAYERS.items()
        if not layer.empirical or spec.trials
    ]
    return [*shown, ("trials", "@trials")] if spec.trials else shown


def equality_lines(separability_map: SeparabilityMap, name: str) -> dict[str, list[Any]]:
    """Return the lines along which a reading of (27) is zero, in the units of the axes.

    With one object both readings are the same; the second has no line then.
    """
    values = np.ma.masked_invalid(separability_map.layers[name])
    if name != "whole_db" and np.allclose(
        values, separability_map.layers["whole_db"], equal_nan=True
    ):
        return {"xs": [], "ys": []}
    x, y = (
        axis.values / axis.kind.scale for axis in (separability_map.spec.x, separability_map.spec.y)
    )
    found = contour_data(x, y, values, [0.0], want_fill=False, want_line=True).line_data
    return {"xs": list(found.xs), "ys": list(found.ys)}


def _named(spec: Any) -> list[tuple[str, Parameter]]:
    return [("x", spec.x), ("y", spec.y)]


def _place(axis: Parameter) -> tuple[float, float, int]:
    """Return edge of the first cell, width of a cell, and number of cells, in the axis's unit."""
    values = axis.values / axis.kind.scale
    step = float(values[-1] - values[0]) / (axis.count - 1)
    return float(values[0]) - 0.5 * step, step, axis.count


def _grids(separability_map: SeparabilityMap) -> dict[str, Any]:
    """Return the parameters and the number of trials of every cell, for the pointer."""
    shape = separability_map.spec.shape
    x, y = (
        axis.values / axis.kind.scale for axis in (separability_map.spec.x, separability_map.spec.y)
    )
    return {
        "x_value": np.broadcast_to(x, shape).astype(np.float32),
        "y_value": np.broadcast_to(y[:, None], shape).astype(np.float32),
        "trials": separability_map.trials.astype(np.float32),
    }
