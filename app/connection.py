"""How pictures travel: what the libraries leave slow between the server and the browser's paint.

A picture is some dozens of small messages. Unless a connection is told otherwise, the second of
them waits until the browser has confirmed the first, which a browser with nothing to say does
after 40 ms. A figure that is drawn again writes the same style sheets again, one for each of its
parts, whereupon the browser computes the styles of the page anew, as often. And it asks the styles
of the page for the colour, width and font of each of its parts, which no style sheet here sets.
"""

from typing import Any

import panel_material_ui as pmu
from bokeh.server.urls import per_app_patterns
from panel.io.server import WSHandler
from tornado.web import RequestHandler

SCRIPT = "quick.js"
_QUICK = """
{
  const sheet = Bokeh.require("core/dom").InlineStyleSheet.prototype
  const write = sheet._update
  sheet._update = function (css) { if (this.el.textContent !== css) { write.call(this, css) } }
  const visuals = Bokeh.require("core/visuals/visual").VisualProperties.prototype
  visuals._get_css_value = () => ""
}
"""


class PromptHandler(WSHandler):
    """A connection that sends small messages at once."""

    def open(self, *arguments: str, **named: str) -> None:
        """Begin to send and receive."""
        self.set_nodelay(True)
        super().open(*arguments, **named)


def connect_promptly() -> None:
    """Let all servers made from now on send small messages at once."""
    for place, (route, handler) in enumerate(per_app_patterns):
        if handler is WSHandler:
            per_app_patterns[place] = (route, PromptHandler)


class ScriptHandler(RequestHandler):
    """Answers with what every page changes of the drawing library before it draws."""

    def get(self) -> None:
        """Write the script."""
        self.set_header("Content-Type", "text/javascript")
        self.write(_QUICK)


class Page(pmu.Page):
    """A page that loads this script behind the drawing library."""

    def resolve_resources(self, *arguments: Any, **named: Any) -> Any:
        """Return the files of the page."""
        resources = super().resolve_resources(*arguments, **named)
        resources["js"]["quick"] = SCRIPT
        return resources
