"""The page: three views, what is beside them, and the session behind it."""

import io
import time
from collections.abc import Callable
from functools import partial
from typing import Any

import panel as pn
import param
from bokeh.models import ColumnDataSource, CustomJS, Span

from vsep.errors import InputError
from vsep.files.frame import Frame, read_frame
from vsep.inference.core.progress import Step
from vsep_app.jobs.frame_store import FRAME_KEY, frame_of_query
from vsep_app.jobs.run_loop import FrameLoop, PictureSink, RunCallbacks
from vsep_app.jobs.run_session import Phase, RunSession
from vsep_app.jobs.tasks import Prepared, advance, bare, compose, prepare, run_key, thin
from vsep_app.model.picture import Picture
from vsep_app.model.settings import LOADED_FRAME, PLAN_NAMES, VIEW_NAMES, Plan, Settings
from vsep_app.model.text import LogLine, TableRow
from vsep_app.model.trial_link import TRIAL_KEY, trial_of_query
from vsep_app.model.url import parse_iteration, parse_query
from vsep_app.pages import PAGES
from vsep_app.pages.base import PageContext, page_frame
from vsep_app.report.snapshot import SnapshotFile, make_snapshot, snapshot_spec
from vsep_app.report.spec import KeptFrame, ReportSpec
from vsep_app.teaching.experiment import LIVE, Experiment, open_experiment
from vsep_app.teaching.guide import Guide
from vsep_app.views.progress import ProgressView
from vsep_app.views.ramps import RampStrip
from vsep_app.views.range_doppler import RangeDopplerView
from vsep_app.views.signals import DelayView, FastTimeView
from vsep_app.views.style import Axis
from vsep_app.views.tables import log_html, table_html, times_html
from vsep_app.widgets.controls import Controls
from vsep_app.widgets.download import Download
from vsep_app.widgets.exports import download_buttons
from vsep_app.widgets.layout import (
    card,
    panel,
    progress_card,
    stylesheet,
    unseen_title,
)
from vsep_app.widgets.location import SharedIteration, set_query, synchronise
from vsep_app.widgets.share import Share
from vsep_app.widgets.transport import Transport

TITLE = PAGES["./"].title
SIDE_PERIOD_S = 0.3
SIDE_PICTURES = 4
SHOWN_LINES = 60


class Dashboard:
    """One user's dashboard.

    Parameters
    ----------
    visit : PageContext
        The browser that opened it.
    """

    def __init__(self, context: PageContext) -> None:
        self._stored, query, handover_errors = frame_of_query(context.query, context.commons.frames)
        self._trial, query, trial_errors = trial_of_query(query)
        query, opened, unknown = open_experiment(query, context.experiments, LIVE)
        values, errors = parse_query(query)
        self._stop_at, more = parse_iteration(query)
        self._errors = handover_errors + trial_errors + unknown + errors + more
        self.settings = Settings(**({**self._trial.values, **values} if self._trial else values))
        self._frame: Frame | None = None
        self._kept: KeptFrame | None = None
        self._shared_iteration = SharedIteration()
        self._side_drawn = 0.0
        self._beside: Picture | None = None
        self._shown_run = 0
        self._make_views()
        self.controls = Controls(self.settings, self.load)
        self.guide = Guide(context.experiments, here=LIVE, take=self.take_experiment, opened=opened)
        if self._trial is not None:
            self._take(self._trial.frame)
            self.settings.choose_preset(LOADED_FRAME)
        self.session: RunSession[Plan, Prepared, Step] = RunSession(
            thin, bare, most_kept=context.most_kept
        )
        self.loop = FrameLoop(
            self.session,
            RunCallbacks(
                prepare=prepare,
                advance=advance,
                compose=compose,
                given=lambda: (self._frame, self.settings.antenna),
                view=lambda: (self.settings.ramp, self.settings.fast_time, self.settings.antenna),
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
        self._pace, self._most_kept = context.commons.pace, context.most_kept
        self.transport = Transport(self.settings, self.session, self.loop.wake)
        self.share = Share(
            self._snapshot,
            pool=context.pool,
            post=context.post,
            notify_error=self.notify_error,
            background=context.background,
        )
        self.settings.param.watch(self._scene_changed, list(PLAN_NAMES))
        self.settings.param.watch(self._view_changed, list(VIEW_NAMES))
        self.settings.param.watch(self._antenna_chosen, "antenna")

    def _make_views(self) -> None:
        range_axis = Axis()
        crosshair = Span(dimension="height", line_dash=[4, 3], line_color="#8C8C8C")
        self.fast_time = FastTimeView()
        self.delay = DelayView(range_axis, crosshair)
        self.maps = RangeDopplerView(range_axis, crosshair)
        self.ramps = RampStrip(self._ramp_selected)
        self.progress = ProgressView()
        self.table = pn.pane.HTML(
            "", sizing_mode="stretch_both", stylesheets=[stylesheet("tables")]
        )
        self.log = pn.pane.HTML("", sizing_mode="stretch_both", stylesheets=[stylesheet("tables")])
        self.times = pn.pane.HTML("", margin=0, stylesheets=[stylesheet("tables")])
        self._drawn = ColumnDataSource({"number": [0]}, name="drawn")
        self._drawn.on_change("data", self._acknowledged)
        self.fast_time.source.js_on_change(
            "data",
            CustomJS(
                args={"drawn": self._drawn},
                code="""
const number = drawn.data.number[0] + 1
requestAnimationFrame(() => setTimeout(() => { drawn.data = {number: [number]} }, 0))
""",
            ),
        )

    def page(self) -> Any:
        """Return the whole page."""
        rows = [
            card(self.ramps.figure, weight=0, height=62, look="strip"),
            card(self.fast_time.figure, weight=10, key=self.fast_time.key),
            card(self.delay.figure, weight=11, key=self.delay.key),
        ]
        self._strip = rows[0]
        self._map_row = pn.Row(
            card(self.maps.before, weight=1, look="strip"),
            card(self.maps.after, weight=1, look="strip"),
            sizing_mode="stretch_both",
            margin=0,
            styles={"flex": "13 1 0", "min-height": "0"},
            stylesheets=[stylesheet("maps")],
        )
        views = pn.Column(
            *rows,
            self._map_row,
            margin=0,
            stylesheets=[stylesheet("column")],
            sizing_mode="stretch_both",
            styles={"flex": "17 1 0", "min-width": "0", "min-height": "0"},
        )
        download = Download()
        side = pn.Column(
            panel(
                "Objects: estimate ± standard deviation, and truth",
                self.table,
                weight=10,
                tools=download_buttons("objects", TableRow, self._table_shown, download),
            ),
            panel(
                "Events",
                self.log,
                weight=6,
                tools=download_buttons("events", LogLine, self._log_shown, download),
            ),
            panel("Time of an iteration", self.times, weight=2.7),
            progress_card(self.progress),
            margin=0,
            stylesheets=[stylesheet("column")],
            sizing_mode="stretch_both",
            styles={"flex": "10.5 1 0", "min-width": "0", "min-height": "0"},
        )
        body = pn.Row(
            views,
            side,
            margin=0,
            sizing_mode="stretch_both",
            styles={"flex": "1 1 0", "min-height": "0"},
            stylesheets=[stylesheet("body")],
        )
        main = pn.Column(
            unseen_title(TITLE),
            self.transport.layout(stylesheet("transport")),
            body,
            margin=0,
            sizing_mode="stretch_width",
            stylesheets=[stylesheet("main")],
        )
        return page_frame(
            here="./",
            title=TITLE,
            description="Variational separation of radar objects and interference, live.",
            status=self.transport.status,
            tools=[self.share.layout()],
            sidebar=[*self.guide.layout(), *self.controls.layout()],
            main=main,
        )

    def start(self) -> None:
        """Begin the first run; called when the page has been drawn."""
        synchronise(self.settings, self.notify_error)
        self.guide.write_address()
        if self._trial is not None:
            set_query(TRIAL_KEY, self._trial.link)
            if pn.state.notifications is not None:
                pn.state.notifications.info(f"Opened {self._trial.frame.name}.", duration=6000)
        stored = self._stored
        if stored is not None:
            self.load(stored.frame.name, stored.frame.content)
            self._stored = stored
            set_query(FRAME_KEY, stored.word)
        for error in self._errors:
            self.notify_error(error)
        self.loop.start()
        self.session.restart(self.settings.plan())
        if self._stop_at is not None:
            self.session.run_to(self._stop_at)
        self.loop.wake()

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
        self._take(frame)
        self._kept = KeptFrame(name=name, content=content)
        self._leave_trial()
        if self.settings.preset == LOADED_FRAME:
            self._scene_changed()
        else:
            self.settings.choose_preset(LOADED_FRAME)

    def take_experiment(self, experiment: Experiment) -> None:
        """Set all controls as an experiment wants them and begin a run."""
        self._leave_trial()
        number = self.session.run_number
        self.settings.param.update(**experiment.settings())
        if self.session.run_number == number:
            self._scene_changed()

    def _table_shown(self) -> tuple[TableRow, ...]:
        return () if self._beside is None else self._beside.table

    def _log_shown(self) -> tuple[LogLine, ...]:
        return () if self._beside is None else self._beside.log

    def _take(self, frame: Frame) -> None:
        self._frame = frame
        self.settings.antenna = 0
        brought = frame.anti_aliasing_filter
        with param.parameterized.discard_events(self.settings):
            self.controls.fit_frame(
                frame.radar.sample_rate_hz,
                measured=brought is not None and brought.kind == "measured",
            )

    def _leave_trial(self) -> None:
        """Take trial and frame out of the address once the scene is another one."""
        for held, key in ((self._trial, TRIAL_KEY), (self._stored, FRAME_KEY)):
            if held is not None:
                set_query(key, None)
        self._trial = self._stored = None

    def show(self, picture: Picture) -> None:
        """Draw a picture on all views; called with the document locked."""
        several = picture.static_picture.radar.num_ramps > 1
        if self.session.opening is not None:
            # What several antennas take of the memory is that of fewer iterations.
            self.session.most_kept = self._most_kept // len(self.session.opening.static_pictures)
        with pn.io.hold():
            self._map_row.visible = self._strip.visible = several
            self.delay.update(picture)
            if several:
                running = self.session.phase is Phase.RUNNING and picture.iteration > 0
                self.maps.update(
                    picture, with_image=not running or self._pace.sends_map(picture.iteration)
                )
                self.ramps.update(picture)
            if self._is_time_for_the_side(picture):
                self._beside = picture
                self.progress.update(picture)
                self.times.object = times_html(picture.step_ms)
                self.log.object = log_html(picture.log[-SHOWN_LINES:])
                self.table.object = table_html(picture.table, moving=several)
                self.controls.show_levels(picture.static_picture.levels_text)
                if self.session.opening is not None:
                    self.controls.show_threshold(self.session.opening.estimator.threshold_db)
                self.transport.show(picture, self.loop.rate)
            elif picture.run_number != self._shown_run:
                self.transport.refresh(self.loop.rate, picture)
            self._shown_run = picture.run_number
            self.fast_time.update(picture)
        self._shared_iteration.write(self.session.phase, picture.iteration)

    def _is_time_for_the_side(self, picture: Picture) -> bool:
        """Whether to draw what is beside the views: less often, for it costs the browser most.

        A halted run has it always. The first picture of a run has it not: that one is to come soon.
        """
        now = time.monotonic()
        period_s = max(SIDE_PERIOD_S, SIDE_PICTURES * self._pace.period_s)
        if self.session.phase is Phase.RUNNING and (
            picture.run_number != self._shown_run or now - self._side_drawn < period_s
        ):
            return False
        self._side_drawn = now
        return True

    def notify_error(self, sentence: str) -> None:
        """Notify the user of what cannot be done."""
        if pn.state.notifications is not None:
            pn.state.notifications.error(sentence, duration=8000)
        self.transport.refresh(self.loop.rate)

    def _snapshot(self, key: str) -> Callable[[], SnapshotFile] | None:
        """Return what makes a file of what is shown now, None while there is nothing."""
        shown = self.session.snapshot()
        if shown is None:
            return None
        loaded = shown.opening.plan.preset == LOADED_FRAME
        trial = self._trial.link if self._trial is not None and loaded else ""
        spec = ReportSpec(
            plan=shown.opening.plan,
            trial=trial,
            frame=self._kept if loaded and not trial else None,
            antenna=self.settings.antenna if shown.opening.num_antennas > 1 else 0,
            together=len(shown.opening.static_pictures) > 1,
            fast_time=self.settings.fast_time,
        )
        return partial(make_snapshot, key, snapshot_spec(shown, spec, self.settings.ramp))

    def _scene_changed(self, *_: Any) -> None:
        if self.settings.preset != LOADED_FRAME:
            self._leave_trial()
        self.session.restart(self.settings.plan())
        self.loop.wake()

    def _antenna_chosen(self, *_: Any) -> None:
        """Begin a run of another antenna, where the estimator takes one alone."""
        shown = self.session.opening
        if shown is not None and len(shown.static_pictures) < shown.num_antennas:
            self._scene_changed()

    def _view_changed(self, *_: Any) -> None:
        self.loop.redraw()

    def _ramp_selected(self, ramp: int) -> None:
        self.settings.ramp = ramp

    def _acknowledged(self, attr: str, old: Any, new: Any) -> None:
        del attr, old, new
        self.loop.acknowledged()
