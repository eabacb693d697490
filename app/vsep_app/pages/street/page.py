"""Page of the street: frames separated as they come, twenty a second."""

import time
from typing import Any
from urllib.parse import parse_qsl, urlencode

import panel as pn
from bokeh.models import ColumnDataSource, CustomJS

from vsep.presets.street_settings import STREET_PARAMETERS, STREET_RANGES, STREET_SETTINGS
from vsep.signal.motion import CYCLE_S
from vsep_app.jobs.stream_loop import Punctuality, StreamLoop, StreamSink
from vsep_app.model.settings import Settings
from vsep_app.model.url import QUERY_NAMES, parse_query
from vsep_app.pages.base import PageBase, PageContext, PageParts
from vsep_app.pages.street.tasks import StreetPicture, StreetPlan, play_street
from vsep_app.pages.street.views import (
    FrameTimes,
    StreetMaps,
    punctuality_text,
    sentence_of,
    tracks_html,
)
from vsep_app.widgets.controls import FilterControls
from vsep_app.widgets.fault import FaultNotice
from vsep_app.widgets.fields import tool_button
from vsep_app.widgets.headline import Headline
from vsep_app.widgets.layout import card, heading, html_pane, panel, stack, status_pane, toolbar
from vsep_app.widgets.location import set_query
from vsep_app.widgets.setting_widgets import setting_widget

SCENE = ("snr_db", "sir_db", "interferer_slope", "seed", "interference")
DETECTION = ("false_alarm_rate", "object_threshold_db")
TELL_EVERY_S = 0.2  # nobody reads a table that changes twenty times a second
PAUSE_TEXT, PLAY_TEXT = "Pause: let no further frame come.", "Play: let frames come again."
QUERY_KEY = "street"  # of the address: all that is not as usual
_DRAWN = """
requestAnimationFrame(() => setTimeout(() => {
  drawn.data = {number: [drawn.data.number[0] + 1]}
}, 0))
"""


class StreetPage(PageBase):
    """One user's page of the street."""

    address = "street"

    def __init__(self, context: PageContext) -> None:
        super().__init__(context)
        # The scenes of the other pages have levels of their own.
        own = dict(parse_qsl(str(context.query.get(QUERY_KEY, ""))))
        values, self._errors = parse_query(own)
        self.settings = Settings(**{**STREET_SETTINGS, **values})
        self._usual = Settings(**STREET_SETTINGS)
        self.fault = FaultNotice()
        self._told_at = 0.0
        self.maps, self.times, self.headline = StreetMaps(), FrameTimes(), Headline()
        self.table = html_pane("tables", tracks_html(()), margin=(0, 8))
        self.status = status_pane("loading")
        self._make_controls()
        self._make_acknowledgement()
        self.loop = StreamLoop(
            play_street,
            self._plan,
            StreamSink(
                post=context.post,
                show=self.show,
                notify_error=self._failed,
                watched=context.watched,
            ),
            context.pool,
            period_s=CYCLE_S,
            background=context.background,
        )
        self.settings.param.watch(lambda *_: self._restart(), "seed")
        self.settings.param.watch(lambda *_: self._write_address(), [*self.widgets])

    def _make_controls(self) -> None:
        records = [STREET_PARAMETERS[name] for name in (*SCENE, *DETECTION)]
        self.widgets = {each.name: setting_widget(self.settings, each) for each in records}
        self._filters = FilterControls(self.settings)
        self.widgets |= self._filters.widgets
        self.widgets["seed"].param.update(sizing_mode=None, width=116)
        self.widgets["interference"].margin = (8, 0, 0, 0)
        for name, (start, end) in STREET_RANGES.items():
            value = getattr(self.settings, name)
            self.widgets[name].param.update(start=min(start, value), end=max(end, value))
        self._filters.offer_measured(self.settings, offered=False)
        kinds = ["filter_kind", "assumed_kind", "assume_true_filter", "interference"]
        self.settings.param.watch(lambda *_: self._arrange(), kinds)
        self._arrange()
        self.play = tool_button("Pause", "pause", PAUSE_TEXT)
        self.play.on_click(lambda _: self._toggle())
        text = "Restart: begin again with the first frame of this street."
        self.again = tool_button("Restart", "replay", text)
        self.again.on_click(lambda _: self._restart())

    def _make_acknowledgement(self) -> None:
        """Let the browser say when it has drawn a picture."""
        self._drawn = ColumnDataSource({"number": [0]}, name="drawn")
        self._drawn.on_change("data", self._was_drawn)
        self.maps.source.js_on_change("data", CustomJS(args={"drawn": self._drawn}, code=_DRAWN))

    def page(self) -> Any:
        """Return the whole page."""
        maps = (card(plot, weight=1, look="strip") for plot in (self.maps.before, self.maps.after))
        views = stack(
            stack(*maps, weight=13, row=True, sheet="maps"),
            stack(
                card(self.times.figure, weight=10),
                panel("Tracks", self.table, weight=9),
                weight=9,
                row=True,
                sheet="maps",
            ),
        )
        self.fault.cover(views)
        self._count = html_pane("study", margin=(15, 10), min_width=220, sizing_mode=None)
        return PageParts(
            description="A street with other radars, separated at the pace of the radar.",
            status=self.status,
            sidebar=[
                heading("Scene"),
                *(self.widgets[name] for name in SCENE[:-2]),
                pn.Row(*(self.widgets[name] for name in SCENE[-2:]), sizing_mode="stretch_width"),
                *self._filters.layout(),
                heading("Detection"),
                *(self.widgets[name] for name in DETECTION),
            ],
            main=[
                toolbar(self.play, self.again, self._count),
                self.headline.layout(),
                self.fault.pane,
                views,
            ],
        )

    def start(self) -> None:
        """Begin to play; called when the page has been drawn."""
        for error in self._errors:
            self.notify_error(error)
        self._write_address()
        self.loop.start()

    def _plan(self) -> StreetPlan:
        """Return what the next frame is made with."""
        names = [*self.widgets]
        return StreetPlan(values={name: getattr(self.settings, name) for name in names})

    def _arrange(self) -> None:
        """Show what has a meaning beside the other settings."""
        self._filters.arrange(self.settings, loaded=False)
        for name in ("sir_db", "interferer_slope"):
            self.widgets[name].disabled = not self.settings.interference

    def _write_address(self) -> None:
        """Keep what is not as usual in the address, so that it can be shared."""
        changed = {
            QUERY_NAMES[name]: str(getattr(self.settings, name))
            for name in self.widgets
            if getattr(self.settings, name) != getattr(self._usual, name)
        }
        set_query(self._context.location, QUERY_KEY, urlencode(changed) if changed else None)

    def _toggle(self) -> None:
        """Pause or go on."""
        if self.loop.is_playing:
            self.loop.pause()
        else:
            self.loop.resume()
        self._show_button()

    def _show_button(self) -> None:
        playing = self.loop.is_playing
        self.play.param.update(
            label="Pause" if playing else "Play",
            icon="pause" if playing else "play_arrow",
            description=PAUSE_TEXT if playing else PLAY_TEXT,
        )

    def _restart(self) -> None:
        """Begin again with the first frame."""
        self.times.clear()
        self.loop.restart()
        self._show_button()

    def _failed(self, sentence: str) -> None:
        """Say above the views what cannot be computed; called with the document locked."""
        self.fault.tell(sentence, shown=(0, self.loop.number))
        self._show_button()

    def _was_drawn(self, attr: str, old: Any, new: Any) -> None:
        del attr, old, new
        self.loop.acknowledged()

    def close(self) -> None:
        """Stop for good: the browser has left."""
        self.loop.close()

    def show(self, picture: StreetPicture, punctuality: Punctuality) -> None:
        """Draw a picture on all views; called with the document locked."""
        with pn.io.hold():
            self.fault.clear(shown=(0, picture.number))
            self.maps.show(picture)
            if time.monotonic() - self._told_at > TELL_EVERY_S or not self.loop.is_playing:
                self._told_at = time.monotonic()
                self.table.object = tracks_html(picture.tracks)
                self.headline.tell(sentence_of(picture))
                self._count.object = f'<span class="status">{punctuality_text(punctuality)}</span>'
                self._show_status(picture)
            self.times.show(picture)

    def _show_status(self, picture: StreetPicture) -> None:
        word = "playing" if self.loop.is_playing else "paused"
        self.status.object = (
            f'<span><strong role="status">{word}</strong>'
            f'<span class="counts">&nbsp; frame {picture.number} · '
            f"{len(picture.tracks)} objects</span></span>"
        )
