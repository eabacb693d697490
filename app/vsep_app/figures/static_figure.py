"""Figures for print: HoloViews elements drawn by Matplotlib, the same bytes for the same data."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import matplotlib as mpl
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.ticker import NullFormatter

from vsep.files.writing import written_beside
from vsep_app.figures.backends import draw_on_axes

DOTS_PER_INCH = 150
# No date, and names of SVG elements that do not change.
_METADATA: dict[str, dict[str, Any]] = {
    ".png": {},
    ".svg": {"Date": None},
    ".pdf": {"CreationDate": None},
}


class Place(NamedTuple):
    """An element and what stands beside it."""

    element: Any
    title: str = ""
    note: str = ""
    log_y: bool = False


def write_static(
    rows: Sequence[tuple[str, Sequence[Place]]], out: Path, *, panel_inches: tuple[float, float]
) -> None:
    """Draw elements into a PNG, SVG or PDF file, row by row below the title of each.

    `panel_inches` are width and height of one element. Raises `OSError` if the file cannot be
    written.
    """
    num_columns = max(len(places) for _, places in rows)
    width, height = panel_inches
    page = Figure(
        figsize=(width * num_columns, height * len(rows)), dpi=DOTS_PER_INCH, layout="constrained"
    )
    FigureCanvasAgg(page)
    bands = page.subfigures(len(rows), 1, squeeze=False)[:, 0]
    for band, (title, places) in zip(bands, rows, strict=True):
        band.suptitle(title, fontsize=9, fontweight="bold", x=0.01, ha="left")
        grid = band.subplots(1, num_columns, squeeze=False)[0]
        for axes, place in zip(grid, places, strict=False):
            _draw(axes, place)
        for axes in grid[len(places) :]:
            axes.set_axis_off()
    suffix = out.suffix.lower()
    with mpl.rc_context({"svg.hashsalt": "vsep"}), written_beside(out) as beside:
        page.savefig(beside, format=suffix[1:], metadata=_METADATA[suffix])


def _draw(axes: Any, place: Place) -> None:
    draw_on_axes(axes, place.element)
    axes.autoscale()
    axes.set_title("")
    size, shade = (8, "black") if place.title else (5, "#555555")
    axes.set_title(place.title or place.note, fontsize=size, loc="left", color=shade)
    if place.log_y:
        axes.set_yscale("log", nonpositive="mask")
    if axes.get_xscale() == "log":
        # Labels between the powers of ten overlap.
        axes.xaxis.set_minor_formatter(NullFormatter())
    axes.tick_params(labelsize=6, which="both")
    for label in (axes.xaxis.label, axes.yaxis.label):
        label.set_fontsize(7)
    axes.spines[["top", "right"]].set_visible(False)
    if not axes.images:
        axes.grid(alpha=0.25)
    for image in axes.images:
        bar = axes.figure.colorbar(image, ax=axes, fraction=0.05, pad=0.02)
        bar.ax.tick_params(labelsize=6)
    if axes.get_legend() is not None:
        _merge_legend(axes)


def _merge_legend(axes: Any) -> None:
    """Give all that bears one label a single entry: HoloViews shows the first of them alone."""
    entries: dict[str, list[Any]] = {}
    for handle, label in zip(*axes.get_legend_handles_labels(), strict=True):
        entries.setdefault(label, []).append(handle)
    handles = [tuple(own) for own in entries.values()]
    axes.legend(handles, list(entries), fontsize=5.5, frameon=False, ncols=2)
