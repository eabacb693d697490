"""A folder of this machine that is being written: every new capture is shown and judged."""

import asyncio
import time
from collections import deque
from collections.abc import Callable
from functools import partial
from html import escape
from pathlib import Path
from typing import Any

import panel as pn
import panel_material_ui as pmu

from vsep.errors import InputError
from vsep.recordings.captures_in_folder import copy_captures, existing, next_captures
from vsep_app.pages.base import PageContext
from vsep_app.pages.recording import tasks
from vsep_app.pages.recording.stored_file import StoredFile
from vsep_app.pages.recording.tasks import FileFacts, RecordingPlan
from vsep_app.widgets.fields import field, pair
from vsep_app.widgets.layout import heading, html_pane

POLL_S = 0.5
_SHOWN = 12  # captures
_MOST_KEPT = 4096
_CLIPS = "clips"


class FolderPanel:
    """Controls and list of a folder of captures; nothing for visitors from other machines.

    Parameters
    ----------
    context : PageContext
        The page's.
    plan_of : callable
        Returns the plan of a capture; raises `InputError` if its settings are not known.
    show : callable
        Shows a capture on the page.
    notify_error : callable
        Tells the user what cannot be done.
    """

    def __init__(
        self,
        context: PageContext,
        *,
        plan_of: Callable[[StoredFile, FileFacts], RecordingPlan],
        show: Callable[[StoredFile, FileFacts, RecordingPlan], None],
        notify_error: Callable[[str], None],
    ) -> None:
        self._context, self._plan_of, self._show = context, plan_of, show
        self._complain = notify_error
        self._followed: str | None = None
        self._captures: deque[tuple[str, float]] = deque(maxlen=_MOST_KEPT)
        self._lines: deque[str] = deque(maxlen=_SHOWN)
        self.folder = field(
            pmu.TextInput,
            "Folder",
            "A folder of this machine that captures are written to. Every new one is shown with "
            "the settings above, separated, and judged: can both radars run side by side?",
            value="",
            max_length=1000,
        )
        self.follow = field(
            pmu.Switch, "Follow", "Take every capture that comes from now on.", value=False
        )
        self.last_s = field(
            pmu.IntInput, "Last [s]", "How far a clip reaches back.", value=30, start=1, end=86400
        )
        self.save = pmu.Button(
            label="Save clip",
            icon="save",
            description="Copy the captures of the last seconds into the folder `clips` in it.",
            variant="outlined",
            size="small",
            disabled=True,
        )
        self.list = html_pane("facts", sizing_mode="stretch_width")
        self.follow.param.watch(lambda _: self._switched(), "value")
        self.save.on_click(lambda _: self._context.background.begin(self._save()))

    def layout(self) -> list[Any]:
        """Return the end of the side bar."""
        if not self._context.own_folder:
            return []
        buttons = pn.Row(self.save, margin=(0, 12), sizing_mode="stretch_width")
        return [
            heading("6 · Folder"),
            self.folder,
            pair(self.last_s, self.follow),
            buttons,
            self.list,
        ]

    def close(self) -> None:
        """Follow no longer."""
        self._followed = None

    def _switched(self) -> None:
        if not (self.follow.value and self._context.own_folder):
            self._followed = None
            return
        self._followed = (self.folder.value or "").strip()
        self._context.background.begin(self._follow_folder(self._followed))

    async def _follow_folder(self, folder: str) -> None:
        """Take captures until another folder, or none, is followed."""
        try:
            state = await asyncio.to_thread(existing, folder)
            while self._followed == folder:
                state, captures = await asyncio.to_thread(next_captures, folder, state)
                for path, written_s in captures:
                    self._captures.append((path, written_s))
                    self._told(Path(path).name, await self._taken(path))
                await asyncio.sleep(POLL_S)
        except InputError as error:
            self._followed = None
            self._context.post(partial(self._stopped, str(error)))

    async def _taken(self, path: str) -> str:
        """Show a capture and return its figures in a sentence."""
        file = StoredFile(path=path, name=Path(path).name)
        loop = asyncio.get_running_loop()
        try:
            facts = await loop.run_in_executor(self._context.pool, tasks.FILE_FACTS, file)
            plan = self._plan_of(file, facts)
            self._context.post(partial(self._show, file, facts, plan))
            return str(await loop.run_in_executor(self._context.pool, tasks.FIGURES, plan))
        except InputError as error:
            return str(error)

    def _told(self, name: str, sentence: str) -> None:
        self._lines.appendleft(f"<p><strong>{escape(name)}</strong>: {escape(sentence)}</p>")
        self._context.post(self._listed)

    def _listed(self) -> None:
        self.save.disabled = not self._captures
        self.list.object = "".join(self._lines)

    def _stopped(self, sentence: str) -> None:
        self.follow.value = False
        self._complain(sentence)

    async def _save(self) -> None:
        """Copy the captures of the last seconds."""
        since = time.time() - float(self.last_s.value or 0)
        wanted = [path for path, written_s in self._captures if written_s >= since]
        if not wanted:
            self._context.post(partial(self._complain, "No capture has come in that time."))
            return
        place = Path(wanted[-1]).parent / _CLIPS / Path(wanted[-1]).stem
        try:
            number = await asyncio.to_thread(copy_captures, wanted, place)
        except OSError as error:
            self._context.post(partial(self._complain, f"{place}: {error.strerror}."))
            return
        self._told(place.name, f"{number} captures are kept in {place}.")
