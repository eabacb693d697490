"""Figure page and filmstrip of a report: pictures of the views, drawn by Matplotlib for print."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from vsep_app.model.picture import Picture, Signals
from vsep_app.model.text import counted
from vsep_app.views.range_doppler import mark_sizes
from vsep_app.views.style import COLOURS
from vsep_app.views.tables import quantities

SIZE_INCHES = (11.7, 8.3)  # A4, landscape
DOTS_PER_INCH = 160
SHOWN_ROWS = 22
_EDGES = {
    **{"left": 0.055, "right": 0.985, "top": 0.915, "bottom": 0.115},
    **{"hspace": 0.42, "wspace": 0.2},
}
_LEGEND = {"fontsize": 7, "frameon": False, "loc": "upper right", "borderaxespad": 0.1}
_LINES = (
    ("received", "received", "received", {"linewidth": 1.8, "alpha": 0.65}),
    ("interference", "interference", "interference", {"linewidth": 1.2}),
    ("cleaned", "cleaned", "cleaned", {"linewidth": 0.9}),
    ("true_object", "true", "true objects", {"linewidth": 2.0, "linestyle": (0, (4, 2))}),
    ("object_estimate", "object", "estimate", {"linewidth": 1.0}),
)


def draw_figure_page(picture: Picture, settings: Mapping[str, str]) -> Figure:
    """Draw the three views, the table and, at the foot, the settings."""
    page = empty_figure_page()
    several = picture.static_picture.radar.num_ramps > 1
    heights = (1.0, 1.15, 1.5) if several else (1.0, 1.15)
    grid = page.add_gridspec(len(heights), 3, height_ratios=heights, **_EDGES)
    draw_fast_time(page.add_subplot(grid[0, :2]), picture)
    draw_delay(page.add_subplot(grid[1, :2]), picture)
    if several:
        draw_map(page.add_subplot(grid[2, 0]), picture, before=True)
        image = draw_map(page.add_subplot(grid[2, 1]), picture, before=False)
        low, high = picture.static_picture.map_limits_db
        bar = page.colorbar(image, ax=page.axes[-1], fraction=0.05, pad=0.02)
        bar.set_ticks(
            [0.0, 127.5, 255.0], labels=[f"{x:.0f}" for x in (low, (low + high) / 2, high)]
        )
        bar.ax.set_title("dB", fontsize=8)
        bar.ax.tick_params(labelsize=7)
    _table(page.add_subplot(grid[:2, 2]), picture)
    if several:
        _progress(page.add_subplot(grid[2, 2]), picture)
    add_words(page, picture, settings)
    return page


def draw_filmstrip(pictures: Sequence[Picture], settings: Mapping[str, str]) -> Figure:
    """Draw fast time, delay and map of each picture in a column, and the settings at the foot."""
    page = empty_figure_page()
    several = pictures[0].static_picture.radar.num_ramps > 1
    edges = {**_EDGES, "top": 0.885, "wspace": 0.24}
    grid = page.add_gridspec(3 if several else 2, len(pictures), **edges)
    for column, picture in enumerate(pictures):
        top, *lower = (page.add_subplot(grid[row, column]) for row in range(grid.nrows))
        draw_fast_time(top, picture, legend=False)
        draw_delay(lower[0], picture, legend=False)
        if several:
            draw_map(lower[1], picture, before=False)
        for axes in (top, *lower) if column else ():
            axes.set_ylabel("")
        objects = counted(len(picture.objects.ranges_m), "object")
        title = f"Iteration {picture.iteration}: {objects}\nFast time, ramp {picture.ramp}"
        top.set_title(title, loc="left", fontsize=9)
    add_words(page, pictures[-1], settings)
    return page


def empty_figure_page() -> Figure:
    """Return an empty page."""
    page = Figure(figsize=SIZE_INCHES, dpi=DOTS_PER_INCH)
    FigureCanvasAgg(page)
    return page


def add_words(page: Figure, picture: Picture, settings: Mapping[str, str]) -> None:
    """Write the title above a page and the settings below it."""
    title = f"vsep: {picture.static_picture.title}"
    outcome = f"iteration {picture.iteration}, {picture.termination.value}"
    page.text(0.055, 0.965, title, fontsize=12, fontweight="bold", va="center")
    page.text(0.985, 0.965, outcome, fontsize=8, ha="right", va="center")
    foot = picture.static_picture.levels_text
    listed = ", ".join(f"{name}: {value}" for name, value in settings.items())
    page.text(0.055, 0.035, f"{foot}\n{listed}", fontsize=7, va="center", wrap=True)


_EXTENT: dict[str, Any] = {"fmt": "none", "ecolor": "white", "elinewidth": 1.6, "capsize": 4}


def _lines(axes: Any, signals: Signals) -> None:
    for column, role, label, look in _LINES:
        axes.plot(signals.axis, getattr(signals, column), color=COLOURS[role], label=label, **look)


def _dress(axes: Any, title: str, x_label: str, y_label: str) -> None:
    axes.set_title(title, loc="left", fontsize=9)
    axes.set_xlabel(x_label, fontsize=8)
    axes.set_ylabel(y_label, fontsize=8)
    axes.tick_params(labelsize=7)
    axes.spines[["top", "right"]].set_visible(False)
    axes.grid(alpha=0.25)


def draw_fast_time(axes: Any, picture: Picture, *, legend: bool = True) -> None:
    """Draw the signals of the ramp over fast time."""
    _lines(axes, picture.fast_time)
    axes.set_xlim(picture.fast_time.axis[0], picture.fast_time.axis[-1])
    real = picture.fast_time_mode == "real"
    static_picture = picture.static_picture
    axes.set_ylim(*(static_picture.real_limits if real else static_picture.level_limits_db))
    label = "real part [arb. unit]" if real else "level [dB]"
    _dress(axes, f"Fast time, ramp {picture.ramp}", "fast time [µs]", label)
    if legend:
        axes.legend(ncols=5, **_LEGEND)


def draw_delay(axes: Any, picture: Picture, *, legend: bool = True) -> None:
    """Draw the delay spectra of the ramp, components as stems."""
    static_picture = picture.static_picture
    _lines(axes, picture.delay)
    floor = static_picture.spectrum_limits_db[0]
    for marks, role, marker, label in (
        (picture.true_objects, "true", "x", "true object"),
        (picture.objects, "object", "o", "estimate"),
    ):
        colour = COLOURS[role]
        axes.vlines(marks.ranges_m, floor, marks.levels_db, color=colour, alpha=0.5, linewidth=0.8)
        face = {} if marker == "x" else {"markerfacecolor": "none"}
        look = {"color": colour, "markersize": 5, "linestyle": "none", **face}
        axes.plot(marks.ranges_m, marks.levels_db, marker, label=label, **look)
    axes.set_xlim(*_holding(static_picture.shown_ranges_m, picture.objects.ranges_m))
    axes.set_ylim(*static_picture.spectrum_limits_db)
    _dress(axes, f"Delay spectrum, ramp {picture.ramp}", "range [m]", "level [dB]")
    if legend:
        handles, labels = axes.get_legend_handles_labels()
        axes.legend(handles[len(_LINES) :], labels[len(_LINES) :], ncols=3, **_LEGEND)


def draw_map(axes: Any, picture: Picture, *, before: bool) -> Any:
    """Draw a range-Doppler map with its marks; return the image."""
    static_picture = picture.static_picture
    values = static_picture.map_before if before else picture.map_after * picture.is_changed
    ranges, velocities = static_picture.map_ranges_m, static_picture.map_velocities_mps
    extent = [
        end
        for axis in (ranges, velocities)
        for end in (axis[0] - (axis[1] - axis[0]) / 2.0, axis[-1] + (axis[1] - axis[0]) / 2.0)
    ]
    colours = {"cmap": "viridis", "vmin": 0, "vmax": 255}
    image = axes.imshow(values, origin="lower", aspect="auto", extent=extent, **colours)
    found, true = picture.objects, picture.true_objects
    sizes = (mark_sizes(found.snr_db) * 0.8) ** 2
    for colour, width in (("black", 2.2), ("white", 1.1)):
        ring = {"facecolors": "none", "edgecolors": colour, "linewidths": width}
        axes.scatter(found.ranges_m, found.velocities_mps, s=sizes, **ring)
    axes.scatter(
        true.ranges_m, true.velocities_mps, s=36, marker="+", color=COLOURS["true"], linewidths=1.3
    )
    groups = picture.groups
    axes.errorbar(groups.ranges_m, groups.velocities_mps, xerr=0.5 * groups.extents_m, **_EXTENT)
    axes.set_xlim(*_holding(static_picture.shown_ranges_m, found.ranges_m))
    if static_picture.shown_velocities_mps:
        axes.set_ylim(*_holding(static_picture.shown_velocities_mps, found.velocities_mps))
    title = "Range-Doppler, received" if before else picture.title_after
    _dress(axes, title, "range [m]", "radial velocity [m/s]" if before else "")
    axes.grid(visible=False)
    return image


def _holding(limits: tuple[float, float], places: Any) -> tuple[float, float]:
    """Return limits that hold all places, too."""
    every = [*limits, *places]
    return min(every), max(every)


def _progress(axes: Any, picture: Picture) -> None:
    progress = picture.progress
    axes.plot(progress.iterations, progress.elbo, ".-", color=COLOURS["object"], linewidth=1.2)
    _dress(axes, "Evidence lower bound [nats]", "iteration", "")


def _table(axes: Any, picture: Picture) -> None:
    """Estimate against truth, the first rows by distance."""
    axes.axis("off")
    axes.set_title("Objects: estimate ± standard deviation, and truth", loc="left", fontsize=9)
    moving = picture.static_picture.radar.num_ramps > 1
    shown = quantities(picture.table, moving=moving)
    head = [text for each in shown for text in (each.heading, "truth")]
    cells = []
    for row in picture.table[:SHOWN_ROWS]:
        pairs = [(" ± ".join(filter(None, each.own(row))), each.true(row)) for each in shown]
        cells.append([text for pair in pairs for text in pair])
    if not cells:
        axes.text(0.0, 0.95, "No object.", fontsize=8, va="top")
        return
    widths = np.array([1.7 if name[0] in "rva" and name != "truth" else 0.95 for name in head])
    place = {"loc": "upper left", "edges": "horizontal", "cellLoc": "right"}
    shares = list(widths / widths.sum())
    drawn = axes.table(cellText=cells, colLabels=head, colWidths=shares, **place)
    drawn.auto_set_font_size(False)
    drawn.set_fontsize(6.8)
    for cell in drawn.get_celld().values():
        cell.set_linewidth(0.3)
    hidden = len(picture.table) - len(cells)
    if hidden > 0:
        axes.text(0.0, 0.0, f"and {hidden} more", fontsize=7)
