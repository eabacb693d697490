"""Figures of studies in a file: HTML that opens from disk, or PNG, SVG and PDF for print.

Everything that is drawn was computed by `vsep.studies`; a row of panels shares one title.
"""

from collections.abc import Sequence
from itertools import groupby
from pathlib import Path
from typing import Any

from vsep.errors import InputError
from vsep.files.writing import write_text
from vsep.studies.example import example_panels
from vsep.studies.figures import study_panels
from vsep.studies.panels import AnyPanel
from vsep.studies.trial import Row
from vsep_app.figures.backends import bokeh_figure, update_sources
from vsep_app.figures.document import document_html
from vsep_app.figures.static_figure import Place, write_static
from vsep_app.figures.study_elements import panel_marks, panel_overlay
from vsep_app.views.style import LEGEND, dress

SUFFIXES = (".html", ".png", ".svg", ".pdf")
WIDTH, HEIGHT = 400, 330
_PANEL_INCHES = (3.9, 3.0)


def write_study_figure(rows: Sequence[Row], out: Path) -> None:
    """Draw the rows of studies into a file, ``.html``, ``.png``, ``.svg`` or ``.pdf``.

    The rows are as `vsep study run` writes them. Raises `InputError` if the suffix is another one
    or nothing in the rows can be drawn, `OSError` if the file cannot be written.
    """
    if out.suffix.lower() not in SUFFIXES:
        raise InputError(f"The figure {out.name!r} must end in .html, .png, .svg or .pdf.")
    panels = figure_panels(rows)
    if out.suffix.lower() == ".html":
        title = f"vsep: {', '.join(dict.fromkeys(row['study'] for row in rows))}"
        write_text(out, figure_html(panels, title=title))
    else:
        write_panels(panels, out)


def figure_panels(rows: Sequence[Row]) -> list[AnyPanel]:
    """Return the panels of rows, examples first; `InputError` if there is none."""
    panels: list[AnyPanel] = [*example_panels(rows), *study_panels(rows)]
    if not panels:
        raise InputError("The rows hold no finished trial of a known study; run one first.")
    return panels


def by_title(panels: Sequence[AnyPanel]) -> list[tuple[str, list[AnyPanel]]]:
    """Return the panels title by title."""
    return [(name, list(own)) for name, own in groupby(panels, key=lambda panel: panel.title)]


def figure_html(panels: Sequence[AnyPanel], *, title: str) -> str:
    """Return the panels as one HTML document that asks for nothing else."""
    plots: list[Any] = []
    sections = []
    for name, own in by_title(panels):
        drawn = [draw_panel(panel) for panel in own]
        for number, plot in enumerate(drawn, start=len(plots)):
            plot.update(name=f"panel-{number}", width=WIDTH, height=HEIGHT)
        plots += drawn
        sections.append((name, [plot.name for plot in drawn]))
    return document_html(
        plots,
        template="panels.html",
        title=title,
        variables={"heading": title, "sections": sections},
    )


def draw_panel(panel: AnyPanel) -> Any:
    """Draw one panel as a Bokeh figure; `update_panel` gives it newer numbers."""
    plot = bokeh_figure(panel_overlay(panel, "bokeh"))
    dress(plot)
    plot.title.update(text_font_size="9px", text_font_style="normal", text_color="#555555")
    for legend in plot.legend:
        sizes = {"padding": 2, "margin": 0, "glyph_height": 14, "label_height": 14}
        legend.update(**LEGEND, **sizes, label_text_font_size="10px")
    return plot


def update_panel(plot: Any, panel: AnyPanel) -> None:
    """Give a figure of the same shape the numbers of another panel; its zoom stays."""
    plot.title.text = panel.note
    update_sources(plot, [mark.source for mark in panel_marks(panel)])


def write_panels(panels: Sequence[AnyPanel], out: Path) -> None:
    """Draw panels for print, one row for each title.

    Raises `OSError` if the file cannot be written.
    """
    rows = [(title, [_place(panel) for panel in own]) for title, own in by_title(panels)]
    write_static(rows, out, panel_inches=_PANEL_INCHES)


def _place(panel: AnyPanel) -> Place:
    overlay = panel_overlay(panel, "matplotlib")
    return Place(overlay, note=panel.note, log_y=panel.log_y)
