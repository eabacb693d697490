"""Prompt delivery of pictures between server and browser.

A picture is some dozens of small messages. Unless a connection is told otherwise, the second of
them waits until the browser has confirmed the first, which a browser with nothing to say does
after 40 ms. And a figure that is drawn again writes the same style sheets again, one for each of
its parts, whereupon the browser computes the styles of the page anew, as often.
"""

from bokeh.document import Document
from bokeh.models import CustomJS
from bokeh.server.urls import per_app_patterns
from panel.io.server import WSHandler

_WRITE_STYLES_ONCE = """
const sheet = Bokeh.require("core/dom").InlineStyleSheet.prototype
if (!sheet.writes_once) {
  const write = sheet._update
  sheet._update = function (css) { if (this.el.textContent !== css) { write.call(this, css) } }
  sheet.writes_once = true
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


def write_styles_once(document: Document) -> None:
    """Let the browser of a document leave style sheets alone that would only be the same again."""
    document.js_on_event("document_ready", CustomJS(code=_WRITE_STYLES_ONCE))
