"""Page that compares two to four methods on the same frame, iterating together."""

import io
from typing import Any

import panel as pn
import param
from bokeh.models import ColumnDataSource, CustomJS

from vsep.errors import InputError
from vsep.files.frame import Frame, read_frame
from vsep.files.frame_mask import TRUTH
from vsep_app.jobs.run_loop import FrameLoop, PictureSink, RunCallbacks
from vsep_app.jobs.run_session import Phase, RunSession
from vsep_app.model.compare_settings import (
    DEBIAS_KEY,
    MASK_KEY,
    MAX_METHODS,
    METHODS_KEY,
    ComparePlan,
    CompareSettings,
    parse_choice,
)
from vsep_app.model.settings import LOADED_FRAME, PLAN_NAMES, Settings
from vsep_app.model.url import parse_iteration, parse_query
from vsep_app.pages import PAGES
from vsep_app.pages.base import PageContext, page_frame
from vsep_app.pages.compare.form import CompareForm
from vsep_app.pages.compare.maps import CompareMaps
from vsep_app.pages.compare.picture import ComparePicture
from vsep_app.pages.compare.results import CompareResults
from vsep_app.pages.compare.tasks import (
    CompareStep,
    Comparison,
    advance,
    bare,
    compose,
    has_next_frame,
    next_plan,
    prepare,
    run_key,
    thin,
)
from vsep_app.pages.compare.transport import CompareTransport
from vsep_app.teaching.experiment import COMPARE, Experiment, open_experiment
from vsep_app.teaching.guide import Guide
from vsep_app.widgets.controls import Controls
from vsep_app.widgets.layout import main_part
from vsep_app.widgets.location import SharedIteration, set_query, synchronise
from vsep_app.widgets.notifications import tell_of_antennas

TITLE = PAGES["compare"].title
# After a bad repair the estimator finds ever more objects and slows all others down.
FIRST_QUERY = {"preset": "simulation-2-b", "max_iterations": 50}
BLIND_MASK = "autoregressive"


class ComparePage:
    """One user's compare page.

    Parameters
    ----------
    visit : PageContext
        The browser that opened it.
    """

    def __init__(self, context: PageContext) -> None:
        query, opened, unknown = open_experiment(context.query, context.experiments, COMPARE)
        values, errors = parse_query({**FIRST_QUERY, **query})
        chosen, more = parse_choice(query)
        self._stop_at, wrong = parse_iteration(query)
        self._errors = unknown + errors + more + wrong
        self._shared_iteration = SharedIteration()
        self.settings, self.choice = Settings(**values), CompareSettings(**chosen)
        self._frame: Frame | None = None
        self.controls = Controls(self.settings, self.load)
        self.form = CompareForm(self.choice, self.controls, self.notify_error)
        self.guide = Guide(
            context.experiments, here=COMPARE, take=self.take_experiment, opened=opened
        )
        self.maps, self.results = CompareMaps(MAX_METHODS), CompareResults(MAX_METHODS)
        self._make_acknowledgement()
        self.session: RunSession[ComparePlan, Comparison, CompareStep] = RunSession(
            thin, bare, most_kept=context.most_kept
        )
        self.loop = FrameLoop(
            self.session,
            RunCallbacks(
                prepare=prepare,
                advance=advance,
                compose=compose,
                given=lambda: (self._frame,),
                key=run_key,
                thin=thin,
                bare=bare,
            ),
            PictureSink(
                post=context.post,
                show=self.show,
                notify_error=self.notify_error,
                speed=lambda: float(self.settings.speed),
                watched=context.watched,
            ),
            context.pool,
            context.commons,
            context.background,
        )
        self.transport = CompareTransport(
            self.settings,
            self.session,
            self.loop.wake,
            next_frame=self.next_frame,
            first_frame=self._restart,
        )
        self.settings.param.watch(lambda *_: self._restart(), list(PLAN_NAMES))
        self.choice.param.watch(self._choice_changed, ["methods", "mask", "debias"])

    def _make_acknowledgement(self) -> None:
        """Let the browser say when it has drawn a picture."""
        self._painted = ColumnDataSource({"number": [0]}, name="painted")
        self._drawn = ColumnDataSource({"number": [0]}, name="drawn")
        self._drawn.on_change("data", self._acknowledged)
        self._painted.js_on_change(
            "data",
            CustomJS(
                args={"painted": self._painted, "drawn": self._drawn},
                code="""
const number = painted.data.number[0]
requestAnimationFrame(() => setTimeout(() => { drawn.data = {number: [number]} }, 0))
""",
            ),
        )
        # A source that nothing draws is not sent to the browser: an invisible glyph holds it.
        self.results.figure.scatter("number", "number", source=self._painted, visible=False)

    def page(self) -> Any:
        """Return the whole page."""
        return page_frame(
            here="compare",
            title=TITLE,
            description="Methods against radar interference side by side, live.",
            status=self.transport.status,
            sidebar=[*self.guide.layout(), *self.form.layout()],
            main=main_part(TITLE, self.transport.layout(), self.maps.grid, self.results.row),
        )

    def start(self) -> None:
        """Begin the first run; called when the page has been drawn."""
        synchronise(self.settings, self.notify_error)
        self._write_address()
        self.guide.write_address()
        for error in self._errors:
            self.notify_error(error)
        self.loop.start()
        self._restart()
        if self._stop_at is not None:
            self.session.run_to(self._stop_at)

    def close(self) -> None:
        """Stop the run for good: the browser has left."""
        self.loop.close()

    def load(self, name: str, content: bytes) -> None:
        """Take a frame file; a bad one becomes a notification and nothing else changes."""
        try:
            frame = read_frame(io.BytesIO(content), name=name)
        except InputError as error:
            self.notify_error(str(error))
            return
        self._frame = frame
        tell_of_antennas(frame)
        brought = frame.anti_aliasing_filter
        with param.parameterized.discard_events(self.settings):
            self.controls.fit_frame(
                frame.radar.sample_rate_hz,
                measured=brought is not None and brought.kind == "measured",
            )
        if self.choice.mask == TRUTH and frame.perfect_mask is None:
            self._tell(f"{name} holds no truth: the mask is {BLIND_MASK} now.")
            self.choice.mask = BLIND_MASK
        if self.settings.preset == LOADED_FRAME:
            self._restart()
        else:
            self.settings.choose_preset(LOADED_FRAME)

    def take_experiment(self, experiment: Experiment) -> None:
        """Set all controls as an experiment wants them and begin with frame 0."""
        number = self.session.run_number
        self.settings.param.update(**experiment.settings())
        self.choice.param.update(**experiment.choice())
        if self.session.run_number == number:
            self._restart()

    def next_frame(self) -> None:
        """Go to the next frame of the sequence, if all methods have finished this one."""
        comparison, snapshot = self.session.opening, self.session.snapshot()
        if comparison is None or snapshot is None or self.session.phase is not Phase.FINISHED:
            return
        if has_next_frame(comparison.plan):
            self.session.restart(next_plan(comparison, snapshot.steps[-1]))
            self.loop.wake()

    def show(self, picture: ComparePicture) -> None:
        """Draw a picture on all views; called with the document locked."""
        opening = self.session.opening
        with pn.io.hold():
            self.maps.show(picture)
            self.results.show(picture)
            self.controls.show_levels(picture.static_picture.levels_text)
            if opening is not None:
                self.controls.show_threshold(opening.method_runs[0].estimator.threshold_db)
                self.transport.show(
                    picture, rate=self.loop.rate, has_next=has_next_frame(opening.plan)
                )
            self._painted.data = {"number": [self._painted.data["number"][0] + 1]}
        self._shared_iteration.write(self.session.phase, picture.iteration)
        at_end = picture.iteration == picture.num_iterations
        if self.transport.play.value and at_end:
            self.next_frame()

    def notify_error(self, sentence: str) -> None:
        """Notify the user of what cannot be done."""
        if pn.state.notifications is not None:
            pn.state.notifications.error(sentence, duration=8000)

    def _tell(self, sentence: str) -> None:
        if pn.state.notifications is not None:
            pn.state.notifications.info(sentence, duration=8000)

    def _choice_changed(self, *_: Any) -> None:
        self._write_address()
        self._restart()

    def _write_address(self) -> None:
        set_query(METHODS_KEY, ",".join(self.choice.methods))
        set_query(MASK_KEY, self.choice.mask)
        set_query(DEBIAS_KEY, "true" if self.choice.debias else None)

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

    def _acknowledged(self, attr: str, old: Any, new: Any) -> None:
        del attr, old, new
        self.loop.acknowledged()
