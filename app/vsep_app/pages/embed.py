"""One view of a run with its play button and nothing else, for slides and other web pages."""

import json
from typing import Any

import panel as pn
from bokeh.models import ColumnDataSource, CustomJS

from vsep_app.assets import path
from vsep_app.jobs.run_session import Phase
from vsep_app.model.picture import Picture
from vsep_app.pages import EMBED
from vsep_app.pages.base import PageContext
from vsep_app.pages.live import Dashboard
from vsep_app.widgets.fields import tool_button
from vsep_app.widgets.keys import ITERATION_PREFIX, Keys
from vsep_app.widgets.layout import card, stylesheet, theme, unseen_title

VIEW_KEY = "view"
VIEWS = ("maps", "delay", "fast_time", "chirps")
"""What an address can ask for as `view`; the maps need several ramps."""
_PLAY = ("Play", "play_arrow"), ("Pause", "pause")


class EmbedPage(Dashboard):
    """The page that stands in a frame; it speaks with the page around it, see `embed.js`."""

    address = "embed"

    def __init__(self, context: PageContext) -> None:
        super().__init__(context)
        asked = str(context.query.get(VIEW_KEY, VIEWS[0]))
        if asked not in VIEWS:
            self._errors.append(f"view is {asked!r:.40}; it must be one of {', '.join(VIEWS)}.")
        self.view = asked if asked in VIEWS else VIEWS[0]
        text = "Play: go on with the iterations."
        self.play = tool_button("Play", "play_arrow", text, theme_config=theme())
        self.play.on_click(lambda _: self.press("toggle"))
        self.keys = Keys(self.press)
        #: What the page around this one is told with every picture.
        self.told = ColumnDataSource({"state": ["{}"]}, name="told", syncable=False)

    def page(self) -> Any:
        """Return the whole page."""
        self.views.layout()
        figures = {
            "maps": self.views.map.after,
            "delay": self.views.delay.figure,
            "fast_time": self.views.fast_time.figure,
            "chirps": self.views.crossing.figure,
        }
        plot, drawn = figures[self.view], self.views.fast_time.source
        column = drawn.column_names[0]
        # What nothing draws is not sent; the browser answers to this source, whatever is shown.
        plot.scatter(column, column, source=drawn, visible=False)
        self.keys.join(self.play)
        self.keys.tell(EMBED.title, has_scene=True)
        code = path("page/embed.js").read_text(encoding="utf-8")
        speak = CustomJS(args={"told": self.told, "pressed": self.keys.pressed}, code=code)
        for source in (drawn, self.told):  # in whichever order a picture brings them
            source.js_on_change("data", speak)
        # It listens from the beginning on.
        if pn.state.curdoc is not None:
            pn.state.curdoc.js_on_event("document_ready", speak)
        return pn.Column(
            unseen_title("vsep: one view"),
            self.play,
            self.fault.pane,
            card(plot, weight=1, look="view"),
            margin=0,
            sizing_mode="stretch_both",
            stylesheets=[stylesheet("embed")],
        )

    def close(self) -> None:
        """Stop for good: the browser has left."""
        self.keys.close()
        super().close()

    def show(self, picture: Picture) -> None:
        """Draw a picture, and tell the page around this one of it."""
        self.told.data = {"state": [json.dumps(self._state(picture))]}
        super().show(picture)
        running = self.session.phase is Phase.RUNNING
        label, icon = _PLAY[running]
        self.play.param.update(
            label=label, icon=icon, disabled=self.session.phase is Phase.FINISHED
        )

    def _state(self, picture: Picture) -> dict[str, Any]:
        score = picture.score
        return {
            "iteration": picture.iteration,
            "iterations": picture.num_iterations,
            "plays": self.session.phase is Phase.RUNNING,
            "ended": picture.termination.name.lower(),
            "headline": picture.headline,
            "found": None if score is None else score.num_found,
            "false": None if score is None else score.num_false,
            "events": [line.text for line in picture.log if line.iteration == picture.iteration],
        }

    def _waits(self) -> bool:
        return False

    def press(self, name: str) -> None:
        """Do what a key or the page around this one asks for; it may ask for any iteration."""
        if name.startswith(ITERATION_PREFIX):
            self.session.run_to(int(name.removeprefix(ITERATION_PREFIX)))
            self.loop.wake()
        elif name == "toggle":
            super().press(name)
