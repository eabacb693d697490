"""Keys of the live page, and what of it is clicked to see an iteration."""

import re
from collections.abc import Callable
from typing import Any

from bokeh.models import ColumnDataSource, CustomJS

from vsep_app.assets import path
from vsep_app.widgets.sound import NAMES as HEARD

NAMES = (
    *("toggle", "step", "step_back", "reset", "ramp_back", "ramp_next"),
    *("swipe", "delete", "pin", "unpin"),
    *HEARD,
)
ITERATION_PREFIX = "iteration "
_CLICKED = re.compile(r"iteration \d{1,6}|predict \d|experiment [a-z0-9-]{1,64}")


class Keys:
    """Hands keys and clicks to the program; `source` is drawn with all pictures.

    `press` is called with one of `NAMES`, or with a prefix and what was clicked: a bead of the
    timeline, a card of an experiment, a prediction. The keys ``?``, which opens the help, and
    ``F``, the projector mode, never leave the browser.
    """

    def __init__(self, source: ColumnDataSource, press: Callable[[str], object]) -> None:
        self._press = press
        self.pressed = ColumnDataSource({"name": [""], "number": [0]}, name="pressed")
        self.pressed.on_change("data", self._taken)
        code = path("page/keys.js").read_text(encoding="utf-8")
        source.js_on_change("data", CustomJS(args={"pressed": self.pressed}, code=code))

    def _taken(self, attr: str, old: Any, new: Any) -> None:
        del attr, old
        name = str(new["name"][0])
        if name in NAMES or _CLICKED.fullmatch(name):
            self._press(name)
