"""The page of the laboratory: choose two axes, watch the map fill, open any cell in the live view.

The layers that need no estimator follow the controls at once. Trials run in the background, from
coarse to fine, and are given up when the question changes.
"""

import asyncio
import csv
import io
import logging
from collections.abc import Callable
from functools import lru_cache, partial
from typing import Any, TypeVar

import panel as pn
import panel_material_ui as pmu

from app.laboratory.address import read_question, write_question
from app.laboratory.explained import CONTOURS, EXPLANATIONS
from app.laboratory.figures import map_html
from app.laboratory.form import LaboratoryForm
from app.laboratory.session import LaboratorySession, Progress, Snapshot, shared_answers
from app.laboratory.view import MapView
from app.layout import card, stylesheet, unseen_title
from app.views.style import Axis
from app.visit import Visit, page_frame
from vsep._arrays import InputError
from vsep.laboratory.analytic import analytic_map
from vsep.laboratory.atlas import LAYERS, Atlas, make_atlas, table_rows
from vsep.laboratory.question import Question

_LOG = logging.getLogger(__name__)
_Result = TypeVar("_Result")

TITLE = "vsep: separability laboratory"
LOOK_PERIOD_S = 0.5
# Pages that show the same question share its map.
cached_map = lru_cache(maxsize=16)(analytic_map)
_BUTTON = {"size": "small", "margin": (9, 3)}


class LaboratoryPage:
    """One user's laboratory.

    Parameters
    ----------
    visit : Visit
        The browser that opened it.
    """

    def __init__(self, visit: Visit) -> None:
        self._visit = visit
        self.question, layer, self._complaints = read_question(visit.query)
        self.form = LaboratoryForm(self.question, self._changed)
        self.session = LaboratorySession(self.question, shared_answers())
        self.view = MapView(Axis(), Axis(), opens=True)
        self.atlas: Atlas | None = None
        self._asked: Question | None = None
        self._seen: tuple[Any, ...] = ()
        self._told = ""
        self._task: asyncio.Task[None] | None = None
        self._call = asyncio.Event()
        self.layer = pmu.Select(
            label="Layer",
            options={one.label: name for name, one in LAYERS.items()},
            value=layer,
            size="small",
            width=330,
            margin=(7, 4, 0, 4),
        )
        self.layer.param.watch(lambda _: self._changed(), "value")
        self.bar = pmu.LinearProgress(
            value=0,
            variant="determinate",
            sizing_mode="stretch_width",
            min_width=80,
            margin=(22, 12),
        )
        self.progress = pn.pane.HTML(
            "", margin=(15, 10), min_width=190, stylesheets=[stylesheet("study")]
        )
        self.status = pn.pane.HTML(_status_html("loading"), margin=(0, 12))
        self.status.styles = {"color": "white"}
        self.explained = pn.pane.HTML("", sizing_mode="stretch_width", margin=(4, 10, 8, 10))
        self.table = _download("Table", "separability.csv", self._table, "All cells as CSV.")
        self.document = _download(
            "HTML",
            "separability.html",
            self._document,
            "All layers in a file that opens from disk.",
        )

    def page(self) -> Any:
        """Return the whole page."""
        top = pn.Row(
            self.layer,
            self.bar,
            self.progress,
            self.table,
            self.document,
            sizing_mode="stretch_width",
            styles={"min-height": "52px"},
            margin=(2, 3, 0, 3),
            stylesheets=[stylesheet("transport")],
        )
        body = pn.Column(
            card(self.view.figure, weight=1, look="map"),
            self.explained,
            margin=0,
            sizing_mode="stretch_both",
            styles={"flex": "1 1 0", "min-height": "0"},
            stylesheets=[stylesheet("column")],
        )
        main = pn.Column(
            unseen_title(TITLE),
            top,
            body,
            margin=0,
            sizing_mode="stretch_width",
            stylesheets=[stylesheet("main")],
        )
        return page_frame(
            here="laboratory",
            title=TITLE,
            description="When can object and interference be told apart? Maps over two parameters.",
            status=self.status,
            sidebar=self.form.layout(),
            main=main,
        )

    def start(self) -> None:
        """Begin to answer; called when the page has been drawn."""
        for complaint in self._complaints:
            self.complain(complaint)
        self._task = asyncio.get_running_loop().create_task(self._follow())

    def close(self) -> None:
        """Give the trials up; the page is gone."""
        if self._task is not None:
            self._task.cancel()
        self.session.stop()

    def complain(self, sentence: str) -> None:
        """Notify the user of what cannot be done."""
        if pn.state.notifications is not None:
            pn.state.notifications.error(sentence, duration=8000)

    def _changed(self) -> None:
        """Take what the controls ask; a question that makes no sense is told and not asked."""
        try:
            self.question = self.form.question()
        except InputError as error:
            self.complain(str(error))
            return
        location = pn.state.location
        if location is not None:
            location.search = write_question(self.question, self.layer.value, location.query_params)
        self._call.set()

    async def _follow(self) -> None:
        """Draw when the question changes and when there are new findings."""
        while True:
            try:
                await self._look()
            except Exception as error:
                _LOG.error("the map failed", exc_info=error)
                self._tell(f"The map cannot be drawn ({type(error).__name__}: {error}).")
            try:
                await asyncio.wait_for(self._call.wait(), LOOK_PERIOD_S)
            except TimeoutError:
                continue
            self._call.clear()

    async def _look(self) -> None:
        question = self.question
        if question != self._asked:
            self.session.ask(question)
            self._asked = question
        snapshot = self.session.snapshot()
        seen = (question, self.layer.value, len(snapshot.findings), snapshot.progress)
        if seen == self._seen:
            return
        atlas = await self._in_thread(partial(_compose, question, snapshot))
        if question == self.question:
            self._seen = seen
            self._visit.post(partial(self._show, atlas, snapshot))

    async def _in_thread(self, function: Callable[[], _Result]) -> _Result:
        return await asyncio.get_running_loop().run_in_executor(self._visit.pool, function)

    def _show(self, atlas: Atlas, snapshot: Snapshot) -> None:
        """Draw the map and how far its trials are; called with the document locked."""
        self.atlas = atlas
        name = self.layer.value
        with pn.io.hold():
            self.view.update(atlas, name)
            text = f"{EXPLANATIONS[name]} {CONTOURS} A click opens the cell in the live view."
            self.explained.object = f'<p style="font-size:12px;margin:0">{text}</p>'
            done, total = len(snapshot.findings), snapshot.num_cells
            self.bar.value = int(100 * done / total) if atlas.question.trials else 0
            self.progress.object = f'<span class="status">{progress_text(snapshot)}</span>'
            self.status.object = _status_html(snapshot.progress.value)
        if snapshot.error:
            self._tell(snapshot.error)

    def _tell(self, sentence: str) -> None:
        if sentence != self._told:
            self._visit.post(partial(self.complain, sentence))
        self._told = sentence

    def _table(self) -> io.StringIO:
        """Return all cells as a table."""
        file = io.StringIO()
        if self.atlas is not None:
            rows = table_rows(self.atlas)
            table = csv.DictWriter(file, list(rows[0]))
            table.writeheader()
            table.writerows(rows)
        file.seek(0)
        return file

    def _document(self) -> io.StringIO:
        """Return all layers as a document."""
        return io.StringIO("" if self.atlas is None else map_html(self.atlas))


def progress_text(snapshot: Snapshot) -> str:
    """Return how far the trials are, in one line."""
    if not snapshot.question.trials:
        return "no trials asked for"
    text = f"{len(snapshot.findings)} of {snapshot.num_cells} cells"
    failed = sum(finding.num_failed for finding in snapshot.findings.values())
    if failed:
        text += f" · {failed} trials failed"
    return text if snapshot.progress is not Progress.WAITING else f"{text} · waiting"


def _compose(question: Question, snapshot: Snapshot) -> Atlas:
    return make_atlas(question, cached_map(question), snapshot.findings)


def _status_html(text: str) -> str:
    return f'<strong role="status" style="font-size:13px;white-space:nowrap">{text}</strong>'


def _download(label: str, filename: str, callback: Callable[[], Any], text: str) -> Any:
    button = pmu.FileDownload(
        label=label, callback=callback, filename=filename, description=text, **_BUTTON
    )
    # Given to the constructor it makes the widget warn of its own default.
    button.variant = "outlined"
    return button
