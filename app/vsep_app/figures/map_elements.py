"""Separability maps described once: a layer in colours, condition (27) as lines, all on hover."""

from collections.abc import Iterator
from typing import Any

import numpy as np
from contourpy import contour_generator

from vsep._typing import FloatArray
from vsep.separability.axes import Axis
from vsep.separability.map import LAYERS, SeparabilityMap
from vsep_app.figures.backends import Backend, holoviews

EXPLANATIONS = {
    "whole_db": "Condition (27) over all objects: the norm of &Phi;<sup>H</sup>&Phi;&alpha; over "
    "that of &Phi;<sup>H</sup>U&Psi;&beta;. Above 0 dB (blue) the objects dominate what the object "
    "atoms see, below (red) the bursts do. The strongest object decides.",
    "weakest_db": "Condition (27) object by object, |&alpha;<sub>l</sub>| over "
    "|&phi;<sub>l</sub><sup>H</sup>U&Psi;&beta;|: the smallest of these ratios. Where it is below "
    "0 dB the weakest object is buried.",
    "coherence": "Cosine of the smallest principal angle between the span of the objects' atoms "
    "and that of the bursts. 0: nothing in common; 1: some object signal looks exactly like some "
    "burst. Levels play no part.",
    "bound_loss_db": "How much larger the Cramér-Rao bound on the variance of the objects' "
    "frequencies is because chirp parameters and paths of the bursts are unknown. Levels play no "
    "part.",
    "detection": "Share of the true objects that the estimator found within a resolution cell. "
    "Trials fill the map from coarse to fine; hatched cells have none of their own yet and show "
    "those of the coarser grid.",
    "rmse_over_crlb": "Root mean squared error of the objects that were found over the root of the "
    "bound. About 1: as good as it gets.",
    "false_alarms": "Objects found where there is none, a frame.",
}
CONTOURS = (
    "Lines: condition (27) at equality, over all objects (solid) and for the weakest (dashed)."
)
# Each line is white on black; in units of a back end.
_DASHES: dict[Backend, dict[str, str]] = {
    "bokeh": {"whole_db": "solid", "weakest_db": "dashed"},
    "matplotlib": {"whole_db": "-", "weakest_db": "--"},
}
_STROKES = (("black", 3.6), ("white", 1.6))
_POINTS = 0.6


def _hatched(plot: Any, _: Any) -> None:
    """Hatch the boxes of a plot of Bokeh, for which HoloViews has no option."""
    hatch = {"hatch_pattern": "right_diagonal_line", "hatch_color": "black"}
    plot.handles["glyph"].update(**hatch, hatch_alpha=0.45, hatch_scale=8.0)


# Cells without trials of their own show those of the coarser grid: a guess.
_UNTRIED: dict[Backend, dict[str, Any]] = {
    "bokeh": {
        "fill_color": "white",
        "fill_alpha": 0.35,
        "line_alpha": 0.0,
        "hooks": [_hatched],
    },
    "matplotlib": {"facecolor": "white", "alpha": 0.45, "linewidth": 0.0},
}


def map_overlay(separability_map: SeparabilityMap, layer: str, backend: Backend) -> Any:
    """Return a layer with its axes, its colours and the lines of condition (27)."""
    spec, shown = separability_map.spec, LAYERS[layer]
    library = holoviews(backend)
    columns = {layer: separability_map.layers[layer], **hover_columns(separability_map)}
    if backend == "matplotlib":
        columns = {layer: np.clip(columns[layer], *separability_map.limits(layer))}
    # With a range given HoloViews looks for none, which a layer without any value does not have.
    values = [library.Dimension(name, range=(0.0, 1.0)) for name in columns]
    image = library.Image(
        (_values(spec.x), _values(spec.y), *columns.values()), ["x", "y"], values, rtol=1e-6
    ).opts(
        cmap="RdBu" if shown.diverging else "viridis",
        clim=separability_map.limits(layer),
        backend=backend,
        **_image_options(separability_map, backend),
    )
    untried = library.Rectangles(_untried(separability_map) if shown.empirical else [])
    untried = untried.opts(**_UNTRIED[backend], backend=backend)
    elements = [image, untried, *_lines(separability_map, backend)]
    aspect = {"aspect": "auto"} if backend == "matplotlib" else {"active_tools": ["box_zoom"]}
    return library.Overlay(elements).opts(
        title=shown.label,
        xlabel=spec.x.kind.label,
        ylabel=spec.y.kind.label,
        show_legend=False,
        backend=backend,
        **aspect,
    )


def _untried(separability_map: SeparabilityMap) -> list[tuple[float, float, float, float]]:
    """Return the cells without trials as boxes, neighbours of a row as one."""
    spec = separability_map.spec
    (x, dx, _), (y, dy, _) = cell_edges(spec.x), cell_edges(spec.y)
    boxes = []
    for row, tried in enumerate(separability_map.finished):
        edges = np.flatnonzero(np.diff(np.concatenate([[True], tried, [True]])))
        bottom = y + dy * row
        boxes += [
            (x + dx * float(start), bottom, x + dx * float(end), bottom + dy)
            for start, end in edges.reshape(-1, 2)
        ]
    return boxes


def hover_columns(separability_map: SeparabilityMap) -> dict[str, FloatArray]:
    """Return what the pointer shows of every cell: parameters, all layers, number of trials."""
    spec = separability_map.spec
    return {
        **{f"{name}_layer": values for name, values in separability_map.layers.items()},
        "x_value": np.broadcast_to(_values(spec.x), spec.shape),
        "y_value": np.broadcast_to(_values(spec.y)[:, None], spec.shape),
        "trials": separability_map.trials,
        "least_found": separability_map.detection_interval[0],
        "most_found": separability_map.detection_interval[1],
    }


def tips(separability_map: SeparabilityMap) -> list[tuple[str, str]]:
    """Return the texts that the pointer shows."""
    spec = separability_map.spec
    shown = [
        (axis.kind.label, f"@{name}_value{{0.[000]}}")
        for name, axis in (("x", spec.x), ("y", spec.y))
    ]
    shown += [
        (layer.label, f"@{name}_layer{{0.[0000]}}")
        for name, layer in LAYERS.items()
        if not layer.empirical or separability_map.finished.any()
    ]
    if not separability_map.finished.any():
        return shown
    interval = "@least_found{0.00} to @most_found{0.00}"
    return [*shown, ("share found, 95 % interval", interval), ("trials", "@trials")]


def equality_lines(separability_map: SeparabilityMap, name: str) -> list[FloatArray]:
    """Return the lines (n, 2) on which a reading of (27) is zero, in the units of the axes.

    With one object both readings are the same; the second has no line then.
    """
    values = np.ma.masked_invalid(separability_map.layers[name])
    if name != "whole_db" and np.allclose(
        values, separability_map.layers["whole_db"], equal_nan=True
    ):
        return []
    spec = separability_map.spec
    contours: Any = contour_generator(_values(spec.x), _values(spec.y), values)
    return list(contours.lines(0.0))


def cell_edges(axis: Axis) -> tuple[float, float, int]:
    """Return edge of the first cell, width of a cell, and number of cells, in the axis's unit."""
    values = _values(axis)
    step = float(values[-1] - values[0]) / (axis.count - 1)
    return float(values[0]) - 0.5 * step, step, axis.count


def _values(axis: Axis) -> FloatArray:
    values: FloatArray = axis.values / axis.kind.scale
    return values


def _image_options(separability_map: SeparabilityMap, backend: Backend) -> dict[str, Any]:
    if backend == "matplotlib":
        return {"interpolation": "nearest"}
    return {
        "colorbar": True,
        "clabel": "",
        "tools": ["hover"],
        "hover_tooltips": tips(separability_map),
        "clipping_colors": {"NaN": "rgba(128, 128, 128, 0.25)"},
        "colorbar_opts": {"width": 10, "padding": 4, "background_fill_color": None},
    }


def _lines(separability_map: SeparabilityMap, backend: Backend) -> Iterator[Any]:
    for name, dash in _DASHES[backend].items():
        lines = equality_lines(separability_map, name)
        for colour, width in _STROKES:
            look = (
                {"line_dash": dash, "line_width": width}
                if backend == "bokeh"
                else {"linestyle": dash, "linewidth": _POINTS * width}
            )
            path = holoviews(backend).Path(lines, ["x", "y"])
            yield path.opts(color=colour, backend=backend, **look)
