"""The map for print: matplotlib draws the layers that Bokeh draws on screen."""

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from vsep.separability.axes import Axis
from vsep.separability.map import LAYERS, SeparabilityMap

DOTS_PER_INCH = 150
_PANEL_INCHES = (4.3, 3.3)
_DASHES = {"whole_db": "solid", "weakest_db": "dashed"}


def write_print(separability_map: SeparabilityMap, out: Path, *, title: str) -> None:
    """Draw all layers into a PNG file, those of trials in a row of their own.

    Parameters
    ----------
    separability_map : SeparabilityMap
        What to draw.
    out : Path
        File to write.
    title : str
        Stands above.

    Raises
    ------
    OSError
        If the file cannot be written.
    """
    rows = [["whole_db", "weakest_db"], ["coherence", "bound_loss_db"]]
    tried = [name for name, layer in LAYERS.items() if layer.empirical]
    if separability_map.finished.any():
        rows = [[*rows[0], *rows[1]], tried]
    num_columns = max(len(names) for names in rows)
    width, height = _PANEL_INCHES
    sheet = Figure(
        figsize=(width * num_columns, height * len(rows)), dpi=DOTS_PER_INCH, layout="constrained"
    )
    FigureCanvasAgg(sheet)
    sheet.suptitle(title, fontsize=9)
    places = sheet.subplots(len(rows), num_columns, squeeze=False)
    for names, axes in zip(rows, places, strict=True):
        for name, place in zip(names, axes, strict=False):
            _draw(sheet, place, separability_map, name)
        for place in axes[len(names) :]:
            place.set_axis_off()
    sheet.savefig(out, format="png")


def _draw(sheet: Figure, axes: Any, separability_map: SeparabilityMap, name: str) -> None:
    spec, layer = separability_map.spec, LAYERS[name]
    low, high = separability_map.limits(name)
    x, y = (axis.values / axis.kind.scale for axis in (spec.x, spec.y))
    image = axes.imshow(
        np.clip(separability_map.layers[name], low, high),
        origin="lower",
        aspect="auto",
        cmap="RdBu" if layer.diverging else "viridis",
        vmin=low,
        vmax=high,
        extent=(*_edges(spec.x), *_edges(spec.y)),
    )
    for line, dash in _DASHES.items():
        values = np.ma.masked_invalid(separability_map.layers[line])
        if values.count() and values.min() < 0.0 < values.max():
            for colour, width in (("black", 2.2), ("white", 1.0)):
                axes.contour(x, y, values, [0.0], colors=colour, linewidths=width, linestyles=dash)
    bar = sheet.colorbar(image, ax=axes, fraction=0.05, pad=0.02)
    bar.ax.tick_params(labelsize=6)
    axes.set_title(layer.label, fontsize=8, loc="left")
    axes.set_xlabel(spec.x.kind.label, fontsize=7)
    axes.set_ylabel(spec.y.kind.label, fontsize=7)
    axes.tick_params(labelsize=6)


def _edges(axis: Axis) -> tuple[float, float]:
    """Return the outer edges of the first and the last cell."""
    first, last = axis.start / axis.kind.scale, axis.stop / axis.kind.scale
    half = 0.5 * (last - first) / (axis.count - 1)
    return first - half, last + half
