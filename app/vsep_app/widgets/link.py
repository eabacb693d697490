"""Opens another page of the program in a new tab of the browser."""

from typing import Any

from bokeh.models import ColumnDataSource, CustomJS

# Where the browser does not let a page open tabs, this one is left.
_OPEN = "const place = link.data.place[0]\nif (!window.open(place)) { location.assign(place) }"


class Link:
    """A place that the browser is sent to when the server says so.

    Parameters
    ----------
    button : Widget
        What the user clicks; it makes the link part of the page.
    """

    def __init__(self, button: Any) -> None:
        self.source = ColumnDataSource({"place": [""]}, name="link", syncable=False)
        self.source.js_on_change("data", CustomJS(args={"link": self.source}, code=_OPEN))
        button.js_on_click(args={"link": self.source}, code="")

    def open(self, place: str) -> None:
        """Open an address; called with the document locked."""
        self.source.data = {"place": [place]}
