"""Keys of a document, its links, and what of it is clicked to see an iteration."""

import re
from collections.abc import Callable
from typing import Any

import panel as pn
from bokeh.models import ColumnDataSource, CustomJS

from vsep_app.assets import path
from vsep_app.widgets.sound import NAMES as HEARD

NAMES = (
    *("toggle", "step", "step_back", "reset", "ramp_back", "ramp_next"),
    *("swipe", "delete", "pin", "unpin"),
    *HEARD,
)
ITERATION_PREFIX = "iteration "
PAGE_PREFIX = "page "
_CLICKED = re.compile(
    r"iteration \d{1,6}|predict \d|experiment [a-z0-9-]{1,64}|page (?:[a-z]{1,32}|\./)"
)


class Keys:
    """Hands keys and clicks to the program.

    `press` is called with one of `NAMES`, or with a prefix and what was clicked: a bead of the
    timeline, a card of an experiment, a prediction, a link to another page; also with the page that
    the browser's history goes to. The keys ``?``, which opens the help, and ``F``, the projector
    mode, never leave the browser.
    """

    def __init__(self, press: Callable[[str], object]) -> None:
        self._press = press
        self.pressed = ColumnDataSource({"name": [""], "number": [0]}, name="pressed")
        self.pressed.on_change("data", self._taken)
        self._shown = ColumnDataSource({"number": [0]}, name="shown", syncable=False)
        self.went = ColumnDataSource({"page": [""], "search": [""], "number": [0]}, name="went")
        self.went.on_change("data", self._taken_back)
        self._sources = {"pressed": self.pressed, "went": self.went, "shown": self._shown}
        code = path("page/keys.js").read_text(encoding="utf-8")
        self._listen = CustomJS(args=self._sources, code=code)
        self._shown.js_on_change("data", self._listen)

    def join(self, button: Any) -> None:
        """Make the keys part of the document that has this button; they count once it is ready."""
        button.js_on_click(args=self._sources, code="")
        if pn.state.curdoc is not None:
            pn.state.curdoc.js_on_event("document_ready", self._listen)

    def close(self) -> None:
        """Listen no more: Panel keeps what a button's click refers to."""
        self.pressed.remove_on_change("data", self._taken)
        self.went.remove_on_change("data", self._taken_back)

    def tell(self, title: str, *, has_scene: bool) -> None:
        """Say what is seen now: its title, and whether it has a run that keys can drive."""
        number = self._shown.data["number"][0] + 1
        self._shown.data = {"title": [title], "has_scene": [has_scene], "number": [number]}

    def _taken(self, attr: str, old: Any, new: Any) -> None:
        del attr, old
        name = str(new["name"][0])
        if name in NAMES or _CLICKED.fullmatch(name):
            self._press(name)

    def _taken_back(self, attr: str, old: Any, new: Any) -> None:
        del attr, old
        name, search = f"{PAGE_PREFIX}{new['page'][0]}", str(new["search"][0])
        if _CLICKED.fullmatch(name):
            self._press(f"{name}?{search.removeprefix('?')}")
