"""Keys of the live page: run and pause, step, reset, help, and the projector mode."""

from collections.abc import Callable
from typing import Any

from bokeh.models import ColumnDataSource, CustomJS

from vsep_app.assets import path


class Keys:
    """Hands the keys that the page is pressed to the program; `source` is drawn with all pictures.

    `press` is called with ``toggle``, ``step``, ``step_back`` or ``reset``. The keys ``?``, which
    opens the help, and ``F``, the projector mode, never leave the browser.
    """

    def __init__(self, source: ColumnDataSource, press: Callable[[str], None]) -> None:
        self._press = press
        self._pressed = ColumnDataSource({"name": [""], "number": [0]}, name="pressed")
        self._pressed.on_change("data", self._taken)
        code = path("page/keys.js").read_text(encoding="utf-8")
        source.js_on_change("data", CustomJS(args={"pressed": self._pressed}, code=code))

    def _taken(self, attr: str, old: Any, new: Any) -> None:
        del attr, old
        self._press(new["name"][0])
