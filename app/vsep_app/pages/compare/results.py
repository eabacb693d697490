"""Table of the metrics of all methods, and the error of each from frame to frame."""

from collections.abc import Sequence
from html import escape
from typing import Any

import numpy as np
import panel as pn
from bokeh.models import BasicTicker, ColumnDataSource, HoverTool
from bokeh.plotting import figure

from vsep.analysis.signal_metrics import SIGNAL_METRICS
from vsep_app.model.compare_settings import MAX_METHODS
from vsep_app.model.text import counted
from vsep_app.pages.compare.metrics import FrameResult, MethodMetrics
from vsep_app.pages.compare.picture import ComparePicture
from vsep_app.views.style import Axis, plain_figure, put
from vsep_app.views.tables import MISSING, row_html, value_text
from vsep_app.widgets.layout import card, html_pane, panel, stylesheet

# Okabe and Ito; a place also has its own marker and dash.
SLOT_COLOURS = ("#0A84C6", "#D55E00", "#009E73", "#CC79A7")
_MARKERS = ("circle", "square", "triangle", "diamond")
_DASHES = ("solid", "dashed", "dotted", "dotdash")
_HEADINGS = (
    ("method", ""),
    (
        "now",
        "What the method does at the iteration shown; the limit is the largest number of "
        "iterations.",
    ),
    (
        "iterations",
        "Of the repair + of the object-only estimator on the cleaned frame, once the repair has "
        "finished; estimators have the second only.",
    ),
    ("time [s]", "Spent on the repair + on the estimator, on this machine."),
    ("misses", "True objects without an estimate within one resolution cell."),
    ("false alarms", "Estimates without a true object within one resolution cell."),
    *((metric.label, metric.help) for metric in SIGNAL_METRICS.values()),
    ("prior", "Peaks of the last three frames that lower thresholds in this one."),
)


class CompareResults:
    """Table and sequence curves."""

    def __init__(self) -> None:
        self.table = html_pane("tables")
        self._frames, self._errors = Axis(), Axis()
        self._sources = [
            ColumnDataSource({"frame": [], "error": [], "iterations": [], "name": []})
            for _ in range(MAX_METHODS)
        ]
        self.figure = self._make_figure()
        self._curves = card(self.figure, weight=4, look="strip")
        self.row = pn.Row(
            panel("Methods: quality of the cleaned frame and its objects", self.table, weight=7),
            self._curves,
            margin=0,
            sizing_mode="stretch_width",
            height=190,
            styles={"flex": "0 0 190px", "min-height": "0"},
            stylesheets=[stylesheet("results")],
        )

    def _make_figure(self) -> figure:
        title, axes = "Windowed error from frame to frame", (self._frames, self._errors)
        plot = plain_figure("compare-sequence", title, ("frame", "error [dB]"), axes)
        plot.xaxis.ticker = BasicTicker(min_interval=1)
        looks = zip(self._sources, SLOT_COLOURS, _MARKERS, _DASHES, strict=True)
        for source, colour, marker, dash in looks:
            plot.line("frame", "error", source=source, color=colour, line_dash=dash)
            heads = plot.scatter(
                "frame", "error", source=source, color=colour, marker=marker, size=6
            )
            tooltips = [
                ("@name", "frame @frame"),
                ("windowed error", "@error{0.0} dB"),
                ("iterations of the repair", "@iterations"),
            ]
            plot.add_tools(HoverTool(renderers=[heads], tooltips=tooltips))
        return plot

    def show(self, picture: ComparePicture) -> None:
        """Draw a picture."""
        self.table.object = table_html(picture)
        results = [*picture.past, _present(picture)]
        names = [view.name for view in picture.method_runs]
        # Of one frame it is a row of dots that the table has as numbers.
        priors = any(view.num_prior_peaks is not None for view in picture.method_runs)
        self._curves.visible = priors or len(results) > 1
        for number, source in enumerate(self._sources):
            put(source, _curve(results, number, names))
        self._frames.set((-0.5, max(5.0, results[-1].frame_number + 0.5)))
        errors = [
            method_run.windowed_error_db for result in results for method_run in result.method_runs
        ]
        finite = [error for error in errors if np.isfinite(error)]
        if finite:
            low = 5.0 * np.floor(min(finite) / 5.0 - 0.2)
            high = 5.0 * np.ceil(max(finite) / 5.0 + 0.2)
            self._errors.grow((float(low), float(high)), fresh=not picture.past)


def table_html(picture: ComparePicture) -> str:
    """Return the table of all methods, with the frame as received above them."""
    head = "".join(f'<th title="{escape(text)}">{name}</th>' for name, text in _HEADINGS)
    body = _row("as received", "", picture.received, None, "")
    for view, colour in zip(picture.method_runs, SLOT_COLOURS, strict=False):
        body += _row(view.name, view.stage, view.metrics, view.num_prior_peaks, colour)
    return (
        f'<table class="components methods"><thead><tr>{head}</tr></thead>'
        f"<tbody>{body}</tbody></table>"
    )


def _row(
    name: str, stage: str, metrics: MethodMetrics, num_prior_peaks: int | None, colour: str
) -> str:
    swatch = f'<span class="swatch" style="background:{colour}"></span>' if colour else ""
    peaks = MISSING if num_prior_peaks is None else counted(num_prior_peaks, "peak")
    cells = [
        swatch + escape(name),
        escape(stage) or MISSING,
        _sum(_count(metrics.num_repairs), _count(metrics.num_detections)),
        _sum(
            None if metrics.num_repairs is None else f"{metrics.repair_s:.2f}",
            None if metrics.num_detections is None else f"{metrics.detection_s:.2f}",
        ),
        _count(metrics.misses) or MISSING,
        _count(metrics.false_alarms) or MISSING,
        *(value_text(getattr(metrics, name), each.digits) for name, each in SIGNAL_METRICS.items()),
        peaks,
    ]
    return row_html(cells)


def _count(number: int | None) -> str | None:
    return None if number is None else str(number)


def _sum(first: str | None, second: str | None) -> str:
    parts = [part for part in (first, second) if part is not None]
    return " + ".join(parts) or MISSING


def _present(picture: ComparePicture) -> FrameResult:
    method_runs = tuple(view.metrics for view in picture.method_runs)
    return FrameResult(frame_number=picture.frame_number, method_runs=method_runs)


def _curve(results: Sequence[FrameResult], number: int, names: Sequence[str]) -> dict[str, Any]:
    """Columns of one method's curve; empty for a place without a method."""
    if number >= len(names):
        results = []
    method_runs = [result.method_runs[number] for result in results]
    return {
        "frame": [result.frame_number for result in results],
        "error": np.array([method_run.windowed_error_db for method_run in method_runs]),
        "iterations": [method_run.num_repairs or 0 for method_run in method_runs],
        "name": [names[number]] * len(method_runs) if method_runs else [],
    }
