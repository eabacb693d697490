"""Page that compares two to four methods on the same frame, iterating together."""

from collections.abc import Mapping
from typing import Any

import panel as pn
from bokeh.models import ColumnDataSource

from vsep.files.frame_mask import TRUTH
from vsep.inference.core.progress import Termination
from vsep_app.jobs.run_loop import RunCallbacks
from vsep_app.jobs.run_session import Phase
from vsep_app.model.compare_settings import (
    DEBIAS_KEY,
    MASK_KEY,
    METHODS_KEY,
    ComparePlan,
    CompareSettings,
    parse_choice,
)
from vsep_app.model.settings import LOADED_FRAME, PLAN_NAMES, Settings
from vsep_app.model.url import parse_iteration, parse_query
from vsep_app.pages.base import PageContext, PageParts
from vsep_app.pages.compare import tasks
from vsep_app.pages.compare.form import CompareForm
from vsep_app.pages.compare.maps import CompareMaps
from vsep_app.pages.compare.picture import ComparePicture
from vsep_app.pages.compare.results import CompareResults
from vsep_app.pages.compare.tasks import CompareStep, Comparison
from vsep_app.pages.compare.transport import CompareTransport
from vsep_app.pages.run_page import ScenePage
from vsep_app.server.lesson import Glance
from vsep_app.teaching.experiment import COMPARE, Experiment, open_experiment
from vsep_app.teaching.guide import Guide
from vsep_app.views.opening import small_map
from vsep_app.widgets.controls import Controls
from vsep_app.widgets.location import set_query, synchronise
from vsep_app.widgets.notifications import antenna_notice, notify

# After a bad repair the estimator finds ever more objects and slows all others down.
FIRST_QUERY: dict[str, Any] = {"preset": "simulation-2-b", "max_iterations": 50}
BLIND_MASK = "autoregressive"
_CHOSEN = ("methods", "mask", "debias")


class ComparePage(ScenePage[ComparePlan, Comparison, CompareStep, ComparePicture]):
    """One user's compare page."""

    address = "compare"
    has_scene = True

    def __init__(self, context: PageContext) -> None:
        query, opened, unknown = open_experiment(context.query, context.experiments, COMPARE)
        values, errors = parse_query({**FIRST_QUERY, **query})
        chosen, more = parse_choice(query)
        super().__init__(context, Settings(**values))
        self._stop_at, wrong = parse_iteration(query)
        self._errors = unknown + errors + more + wrong
        self.choice = CompareSettings(**chosen)
        self.controls = Controls(self.settings, self.load)
        self.form = CompareForm(self.choice, self.controls, self.notify_error)
        self.guide = Guide(
            context.experiments,
            here=COMPARE,
            take=self.take_experiment,
            opened=opened,
            run=self._go_on,
            answered=self._answered,
        )
        self.maps, self.results = CompareMaps(), CompareResults()
        self._painted = ColumnDataSource({"number": [0]}, name="painted")
        self._acknowledge(self._painted)
        # A source that nothing draws is not sent to the browser: an invisible glyph holds it.
        self.results.figure.scatter("number", "number", source=self._painted, visible=False)
        self._make_loop(
            RunCallbacks(
                prepare=tasks.prepare,
                advance=tasks.advance,
                compose=tasks.compose,
                extra_arguments=lambda: (self._frame,),
                key=tasks.run_key,
                compact=tasks.compact,
                strip=tasks.strip,
            )
        )
        self.transport = CompareTransport(
            self.settings,
            self.session,
            self.loop.wake,
            next_frame=self.next_frame,
            first_frame=self._restart,
        )
        self.settings.param.watch(lambda *_: self._restart(), list(PLAN_NAMES))
        self.choice.param.watch(self._choice_changed, list(_CHOSEN))

    def page(self) -> Any:
        """Return the whole page."""
        self.fault.cover(self.maps.grid, self.results.row)
        return PageParts(
            description="Methods against radar interference side by side, live.",
            status=self.transport.status,
            sidebar=[*self.guide.layout(), *self.form.layout()],
            main=[self.transport.layout(), self.fault.pane, self.maps.grid, self.results.row],
        )

    def start(self) -> None:
        """Begin the first run; called when the page has been drawn."""
        synchronise(self._context.location, self.settings, self.notify_error)
        self._write_address()
        self._write_experiment()
        self._begin()

    def _loaded(self, name: str, content: bytes) -> None:
        del content
        assert self._frame is not None
        notice = antenna_notice(self._frame)
        if notice is not None:
            notify(notice, kind="info", duration_ms=12000)
        if self.choice.mask == TRUTH and self._frame.perfect_mask is None:
            notify(f"{name} holds no truth: the mask is {BLIND_MASK} now.", kind="info")
            self.choice.mask = BLIND_MASK

    def _set(self, experiment: Experiment) -> None:
        super()._set(experiment)
        self.choice.param.update(**experiment.choice())

    def press(self, name: str) -> object:
        """Do what a click on a card or a prediction means."""
        return self.guide.press(name)

    def next_frame(self) -> None:
        """Go to the next frame of the sequence, if all methods have finished this one."""
        comparison, snapshot = self.session.prepared_run, self.session.snapshot()
        if comparison is None or snapshot is None or self.session.phase is not Phase.FINISHED:
            return
        if tasks.has_next_frame(comparison.plan):
            self.session.restart(tasks.next_plan(comparison, snapshot.steps[-1]))
            self.loop.wake()

    def show(self, picture: ComparePicture) -> None:
        """Draw a picture on all views; called with the document locked."""
        prepared_run = self.session.prepared_run
        with pn.io.hold():
            self.fault.clear(shown=(picture.run_number, picture.iteration))
            self.maps.show(picture)
            self.results.show(picture)
            self.controls.show_levels(picture.static_picture.levels_text)
            if prepared_run is not None:
                self.controls.show_threshold(prepared_run.method_runs[0].estimator.threshold_db)
                self.transport.show(
                    picture, rate=self.loop.rate, has_next=tasks.has_next_frame(prepared_run.plan)
                )
            self._painted.data = {"number": [self._painted.data["number"][0] + 1]}
        self._shared_iteration.write(self.session.phase, picture.iteration)
        if picture.termination is not Termination.RUNNING:
            self.guide.finished(picture.method_runs[0].score)
        at_end = picture.iteration == picture.num_iterations
        if self.transport.play.value and at_end:
            self.next_frame()

    def take_view(self, query: Mapping[str, str]) -> bool:
        """Show in place what an address of this page names."""
        if self.settings.preset == LOADED_FRAME:
            return False
        query, experiment, _ = open_experiment(query, self._context.experiments, COMPARE)
        self.guide.open(experiment)
        usual = {name: CompareSettings.param[name].default for name in _CHOSEN}
        self.choice.param.update(**{**usual, **parse_choice(query)[0]})
        self._take_settings({**FIRST_QUERY, **query})
        return True

    def glance(self) -> Glance | None:
        """Return the map of the first method."""
        picture = self.picture
        if picture is None:
            return None
        first = picture.method_runs[0]
        return Glance(f"{first.name}, iteration {picture.iteration}", small_map(first.map_cleaned))

    def _waits(self) -> bool:
        return self.guide.awaits_prediction

    def _go_on(self) -> None:
        self.session.run()
        self.loop.wake()

    def _choice_changed(self, *_: Any) -> None:
        self._write_address()
        self._restart()

    def _write_address(self) -> None:
        location = self._context.location
        set_query(location, METHODS_KEY, ",".join(self.choice.methods))
        set_query(location, MASK_KEY, self.choice.mask)
        set_query(location, DEBIAS_KEY, "true" if self.choice.debias else None)

    def _restart(self) -> None:
        """Begin with frame 0 of what is chosen now."""
        self.session.restart(
            ComparePlan(
                scene=self.settings.plan(),
                methods=tuple(self.choice.methods),
                mask=self.choice.mask,
                debias=self.choice.debias,
                frame_number=0,
                histories={},
                past=(),
            )
        )
        self.loop.wake()
