"""Downloads, and links to other pages of the document."""

import base64
from typing import Any

from bokeh.models import ColumnDataSource, CustomJS

_OPEN = 'window.dispatchEvent(new CustomEvent("vsep-go", {detail: link.data.place[0]}))'
_SAVE = """
const [name, kind, data] = [file.data.name[0], file.data.kind[0], file.data.data[0]]
const bytes = Uint8Array.from(atob(data), (letter) => letter.charCodeAt(0))
const link = document.createElement("a")
link.href = URL.createObjectURL(new Blob([bytes], {type: kind}))
link.download = name
link.click()
setTimeout(() => URL.revokeObjectURL(link.href), 10000)
"""


class Download:
    """Sends files to the browser, which saves them under their names.

    The download buttons of the libraries keep still when the same content is asked for again.
    """

    def __init__(self) -> None:
        self._number = 0
        self.source = ColumnDataSource(
            {"number": [0], "name": [""], "kind": [""], "data": [""]}, name="file", syncable=False
        )
        self.source.js_on_change("data", CustomJS(args={"file": self.source}, code=_SAVE))

    def join(self, button: Any, code: str = "") -> None:
        """Make the files part of the page that has this button; a click also runs the code."""
        button.js_on_click(args={"file": self.source}, code=code)

    def send(self, name: str, kind: str, content: bytes) -> None:
        """Have the browser save a file; called with the document locked."""
        self._number += 1
        text = base64.b64encode(content).decode()
        self.source.data = {
            "number": [self._number],
            "name": [name],
            "kind": [kind],
            "data": [text],
        }


class Link:
    """A place that the browser is sent to when the server says so.

    A button that the user clicks makes the link part of the page.
    """

    def __init__(self, button: Any) -> None:
        self.source = ColumnDataSource({"place": [""]}, name="link", syncable=False)
        self.source.js_on_change("data", CustomJS(args={"link": self.source}, code=_OPEN))
        button.js_on_click(args={"link": self.source}, code="")

    def open(self, place: str) -> None:
        """Open an address; called with the document locked."""
        self.source.data = {"place": [place]}
