"""Views of a recording: one ramp, all maps, and the facts known of it."""

from collections.abc import Callable
from typing import Any

import panel as pn
from bokeh.models import ColumnDataSource, CustomJS, Span

from vsep_app.model.picture import Picture
from vsep_app.model.text import LogLine, TableRow
from vsep_app.pages.recording.maps import RecordingMaps
from vsep_app.pages.recording.tasks import RecordingOpening
from vsep_app.pages.recording.text import facts_html
from vsep_app.views.ramps import RampStrip
from vsep_app.views.signals import DelayView, FastTimeView
from vsep_app.views.style import Axis
from vsep_app.views.tables import log_html, table_html
from vsep_app.widgets.download import Download
from vsep_app.widgets.exports import download_buttons
from vsep_app.widgets.layout import card, panel, stylesheet, unseen_title
from vsep_app.widgets.transport import Transport

SHOWN_LINES = 60
_SAY_SO = """
const number = drawn.data.number[0] + 1
requestAnimationFrame(() => setTimeout(() => { drawn.data = {number: [number]} }, 0))
"""


class RecordingView:
    """Views and panels.

    Parameters
    ----------
    select : callable
        Called with the ramp that was clicked.
    acknowledged : callable
        Bokeh's callback for a picture that the browser has drawn.
    """

    def __init__(
        self, select: Callable[[int], None], acknowledged: Callable[[str, Any, Any], None]
    ) -> None:
        range_axis = Axis()
        crosshair = Span(dimension="height", line_dash=[4, 3], line_color="#8C8C8C")
        self.ramps = RampStrip(select)
        self.fast_time = FastTimeView()
        self.delay = DelayView(range_axis, crosshair)
        self.maps = RecordingMaps(range_axis, crosshair)
        self.facts = pn.pane.HTML("", sizing_mode="stretch_both", stylesheets=[stylesheet("facts")])
        self.table, self.log = (
            pn.pane.HTML("", sizing_mode="stretch_both", stylesheets=[stylesheet("tables")])
            for _ in range(2)
        )
        self._picture: Picture | None = None
        self._drawn = ColumnDataSource({"number": [0]}, name="drawn")
        self._drawn.on_change("data", acknowledged)
        self.fast_time.source.js_on_change(
            "data", CustomJS(args={"drawn": self._drawn}, code=_SAY_SO)
        )

    def layout(self, title: str, transport: Transport) -> Any:
        """Return all below the header."""
        view = self.maps.view
        self._strip = card(self.ramps.figure, weight=0, height=62, look="strip")
        signals = (
            card(self.fast_time.figure, weight=6, look="strip", key=FastTimeView.untrue_key),
            card(self.delay.figure, weight=5, look="strip", key=DelayView.untrue_key),
        )
        for each in signals:
            each[-1].css_classes = ["narrow"]
        self._reference = card(self.maps.reference, weight=1, look="strip")
        self._reference.visible = False
        maps = (card(view.before, weight=1, look="strip"), card(view.after, weight=1, look="strip"))
        self._map_row = _row(*maps, self._reference, weight=14, look="maps")
        views = pn.Column(
            self._strip,
            _row(*signals, weight=11, look="maps"),
            self._map_row,
            sizing_mode="stretch_both",
            margin=0,
            styles={"flex": "28 1 0", "min-height": "0"},
            stylesheets=[stylesheet("column")],
        )
        return pn.Column(
            unseen_title(title),
            transport.layout(stylesheet("transport")),
            views,
            _row(*self._panels(), weight=8, look="body"),
            margin=0,
            sizing_mode="stretch_width",
            stylesheets=[stylesheet("main")],
        )

    def show(self, picture: Picture, opening: RecordingOpening) -> None:
        """Draw a picture of a recording; called with the document locked."""
        self._picture = picture
        several = picture.static_picture.radar.num_ramps > 1
        self._map_row.visible = self._strip.visible = several
        reference = opening.reference_maps.get(picture.static_picture.antenna.number)
        self._reference.visible = several and reference is not None
        if several:
            self.ramps.update(picture)
            self.maps.view.update(picture)
            self.maps.show_reference(picture.static_picture, reference)
        self.delay.update(picture)
        self.table.object = table_html(picture.table, moving=several)
        self.log.object = log_html(picture.log[-SHOWN_LINES:])
        self.fast_time.update(picture)

    def show_facts(self, opening: RecordingOpening | None, fault: str) -> None:
        """Say what is shown, and why what is set now cannot be."""
        self.facts.object = facts_html(opening, fault)

    def _panels(self) -> list[Any]:
        download = Download()
        return [
            panel("Recording", self.facts, weight=9),
            panel(
                "Objects: estimate ± standard deviation",
                self.table,
                weight=10,
                tools=download_buttons("objects", TableRow, self._table_shown, download),
            ),
            panel(
                "Events",
                self.log,
                weight=9,
                tools=download_buttons("events", LogLine, self._log_shown, download),
            ),
        ]

    def _table_shown(self) -> tuple[TableRow, ...]:
        return () if self._picture is None else self._picture.table

    def _log_shown(self) -> tuple[LogLine, ...]:
        return () if self._picture is None else self._picture.log


def _row(*content: Any, weight: int, look: str) -> Any:
    return pn.Row(
        *content,
        sizing_mode="stretch_both",
        margin=0,
        styles={"flex": f"{weight} 1 0", "min-height": "0"},
        stylesheets=[stylesheet(look)],
    )
