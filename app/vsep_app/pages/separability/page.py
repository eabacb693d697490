"""Page of separability maps: two axes, a map that fills, links from its cells to the live view.

The layers that need no estimator follow the controls at once. Trials run in the background, from
coarse to fine, and are cancelled when the spec changes.
"""

import asyncio
import csv
import io
import logging
from collections.abc import Callable
from dataclasses import replace
from functools import lru_cache, partial
from typing import Any, TypeVar

import panel as pn
import panel_material_ui as pmu

from vsep.errors import InputError
from vsep.separability.analytic import analytic_map
from vsep.separability.map import LAYERS, SeparabilityMap, make_separability_map, table_rows
from vsep.separability.map_spec import MapSpec
from vsep_app.figures.backends import holoviews
from vsep_app.figures.map_elements import CONTOURS, EXPLANATIONS
from vsep_app.figures.map_file import map_html
from vsep_app.figures.map_view import MapView
from vsep_app.pages.base import PageBase, PageContext, PageParts
from vsep_app.pages.separability.form import SeparabilityForm
from vsep_app.pages.separability.session import (
    Progress,
    SeparabilitySession,
    Snapshot,
    shared_map_cache,
)
from vsep_app.pages.separability.url import read_map_spec, with_start, write_map_spec
from vsep_app.views.style import Axis, empty_figure
from vsep_app.widgets.fields import tool_button, tool_field
from vsep_app.widgets.layout import (
    card,
    download_button,
    html_pane,
    progress_bar,
    stack,
    status_html,
    status_pane,
    toolbar,
)
from vsep_app.widgets.location import read_query

_LOG = logging.getLogger(__name__)
_Result = TypeVar("_Result")

LOOK_PERIOD_S = 0.5
# Pages that show the same spec share its map.
cached_map = lru_cache(maxsize=16)(analytic_map)


class SeparabilityPage(PageBase):
    """One user's page of separability maps."""

    address = "separability"

    def __init__(self, context: PageContext) -> None:
        super().__init__(context)
        self.spec, layer, self._errors = read_map_spec(with_start(context.query))
        self.form = SeparabilityForm(self.spec, self._changed)
        self.session = SeparabilitySession(self.spec, shared_map_cache())
        self.view = MapView(Axis(), Axis())
        self.card = card(empty_figure(), weight=1, look="map")
        self.separability_map: SeparabilityMap | None = None
        self._asked: MapSpec | None = None
        self._seen: tuple[Any, ...] = ()
        self._told = ""
        self._call = asyncio.Event()
        layers = {one.label: name for name, one in LAYERS.items()}
        self.layer = tool_field(pmu.Select, "Layer", "", options=layers, value=layer, width=330)
        self.layer.param.watch(lambda _: self._changed(), "value")
        text = "Run trials: let the estimator try every cell of this map."
        self.run = tool_button("Run trials", "play_arrow", text, variant="contained")
        self.run.on_click(lambda _: self._run())
        # Whoever opens a layer of trials asks for them.
        self._wanted = self.spec if LAYERS[layer].empirical else None
        self.bar = progress_bar()
        self.progress = html_pane("study", margin=(15, 10), min_width=190, sizing_mode=None)
        self.status = status_pane("loading")
        self.explained = pn.pane.HTML("", sizing_mode="stretch_width", margin=(4, 10, 8, 10))
        self.table = download_button("Table", "separability.csv", self._table, "All cells as CSV.")
        text = "All layers in a file that opens from disk."
        self.document = download_button("HTML", "separability.html", self._document, text)

    def page(self) -> Any:
        """Return the whole page."""
        top = toolbar(self.layer, self.run, self.bar, self.progress, self.table, self.document)
        return PageParts(
            description="When can object and interference be told apart? Maps over two parameters.",
            status=self.status,
            sidebar=self.form.layout(),
            main=[top, stack(self.card, self.explained)],
        )

    def start(self) -> None:
        """Begin to answer; called when the page has been drawn."""
        for error in self._errors:
            self.notify_error(error)
        self._context.background.begin(self._follow())

    def close(self) -> None:
        """Cancel the trials; the page is closed."""
        self._context.background.close()
        self.session.stop()

    def _changed(self) -> None:
        """Take what the controls ask; an invalid spec is reported and not computed."""
        try:
            self.spec = self.form.spec()
        except InputError as error:
            self.notify_error(str(error))
            return
        location = self._context.location
        location.search = write_map_spec(self.spec, self.layer.value, read_query(location))
        self._context.background.call(self._call.set)

    def _run(self) -> None:
        """Begin with the trials of the map that is shown; another map needs another press."""
        self._wanted = self.spec
        self._context.background.call(self._call.set)

    async def _follow(self) -> None:
        """Draw when the spec changes and when there are new cell results."""
        await asyncio.to_thread(holoviews, "bokeh")
        while True:
            try:
                if self._context.watched():
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
        wanted = self.spec
        spec = wanted if wanted == self._wanted else replace(wanted, trials=0)
        if spec != self._asked:
            self.session.ask(spec)
            self._asked = spec
        snapshot = self.session.snapshot()
        seen = (spec, self.layer.value, len(snapshot.cell_results), snapshot.progress)
        if seen == self._seen:
            return
        separability_map = await self._in_thread(partial(_compose, spec, snapshot))
        if wanted == self.spec:
            self._seen = seen
            self._context.post(partial(self._show, separability_map, snapshot))

    async def _in_thread(self, function: Callable[[], _Result]) -> _Result:
        return await asyncio.get_running_loop().run_in_executor(self._context.pool, function)

    def _show(self, separability_map: SeparabilityMap, snapshot: Snapshot) -> None:
        """Draw the map and how far its trials are; called with the document locked."""
        self.separability_map = separability_map
        name = self.layer.value
        with pn.io.hold():
            self.card.objects[0].object = self.view.update(separability_map, name)
            text = f"{EXPLANATIONS[name]} {CONTOURS} A click opens the cell in the live view."
            self.explained.object = f'<p style="font-size:12px;margin:0">{text}</p>'
            done, total = len(snapshot.cell_results), snapshot.num_cells
            self.bar.value = int(100 * done / total) if separability_map.spec.trials else 0
            self.progress.object = f'<span class="status">{progress_text(snapshot)}</span>'
            self.status.object = status_html(snapshot.progress.value)
            self.run.disabled = not self.spec.trials or self.spec == self._wanted
        if snapshot.error:
            self._tell(snapshot.error)

    def _tell(self, sentence: str) -> None:
        if sentence != self._told:
            self._context.post(partial(self.notify_error, sentence))
        self._told = sentence

    def _table(self) -> io.StringIO:
        """Return all cells as a table."""
        file = io.StringIO()
        if self.separability_map is not None:
            rows = table_rows(self.separability_map)
            table = csv.DictWriter(file, list(rows[0]))
            table.writeheader()
            table.writerows(rows)
        file.seek(0)
        return file

    def _document(self) -> io.StringIO:
        """Return all layers as a document."""
        return io.StringIO("" if self.separability_map is None else map_html(self.separability_map))


def progress_text(snapshot: Snapshot) -> str:
    """Return how far the trials are, in one line."""
    if not snapshot.spec.trials:
        return "no trials yet"
    text = f"{len(snapshot.cell_results)} of {snapshot.num_cells} cells"
    failed = sum(cell_result.num_failed for cell_result in snapshot.cell_results.values())
    if failed:
        text += f" · {failed} trials failed"
    return text if snapshot.progress is not Progress.WAITING else f"{text} · waiting"


def _compose(spec: MapSpec, snapshot: Snapshot) -> SeparabilityMap:
    return make_separability_map(spec, cached_map(spec), snapshot.cell_results)
