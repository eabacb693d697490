"""The report as one HTML document: the views of the dashboard, which stay interactive."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from bokeh.models import Span

from vsep_app.figures.document import document_html
from vsep_app.model.picture import Picture
from vsep_app.model.text import counted
from vsep_app.report.metadata import for_html
from vsep_app.report.run import ReportRun, listed_settings, provenance
from vsep_app.views.progress import ProgressView
from vsep_app.views.ramps import RampStrip
from vsep_app.views.range_doppler import RangeDopplerView
from vsep_app.views.signals import DelayView, FastTimeView
from vsep_app.views.style import Axis
from vsep_app.views.tables import layers_html, log_html, table_html


class ReportViews:
    """The views of the dashboard for a document of its own; a map needs several ramps."""

    def __init__(self, *, several: bool) -> None:
        range_axis, crosshair = Axis(), Span(dimension="height", line_color="#8C8C8C")
        self._fast_time = FastTimeView(legend=True)
        self._delay = DelayView(range_axis, crosshair, legend=True)
        self._maps = RangeDopplerView(range_axis, crosshair)
        self._strip, self._progress = RampStrip(), ProgressView()
        sized: list[tuple[Any, int]] = [(self._fast_time.figure, 250), (self._delay.figure, 290)]
        sized += zip(self._progress.figures, (90, 90, 120), strict=True)
        if several:
            sized += [(self._strip.figure, 64), (self._maps.before, 340), (self._maps.after, 340)]
        for plot, height in sized:
            plot.update(sizing_mode="stretch_width", height=height)
        self.plots = [plot for plot, _ in sized]
        self._drawn: list[Any] = [self._delay, self._progress, self._fast_time]
        self._drawn += [self._maps, self._strip] if several else []

    def update(self, picture: Picture) -> None:
        """Draw another picture."""
        for view in self._drawn:
            view.update(picture)


def report_html(run: ReportRun) -> str:
    """Return the report as one HTML document that asks for nothing else."""
    picture = run.picture()
    several = picture.static_picture.radar.num_ramps > 1
    views = ReportViews(several=several)
    views.update(picture)
    filmstrip, frames = _filmstrip(run.filmstrip(), several=several)
    return document_html(
        [*views.plots, *filmstrip],
        template="report.html",
        title=f"vsep: {picture.static_picture.title}",
        variables={"filmstrip": frames, **page_variables(run, picture)},
    )


def page_variables(run: ReportRun, picture: Picture) -> dict[str, Any]:
    """Return what report and recorded run say in words."""
    several = picture.static_picture.radar.num_ramps > 1
    return {
        "heading": f"vsep: {picture.static_picture.title}",
        "outcome": outcome(picture),
        "levels": picture.static_picture.levels_text,
        "table": table_html(picture.table, moving=several) + layers_html(picture),
        "log": log_html(picture.log),
        "settings": list(listed_settings(run).items()),
        "provenance": for_html(provenance(run)),
    }


def outcome(picture: Picture) -> str:
    """Say in one line how the run ended."""
    return f"{picture.iteration} iterations, {picture.termination.value}. {found(picture)}."


def found(picture: Picture) -> str:
    """Say in a few words what is found so far."""
    bursts = int(np.isfinite(picture.burst_level_db).sum())
    objects = counted(len(picture.objects.ranges_m), "object")
    if groups := len(picture.groups.lines):
        objects = f"{objects}, {counted(groups, 'extended one')}"
    return f"{objects}, bursts in {bursts} of {counted(len(picture.true_ramps), 'ramp')}"


def _filmstrip(
    pictures: Sequence[Picture], *, several: bool
) -> tuple[list[Any], list[dict[str, str]]]:
    """Return the figures of a filmstrip, and the caption and name of each of its frames."""
    range_axis, crosshair = Axis(), Span(dimension="height", line_color="#8C8C8C")
    plots, frames = [], []
    for number, picture in enumerate(pictures):
        fast_time, delay = FastTimeView(), DelayView(range_axis, crosshair)
        maps = RangeDopplerView(range_axis, crosshair)
        own = [(fast_time.figure, 150), (delay.figure, 170)]
        own += [(maps.after, 190)] if several else []
        for view in (delay, fast_time, *((maps,) if several else ())):
            view.update(picture)
        name = f"filmstrip-{number}-"
        for plot, height in own:
            plot.update(sizing_mode="stretch_width", height=height, name=name + plot.name)
            plots.append(plot)
        objects = counted(len(picture.objects.ranges_m), "object")
        caption = f"Iteration {picture.iteration}: {objects}"
        frames.append({"name": name, "caption": caption})
    return plots, frames
