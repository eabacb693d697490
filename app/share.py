"""Two buttons of the live view: a snapshot of the run as a file, and the link to what is shown."""

import asyncio
import base64
from collections.abc import Callable
from concurrent.futures import Executor
from typing import Any

import panel as pn
import panel_material_ui as pmu
from bokeh.models import ColumnDataSource, CustomJS

from app.report.snapshot import KINDS, SnapshotFile
from vsep._arrays import InputError

LARGEST_FILE = 12 * 2**20
"""What a browser is sent at once; the connection takes messages of 20 MiB, and text is longer."""

_LOOK = {"variant": "text", "size": "small", "sx": {"color": "white"}, "margin": (0, 2)}
_SAVE = """
const [name, kind, data] = [file.data.name[0], file.data.kind[0], file.data.data[0]]
const bytes = Uint8Array.from(atob(data), (letter) => letter.charCodeAt(0))
const link = document.createElement("a")
link.href = URL.createObjectURL(new Blob([bytes], {type: kind}))
link.download = name
link.click()
setTimeout(() => URL.revokeObjectURL(link.href), 10000)
"""
# The clipboard is for secure pages; a class opens this one by the server's bare address.
_COPY = """
const copied = () => {
  const field = document.createElement("textarea")
  field.value = location.href
  document.body.append(field)
  field.select()
  document.execCommand("copy")
  field.remove()
}
if (navigator.clipboard) navigator.clipboard.writeText(location.href).catch(copied)
else copied()
"""


class Share:
    """The buttons, and what a click on them does.

    Parameters
    ----------
    make : callable
        Takes a key of `KINDS` and returns what makes the file, None while there is no run; that is
        called in the pool and may raise `InputError`.
    pool : Executor
        Makes the file.
    post : callable
        Runs a function with the document locked.
    tell, complain : callable
        Notify the user of a sentence; called with the document locked.
    """

    def __init__(
        self,
        make: Callable[[str], Callable[[], SnapshotFile] | None],
        *,
        pool: Executor,
        post: Callable[[Callable[[], None]], Any],
        tell: Callable[[str], None],
        complain: Callable[[str], None],
    ) -> None:
        self._make, self._pool, self._post = make, pool, post
        self._tell, self._complain = tell, complain
        self._tasks: set[asyncio.Task[None]] = set()
        self.snapshot = pmu.MenuButton(
            label="Snapshot",
            icon="photo_camera",
            items=[{"label": label, "key": key} for key, label in KINDS.items()],
            description="Snapshot: this iteration as a page, a picture, or its frame and numbers.",
            **_LOOK,
        )
        self.snapshot.on_click(self._chosen)
        self.link = pmu.Button(
            label="Copy link",
            icon="link",
            description="Copy link: whoever opens it sees this scene, these settings and, while "
            "the run is paused, this iteration.",
            **_LOOK,
        )
        self.link.on_click(lambda _: tell("The link is copied."))
        self.file = ColumnDataSource(
            {"name": [""], "kind": [""], "data": [""]}, name="file", syncable=False
        )
        self.file.js_on_change("data", CustomJS(args={"file": self.file}, code=_SAVE))
        # The source belongs to the page by being an argument.
        self.link.js_on_click(args={"file": self.file}, code=_COPY)

    def layout(self) -> Any:
        """Return both buttons."""
        return pn.Row(self.snapshot, self.link, margin=0, align="center")

    def close(self) -> None:
        """Stop for good: the browser has left."""
        for task in self._tasks:
            task.cancel()

    def _chosen(self, item: Any) -> None:
        make = self._make(item["key"])
        if make is None:
            self._complain("There is no run yet; wait for its first picture.")
            return
        self._tell("Making the snapshot.")
        task = asyncio.get_running_loop().create_task(self._deliver(make))
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)

    async def _deliver(self, make: Callable[[], SnapshotFile]) -> None:
        try:
            made = await asyncio.get_running_loop().run_in_executor(self._pool, make)
        except InputError as error:
            sentence = str(error)
            self._post(lambda: self._complain(sentence))
            return
        if len(made.content) > LARGEST_FILE:
            self._post(
                lambda: self._complain(
                    f"{made.name} is too large for the browser; write it with `vsep report`."
                )
            )
            return
        self._post(lambda: self._send(made))

    def _send(self, made: SnapshotFile) -> None:
        text = base64.b64encode(made.content).decode()
        self.file.data = {"name": [made.name], "kind": [made.kind], "data": [text]}
