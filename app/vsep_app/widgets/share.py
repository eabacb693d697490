"""Share buttons of the live view: snapshot as a file, link to what is shown."""

import asyncio
from collections.abc import Callable
from concurrent.futures import Executor
from functools import partial
from typing import Any

import panel as pn
import panel_material_ui as pmu

from vsep.errors import InputError
from vsep_app.jobs.background import BackgroundTasks
from vsep_app.report.snapshot import KINDS, SnapshotFile
from vsep_app.widgets.download import Download
from vsep_app.widgets.layout import ICON_ONLY

MAX_FILE = 12 * 2**20
"""What a browser is sent at once; the connection takes messages of 20 MiB, and text is longer."""

_LOOK = {
    "variant": "text",
    "size": "small",
    "sx": {"color": "white", "@media (max-width: 1199px)": ICON_ONLY},
    "margin": (0, 2),
}
_LINK, _LINK_COPIED, _SAID_FOR_S = "Copy link", "Link copied", 2.0
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
    notify_error : callable
        Notifies the user of a sentence; called with the document locked.
    background : BackgroundTasks
        The coroutines of the page.
    """

    def __init__(
        self,
        make: Callable[[str], Callable[[], SnapshotFile] | None],
        *,
        pool: Executor,
        post: Callable[[Callable[[], None]], Any],
        notify_error: Callable[[str], None],
        background: BackgroundTasks,
    ) -> None:
        self._make, self._pool, self._post = make, pool, post
        self._complain, self._background = notify_error, background
        self.snapshot = pmu.MenuButton(
            label="Snapshot",
            icon="photo_camera",
            items=[{"label": label, "key": key} for key, label in KINDS.items()],
            description="Snapshot: this iteration as a page, a picture, or its frame and numbers.",
            **_LOOK,
        )
        self.snapshot.on_click(self._chosen)
        self.link = pmu.Button(
            label=_LINK,
            icon="link",
            description="Copy link: whoever opens it sees this scene, these settings and, while "
            "the run is paused, this iteration.",
            **_LOOK,
        )
        self.link.on_click(self._copied)
        self.download = Download()
        self.download.join(self.link, _COPY)

    def layout(self) -> Any:
        """Return both buttons."""
        return pn.Row(self.snapshot, self.link, margin=0, align="center")

    def _chosen(self, item: Any) -> None:
        make = self._make(item["key"])
        if make is None:
            self._complain("There is no run yet; wait for its first picture.")
            return
        self.snapshot.loading = True
        self._background.begin(self._deliver(make))

    def _copied(self, *_: Any) -> None:
        self.link.label = _LINK_COPIED
        self._background.begin(self._offer_again())

    async def _offer_again(self) -> None:
        await asyncio.sleep(_SAID_FOR_S)
        self._post(partial(self.link.param.update, label=_LINK))

    async def _deliver(self, make: Callable[[], SnapshotFile]) -> None:
        try:
            made = await asyncio.get_running_loop().run_in_executor(self._pool, make)
        except InputError as error:
            self._post(partial(self._refuse, str(error)))
            return
        if len(made.content) > MAX_FILE:
            sentence = f"{made.name} is too large for the browser; write it with `vsep report`."
            self._post(partial(self._refuse, sentence))
            return
        self._post(partial(self._send, made))

    def _refuse(self, sentence: str) -> None:
        self.snapshot.loading = False
        self._complain(sentence)

    def _send(self, made: SnapshotFile) -> None:
        self.snapshot.loading = False
        self.download.send(made.name, made.kind, made.content)
