"""The figure of a study for print: matplotlib draws the panels that Bokeh draws on screen."""

from collections.abc import Sequence
from itertools import groupby
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.ticker import NullFormatter

from vsep.studies.panels import AnyPanel, BoxPanel, FigurePanel, Series
from vsep_app.figures.study_style import DASHES, colour, marker, width

DOTS_PER_INCH = 150
_PANEL_INCHES = (3.9, 3.0)
_MARKERS = {
    "circle": "o",
    "square": "s",
    "triangle": "^",
    "diamond": "D",
    "inverted_triangle": "v",
    "star": "*",
    "hex": "h",
    "plus": "P",
}
_DASHES = dict(zip(DASHES, ("-", "--", ":", "-."), strict=True))


def write_print(panels: Sequence[AnyPanel], out: Path, *, suffix: str) -> None:
    """Draw panels into a PNG or SVG file, one row for each title.

    Parameters
    ----------
    panels : sequence of FigurePanel or BoxPanel
        What to draw.
    out : Path
        File to write.
    suffix : str
        ".png" or ".svg".

    Raises
    ------
    OSError
        If the file cannot be written.
    """
    rows = [list(members) for _, members in groupby(panels, key=lambda panel: panel.title)]
    num_columns = max(len(members) for members in rows)
    width, height = _PANEL_INCHES
    sheet = Figure(
        figsize=(width * num_columns, height * len(rows)), dpi=DOTS_PER_INCH, layout="constrained"
    )
    FigureCanvasAgg(sheet)
    bands = sheet.subfigures(len(rows), 1, squeeze=False)[:, 0]
    for band, members in zip(bands, rows, strict=True):
        band.suptitle(members[0].title, fontsize=9, fontweight="bold", x=0.01, ha="left")
        axes = band.subplots(1, num_columns, squeeze=False)[0]
        for place, panel in zip(axes, members, strict=False):
            _draw(place, panel)
        for place in axes[len(members) :]:
            place.set_axis_off()
    # The same rows give the same file: no date, and names of SVG elements that do not change.
    with mpl.rc_context({"svg.hashsalt": "vsep"}):
        metadata = {"Date": None} if suffix == ".svg" else {}
        sheet.savefig(out, format=suffix[1:], metadata=metadata)


def _draw(axes: Any, panel: AnyPanel) -> None:
    if isinstance(panel, BoxPanel):
        _draw_boxes(axes, panel)
    else:
        _draw_curves(axes, panel)
    axes.set_ylabel(panel.y_label, fontsize=7)
    axes.set_title(panel.note, fontsize=5, loc="left", color="#555555")
    if panel.log_y:
        axes.set_yscale("log", nonpositive="mask")
    axes.tick_params(labelsize=6, which="both")
    axes.spines[["top", "right"]].set_visible(False)
    axes.grid(alpha=0.25)


def _draw_curves(axes: Any, panel: FigurePanel) -> None:
    for series in panel.series:
        _draw_series(axes, series)
    axes.set_xlabel(panel.x_label, fontsize=7)
    if panel.log_x:
        axes.set_xscale("log")
        # Labels between the powers of ten overlap.
        axes.xaxis.set_minor_formatter(NullFormatter())
    axes.legend(fontsize=5.5, frameon=False, ncols=2)


def _draw_series(axes: Any, series: Series) -> None:
    shade, x, y = colour(series.role), series.x, series.y
    if series.kind == "crosses":
        axes.plot(x, y, "x", color=shade, label=series.label, markersize=6)
    elif series.kind == "stems":
        axes.vlines(x, series.low, y, color=shade, alpha=0.5, linewidth=0.8)
        look = {"markerfacecolor": "none", "markersize": 5}
        axes.plot(x, y, "o", color=shade, label=series.label, **look)
    elif series.kind == "dashed":
        axes.plot(x, y, "--", color=shade, label=series.label, linewidth=1.0)
        if np.any(np.isfinite(series.low)):
            axes.fill_between(x, series.low, series.high, color=shade, alpha=0.12, linewidth=0)
    else:
        dash = _DASHES[DASHES[series.variant % len(DASHES)]]
        shape = _MARKERS[marker(series.role)] if series.kind == "curve" else None
        axes.plot(
            x,
            y,
            dash,
            color=shade,
            marker=shape,
            label=series.label,
            markersize=3,
            linewidth=0.7 * width(series.role),
        )
        axes.vlines(x, series.low, series.high, color=shade, alpha=0.6, linewidth=0.9)


def _draw_boxes(axes: Any, panel: BoxPanel) -> None:
    for position, box in enumerate(panel.boxes):
        shade = colour(box.role)
        statistics = {
            "med": box.middle,
            "q1": box.first,
            "q3": box.third,
            "whislo": box.low,
            "whishi": box.high,
            "fliers": list(box.outliers),
        }
        look = {"color": shade}
        axes.bxp(
            [statistics],
            positions=[position],
            widths=0.6,
            boxprops=look,
            whiskerprops=look,
            capprops=look,
            medianprops={"color": shade, "linewidth": 2.0},
            flierprops={"marker": "+", "markeredgecolor": shade, "markersize": 4},
            manage_ticks=False,
        )
        if box.outliers:
            axes.annotate(
                str(len(box.outliers)),
                (position, max(box.outliers)),
                xytext=(0, 3),
                textcoords="offset points",
                ha="center",
                fontsize=6,
            )
    axes.set_xticks(range(len(panel.boxes)), [box.role for box in panel.boxes], rotation=20)
