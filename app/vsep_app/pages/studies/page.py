"""Page of studies: form, growing curves, and links from single trials to the live view.

The study runs in processes of its own. Once a second, if there are new rows, a thread makes panels
and dots of them; the page then gets the newer numbers.
"""

import asyncio
import io
import logging
import tempfile
import threading
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import cache, partial
from pathlib import Path
from typing import Any, TypeVar
from weakref import WeakSet

import panel as pn
import panel_material_ui as pmu

from vsep.errors import InputError
from vsep.files.results import as_json
from vsep.studies.catalogue import panel_specs
from vsep.studies.example import example_panels
from vsep.studies.figures import study_panels
from vsep.studies.panels import AnyPanel
from vsep.studies.scatter import FRAME_VALUES
from vsep.studies.study import Study
from vsep.studies.trial import FAILED, Row
from vsep_app.figures.backends import holoviews
from vsep_app.pages.base import PageBase, PageContext, PageParts
from vsep_app.pages.studies.curves import StudyCurves
from vsep_app.pages.studies.folder import PageFolder
from vsep_app.pages.studies.form import StudyForm
from vsep_app.pages.studies.scatter import Dots, ScatterChoice, StudyScatter, make_dots
from vsep_app.pages.studies.session import KEEP_ROWS, StudySession, StudySnapshot
from vsep_app.pages.studies.shipped import copy_shipped_rows
from vsep_app.pages.studies.transport import StudyTransport
from vsep_app.widgets.fields import tool_field
from vsep_app.widgets.layout import panel, stack, stylesheet

_LOG = logging.getLogger(__name__)

MIN_PERIOD_S = 1.0
# Making panels of many rows must not take more than this share of the server's time.
MAX_SHARE = 0.25
_UPLOADED = "uploaded"
_Result = TypeVar("_Result")


_SESSIONS: WeakSet[StudySession] = WeakSet()


@cache
def study_pool() -> ThreadPoolExecutor:
    """Return the thread that makes the panels of all sessions; the live view has its own."""
    return ThreadPoolExecutor(max_workers=1, thread_name_prefix="vsep-study")


@dataclass(frozen=True, kw_only=True)
class StudyPicture:
    """What the page shows: all panels of the study, and the dots of the chosen one."""

    panels: Sequence[AnyPanel]
    dots: Dots


class StudyPage(PageBase):
    """One user's page of studies."""

    address = "studies"

    def __init__(self, context: PageContext) -> None:
        super().__init__(context)
        self._folder = PageFolder()
        # Rows that are opened get a folder of their own: they must not mix with those made here.
        self._home = self._folder.path
        self.session: StudySession | None = None
        self._name = ""
        self._panels: Sequence[AnyPanel] = ()
        self._seen: tuple[int, ScatterChoice] | None = None
        self._told, self._closed = "", False
        self.form = StudyForm(self.load, own_folder=context.own_folder)
        self.curves, self.scatter = StudyCurves(), StudyScatter()
        self.transport = StudyTransport(run=self._run, halt=self._halt, rows=self._rows)
        self.transport.figure.param.watch(self._figure_chosen, "value")
        self.form.study_name.param.watch(self._study_chosen, "value")
        text = "Every dot below is one trial of this part of the figure."
        look = {"options": [], "width": 140, "visible": False}
        self.panel = tool_field(pmu.Select, "Trials of panel", text, **look)
        text = "What the dots show of a trial: objects missed or invented, or errors."
        look = {"options": list(FRAME_VALUES), "width": 230}
        self.value = tool_field(pmu.Select, "Value", text, **look)

    def page(self) -> Any:
        """Return the whole page."""
        left = stack(self.curves.key, self.curves.grid, weight=17)
        choices = pn.Row(
            self.panel,
            self.value,
            margin=0,
            sizing_mode="stretch_width",
            stylesheets=[stylesheet("transport")],
        )
        right = stack(
            choices,
            self.scatter.card,
            panel("Largest values: open one in the live view", self.scatter.worst, weight=8),
            weight=11,
        )
        body = stack(left, right, row=True, sheet="body")
        return PageParts(
            description="Monte-Carlo studies of vsep, growing as their trials finish.",
            status=self.transport.status,
            sidebar=self.form.layout(),
            main=[self.transport.layout(), body],
        )

    def start(self) -> None:
        """Begin to look for new rows; called when the page has been drawn."""
        self._context.background.begin(self._follow())
        self._context.background.begin(self._open_shipped())

    def close(self) -> None:
        """Stop the study and forget the temporary folder; the page is gone."""
        self._closed = True
        self._context.background.close()
        if self.session is not None:
            self.session.stop()
        threading.Thread(target=_clean_up, args=(self.session, self._folder), daemon=True).start()

    async def load(self, name: str, content: bytes) -> None:
        """Open a file of rows; a bad one becomes a notification and nothing else changes."""
        try:
            home = Path(self._folder.write(partial(tempfile.mkdtemp, dir=self._folder.path)))
            reading = partial(self._context.pool.submit, KEEP_ROWS, home / _UPLOADED, content, name)
            study = await asyncio.wrap_future(self._folder.begin(reading))
            if self._closed or self._is_busy():
                return
            self.form.take(study)
            path = (home / _UPLOADED).rename(self.form.path(home))
            self._home = home
            await self._open(self.form.study(), path)
        except (InputError, OSError) as error:
            self.notify_error(str(error))

    def _study_chosen(self, _: Any) -> None:
        self._context.background.begin(self._open_shipped())

    async def _open_shipped(self) -> None:
        """Open the rows that the program ships of the chosen study, if nothing is at work."""
        name = self.form.study_name.value
        if self._is_busy() or (self.session is not None and self._name == name):
            return
        try:
            study, path = self.form.study(), self.form.path(self._home)
            copy = partial(copy_shipped_rows, name, path)
            if await _in_thread(self._folder.write, copy):
                session = await self._read_session(study, path)
                self._context.post(partial(self._adopt, session, name))
        except (InputError, OSError) as error:
            self._context.post(partial(self.notify_error, str(error)))

    async def _run(self, _: Any) -> None:
        """Start what the form asks for, or go on with it."""
        try:
            session = await self._open(self.form.study(), self.form.path(self._home))
        except (InputError, OSError) as error:
            self.notify_error(str(error))
            return
        if session is None:
            return
        if self._context.most_studies is not None and _num_running() >= self._context.most_studies:
            self.notify_error("Another study runs on this server; start yours when it has ended.")
            return
        session.start()
        self._show(session.snapshot(), None)

    async def _open(self, study: Study, path: Path) -> StudySession | None:
        """Make the session of a study and its file, and show it; None if another one runs."""
        session = await self._read_session(study, path)
        self._adopt(session, study.name)
        return session if self.session is session else None

    async def _read_session(self, study: Study, path: Path) -> StudySession:
        workers = self.form.workers.value if self._context.most_studies is None else 1
        read = partial(StudySession, study, path, workers=workers)
        return await _in_thread(self._folder.write, read)

    def _adopt(self, session: StudySession, name: str) -> None:
        """Show a session unless another one runs; called with the document locked."""
        if self._closed or self._is_busy():
            return
        panels = [name for name in self.form.panels.options if name in self.form.panels.value]
        kept = self.panel.value if self.panel.value in panels else panels[0]
        _SESSIONS.add(session)
        self.session, self._seen, self._name, self._told = session, None, name, ""
        self.panel.param.update(options=panels, value=kept, visible=True)
        self._show(session.snapshot(), None)

    def _is_busy(self) -> bool:
        return self.session is not None and self.session.is_busy

    def _halt(self, _: Any) -> None:
        if self.session is not None:
            self.session.stop()
            self._show(self.session.snapshot(), None)

    def _rows(self) -> io.StringIO:
        """Return all rows as a file."""
        rows = () if self.session is None else self.session.snapshot().rows
        self.transport.download.filename = f"{self._name}.jsonl"
        return io.StringIO("".join(as_json(row) + "\n" for row in rows))

    async def _follow(self) -> None:
        await asyncio.to_thread(holoviews, "bokeh")
        while True:
            started = time.monotonic()
            try:
                if self._context.watched():
                    await self._look()
            except Exception as error:
                sentence = f"The rows cannot be drawn ({type(error).__name__}: {error})."
                if sentence != self._told:
                    _LOG.error("the panels of a study failed", exc_info=error)
                    self._context.post(partial(self.notify_error, sentence))
                self._told = sentence
            spent = time.monotonic() - started
            await asyncio.sleep(max(MIN_PERIOD_S, spent / MAX_SHARE))

    async def _look(self) -> None:
        session = self.session
        if session is None:
            return
        snapshot = session.snapshot()
        choice = ScatterChoice(study=self._name, panel=self.panel.value, value=self.value.value)
        seen = len(snapshot.rows), choice
        picture = None
        if seen != self._seen:
            picture = await _in_thread(compose, snapshot.rows, choice)
        if session is self.session:
            self._seen = seen
            self._context.post(partial(self._show, snapshot, picture))

    def _show(self, snapshot: StudySnapshot, picture: StudyPicture | None) -> None:
        """Show how far the study is; called with the document locked."""
        with pn.io.hold():
            self.form.lock(self.transport.show(snapshot))
            if picture is not None:
                self._panels = picture.panels
                self.transport.offer(list(dict.fromkeys(one.title for one in picture.panels)))
                self._show_curves()
                self.scatter.show(picture.dots)
        self._tell(snapshot)

    def _tell(self, snapshot: StudySnapshot) -> None:
        """Notify of an error once, and of the first trial that has no result."""
        sentence = snapshot.error
        if not sentence and snapshot.num_failed:
            reason = next(row["reason"] for row in snapshot.rows if row["status"] == FAILED)
            sentence = f"A trial has no result ({reason}); the others go on."
        if sentence and sentence != self._told:
            self.notify_error(sentence)
            self._told = sentence

    def _show_curves(self) -> None:
        title = self.transport.figure.value
        self.curves.show([one for one in self._panels if one.title == title])

    def _figure_chosen(self, event: Any) -> None:
        """Show the figure, and the trials of its panel where it has one."""
        self._show_curves()
        own = [spec.panel for spec in panel_specs(self._name) if spec.title == event.new]
        if own and self.panel.value not in own and own[0] in self.panel.options:
            self.panel.value = own[0]


def _num_running() -> int:
    """Return how many studies run on this server."""
    return sum(session.is_busy for session in tuple(_SESSIONS))


def compose(rows: Sequence[Row], choice: ScatterChoice) -> StudyPicture:
    """Make what the page shows of rows."""
    panels = [*example_panels(rows), *study_panels(rows)]
    return StudyPicture(panels=panels, dots=make_dots(rows, choice))


async def _in_thread(function: Callable[..., _Result], *arguments: Any) -> _Result:
    return await asyncio.get_running_loop().run_in_executor(study_pool(), function, *arguments)


def _clean_up(session: StudySession | None, folder: PageFolder) -> None:
    """Remove the folder of a page after the study that fills it."""
    if session is not None:
        session.wait()
    folder.close()
