"""Scatter of single trials, each with a link to the live view.

Trials only come to a study, they never change: new dots are streamed to those that are there.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from html import escape
from typing import Any
from urllib.parse import quote

from bokeh.models import ColumnDataSource, CustomJS, HoverTool, TapTool

from vsep.studies.axes import x_label
from vsep.studies.catalogue import panel_specs
from vsep.studies.panel_specs import PanelSpec
from vsep.studies.scatter import Scatter, scatter
from vsep.studies.trial import Row
from vsep_app.figures.backends import bokeh_figure
from vsep_app.figures.study_elements import Mark, overlay, points
from vsep_app.figures.study_style import colour, marker
from vsep_app.model.trial_link import TRIAL_KEY, trial_link
from vsep_app.views.style import dress, empty_figure
from vsep_app.widgets.layout import card, html_pane

NUM_WORST = 12
# A tap reports every method that has a dot there; only the first one is opened.
_OPEN = """
const source = cb_data.source
const index = source.selected.indices[0]
source.selected.indices = []
const link = source.data.link[index]
if (!link || performance.now() - (window.vsep_opened ?? -1e6) < 500) { return }
window.vsep_opened = performance.now()
window.dispatchEvent(new CustomEvent("vsep-go", {detail: "./?KEY=" + encodeURIComponent(link)}))
""".replace("KEY", TRIAL_KEY)


@dataclass(frozen=True, kw_only=True)
class ScatterChoice:
    """Which trials are shown: of which study and panel, and which of their values."""

    study: str
    panel: str
    value: str

    @property
    def x(self) -> str:
        """The parameter over which the panel is drawn; examples have no curves over any."""
        return next((spec.x for spec in self._specs), "sir_db")

    @property
    def log_x(self) -> bool:
        """Whether that parameter has a logarithmic axis."""
        return any(spec.log_x for spec in self._specs)

    @property
    def _specs(self) -> list[PanelSpec]:
        return [spec for spec in panel_specs(self.study) if spec.panel == self.panel]


@dataclass(frozen=True, kw_only=True)
class Dots:
    """The dots of a choice, method by method."""

    choice: ScatterChoice
    by_method: Mapping[str, Scatter]


def make_dots(rows: Iterable[Row], choice: ScatterChoice) -> Dots:
    """Gather the dots of a choice from the rows of its study."""
    rows = list(rows)
    methods = dict.fromkeys(row["method"] for row in rows)
    return Dots(
        choice=choice,
        by_method={
            method: scatter(rows, choice.value, panel=choice.panel, method=method, x=choice.x)
            for method in methods
        },
    )


class StudyScatter:
    """The dots, and a table of the trials with the largest values."""

    def __init__(self) -> None:
        self._drawn: tuple[ScatterChoice, tuple[str, ...]] | None = None
        self._sources: dict[str, ColumnDataSource] = {}
        self.card = card(empty_figure(), weight=11)
        self.worst = html_pane("study", worst_html([]))

    def show(self, dots: Dots) -> None:
        """Show dots; those that are there stay."""
        drawn = dots.choice, tuple(dots.by_method)
        if not dots.by_method:
            self.card.objects[0].object, self._drawn = empty_figure(), None
        elif drawn != self._drawn or self._has_lost(dots):
            self._draw(dots)
            self._drawn = drawn
        else:
            for method, found in dots.by_method.items():
                source = self._sources[method]
                held = len(source.data["x"])
                if held < len(found.x):
                    source.stream(_columns(method, dots, held))
        self.worst.object = worst_html(worst_rows(dots))

    def _has_lost(self, dots: Dots) -> bool:
        """Whether these are the dots of another run: a link names a trial and its seed."""
        for method, found in dots.by_method.items():
            links = self._sources[method].data["link"]
            if len(found.rows) < len(links):
                return True
            if len(links) and links[-1] != trial_link(found.rows[len(links) - 1]):
                return True
        return False

    def _draw(self, dots: Dots) -> None:
        self._sources = {}
        choice = dots.choice
        plot = bokeh_figure(
            overlay(
                [_mark(method, dots) for method in dots.by_method],
                "bokeh",
                xlabel=x_label(choice.x),
                ylabel=choice.value,
                logx=choice.log_x,
                logy="error" in choice.value,
            )
        )
        dress(plot)
        plot.update(width=None, height=None, sizing_mode="stretch_both", name="study-trials")
        for method, renderer in zip(dots.by_method, plot.renderers, strict=True):
            renderer.data_source.name = f"trials-{method}"
            self._sources[method] = renderer.data_source
        plot.add_tools(
            TapTool(renderers=plot.renderers, callback=CustomJS(code=_OPEN), visible=False)
        )
        for tool in plot.select({"type": HoverTool}):
            tool.visible = False
        self.card.objects[0].object = plot


def _mark(method: str, dots: Dots) -> Mark:
    tips = "@method: point @point, realization @realization, @y; click to open"
    text = tips.replace("@method", method)
    look = points(marker(method), colour(method), size=6, alpha=0.25, tips=text)
    return Mark("Scatter", _columns(method, dots, 0), 1, look)


def _columns(method: str, dots: Dots, start: int) -> dict[str, Any]:
    """Return the dots of a method from one on, set beside those of the other methods."""
    found = dots.by_method[method]
    rows = found.rows[start:]
    place = list(dots.by_method).index(method) - 0.5 * (len(dots.by_method) - 1)
    levels = found.x[start:]
    beside = levels * 1.06**place if dots.choice.log_x else levels + 0.7 * place
    return {
        "x": beside,
        "y": found.y[start:],
        "level": levels,
        "point": [row["point_index"] for row in rows],
        "realization": [row["realization"] for row in rows],
        "link": [trial_link(row) for row in rows],
    }


def worst_rows(dots: Dots) -> list[tuple[float, Row]]:
    """Return the trials with the largest values, largest first."""
    pairs = [
        (float(value), row)
        for found in dots.by_method.values()
        for value, row in zip(found.y, found.rows, strict=True)
    ]
    return sorted(pairs, key=lambda pair: -pair[0])[:NUM_WORST]


def worst_html(worst: Sequence[tuple[float, Row]]) -> str:
    """Return the table of those trials; each is a link that opens it in the live view."""
    if not worst:
        return '<p class="empty">No trial yet.</p>'
    lines = "".join(
        f"<tr><td>{_trial_html(row)}</td>"
        f"<td>{escape(row['method'])}</td><td>{row['point']['snr_db']:g}</td>"
        f"<td>{row['point']['sir_db']:g}</td><td>{value:.3g}</td></tr>"
        for value, row in worst
    )
    head = "<tr><th>trial</th><th>method</th><th>SNR</th><th>SIR</th><th>value</th></tr>"
    return f'<table class="trials"><thead>{head}</thead><tbody>{lines}</tbody></table>'


def _trial_html(row: Row) -> str:
    """Name a trial, as a link where the live view can repeat it."""
    name = f"point {row['point_index']}, realization {row['realization']}"
    link = trial_link(row)
    if not link:
        return name
    return f'<a data-go href="./?{TRIAL_KEY}={quote(link, safe="")}">{name}</a>'
