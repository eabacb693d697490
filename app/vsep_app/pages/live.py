"""The page: three views, what is beside them, and the session behind it."""

import time
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any

import panel as pn

from vsep.files.frame import Frame
from vsep.inference.core.progress import Termination
from vsep_app.jobs.frame_store import FRAME_KEY, StoredFrame, frame_of_query
from vsep_app.jobs.preview import Preview
from vsep_app.jobs.run_loop import RunCallbacks
from vsep_app.jobs.run_session import Phase
from vsep_app.jobs.tasks import (
    advance,
    compact,
    compose,
    prepare,
    preview,
    run_key,
    strip,
)
from vsep_app.model.alternatives import alternatives
from vsep_app.model.picture import Picture
from vsep_app.model.settings import LOADED_FRAME, PLAN_NAMES, VIEW_NAMES, Settings
from vsep_app.model.trial_link import TRIAL_KEY, OpenedTrial, trial_of_query
from vsep_app.model.url import parse_iteration, parse_query
from vsep_app.pages.base import PageContext, PageParts
from vsep_app.pages.live_address import with_start
from vsep_app.pages.live_stage import StagedPage
from vsep_app.pages.live_views import LiveViews
from vsep_app.report.snapshot import SnapshotFile, make_snapshot, snapshot_spec
from vsep_app.report.spec import KeptFrame, ReportSpec
from vsep_app.teaching.experiment import LIVE, Experiment, open_experiment
from vsep_app.teaching.guide import Guide, cards_html
from vsep_app.widgets.chirp_drag import ChirpDrag
from vsep_app.widgets.controls import Controls, slope_remark
from vsep_app.widgets.headline import Headline
from vsep_app.widgets.keys import ITERATION_PREFIX
from vsep_app.widgets.location import set_query, synchronise
from vsep_app.widgets.object_drag import ObjectDrag
from vsep_app.widgets.share import Share
from vsep_app.widgets.sound import NAMES as HEARD
from vsep_app.widgets.sound import Loudspeaker
from vsep_app.widgets.transport import Transport

OPENING_SHARE = 0.25  # of the speed, for the first iterations after a run was begun by hand
PREVIEW_HEADLINE = "This is what the radar would receive. Let go, and it is separated."
EQUAL_HEADLINE = "Your own slope: the other chirp is a steady tone, as an object is. Let go."
SIDE_PERIOD_S = 0.3
SIDE_PICTURES = 4


class Dashboard(StagedPage):
    """One user's dashboard."""

    address = "./"
    has_scene = True

    def __init__(self, context: PageContext) -> None:
        self._stored, query, handover_errors = frame_of_query(
            with_start(context.query), context.shared_resources.frames
        )
        self._trial, query, trial_errors = trial_of_query(query)
        query, opened, unknown = open_experiment(query, context.experiments, LIVE)
        values, errors = parse_query(query)
        trial_values = self._trial.values if self._trial else {}
        # Of a trial the scene is given; of other settings the address is right.
        scene = self._trial.scene if self._trial else {}
        super().__init__(context, Settings(**{**trial_values, **values, **scene}))
        self._stop_at, more = parse_iteration(query)
        self._errors += handover_errors + trial_errors + unknown + errors + more
        self._kept: KeptFrame | None = None
        self._side_drawn = 0.0
        self._shown_run = 0
        self.controls = Controls(self.settings, self.load, self._moved)
        self.chirps = ChirpDrag(self.settings, self.controls.widgets)
        self.objects = ObjectDrag(self.settings, self.controls.widgets["placed"], self._moved)
        self.views = LiveViews(
            self._ramp_selected,
            self.chirps.take,
            objects=self.objects,
            cards=cards_html(context.experiments, context.shared_resources.card_pictures.addresses),
        )
        self.headline = Headline()
        self._acknowledge(self.views.fast_time.source)
        self.preview: Preview[Picture] = Preview(
            context.pool,
            preview,
            self._show_preview,
            post=context.post,
            background=context.background,
        )
        self.guide = Guide(
            context.experiments,
            here=LIVE,
            take=self.take_experiment,
            opened=opened,
            run=lambda: self.press("run"),
            widgets=self.controls.widgets,
            answered=self._answered,
        )
        if self._trial is not None:
            self._take_trial(self._trial)
        self._make_loop(
            RunCallbacks(
                prepare=prepare,
                advance=advance,
                compose=compose,
                extra_arguments=lambda: (self._frame, self.settings.antenna),
                view=self._view,
                key=run_key,
                compact=compact,
                strip=strip,
            )
        )
        self._pace, self._most_kept = context.shared_resources.pace, context.most_kept
        self.transport = Transport(self.settings, self.session, self.loop.wake, with_chirps=True)
        self.share = Share(
            self._snapshot,
            pool=context.pool,
            post=context.post,
            notify_error=self.notify_error,
            background=context.background,
        )
        self.loudspeaker = Loudspeaker(
            self.session.snapshot,
            lambda: self.settings.antenna,
            self.views.fast_time.source,
            pool=context.pool,
            post=context.post,
            background=context.background,
        )
        self.settings.param.watch(lambda *_: self._restart(), list(PLAN_NAMES))
        self.settings.param.watch(lambda *_: self.loop.redraw(), list(VIEW_NAMES))
        self.settings.param.watch(lambda *_: self._antenna_chosen(), "antenna")

    def page(self) -> Any:
        """Return the whole page."""
        body = self.views.layout()
        first = self._context.shared_resources.first_pictures.get(self.settings.plan())
        if first is not None and self.settings.ramp == 0:
            # What the browser has from the beginning need not be drawn a second time.
            self.views.show_before(first.picture, can_drag=self.chirps.can_drag)
            self.headline.show(first.picture, is_first=self._stop_at == 0)
        self.fault.cover(body)
        self.toolbar = self.transport.layout()
        self.stage(self.guide.experiment)
        self.guide.choice.param.watch(lambda _: self.stage(self.guide.experiment), "value")
        self.headline.play.on_click(lambda _: self.transport.command("run"))
        return PageParts(
            description="Variational separation of radar objects and interference, live.",
            status=self.transport.status,
            tools=[self.share.layout()],
            sidebar=[*self.guide.layout(), *self.controls.layout()],
            folded=self.controls.folded,
            main=[self.toolbar, self.headline.layout(), self.fault.pane, body],
        )

    def press(self, name: str) -> None:
        """Do what a key or a click stands for: a ramp, an iteration, or a button of the toolbar."""
        ramp_step = {"ramp_back": -1, "ramp_next": 1}.get(name)
        if ramp_step is not None:
            self._ramp_selected(self.settings.ramp + ramp_step)
        elif self.guide.press(name):
            return
        elif name == "swipe":
            self.views.map.swipe()
        elif name == "delete":
            self.objects.delete()
        elif name in ("pin", "unpin"):
            self.pin(wanted=name == "pin")
        elif name in HEARD:
            self.loudspeaker.play(name)
        elif name.startswith(ITERATION_PREFIX):
            self.session.scrub(int(name.removeprefix(ITERATION_PREFIX)))
            self.loop.wake()
        else:
            running = self.session.phase is Phase.RUNNING
            self.transport.command(("pause" if running else "run") if name == "toggle" else name)

    def _ramp_selected(self, ramp: int) -> None:
        shown = self.session.prepared_run
        if shown is not None and 0 <= ramp < shown.static_picture.radar.num_ramps:
            super()._ramp_selected(ramp)

    def _view(self) -> tuple[Any, ...]:
        return *super()._view(), self.settings.crossing

    def _moved(self) -> None:
        """Show the frame of settings that still move; the estimator waits for their release."""
        plan = self.controls.moving_plan()
        if self.objects.moving is not None:
            plan = replace(plan, placed=self.objects.moving)
        if plan == self.settings.plan():
            if self.preview.is_active:
                self.preview.end()
                self.loop.redraw()
        elif self.session.prepared_run is not None:
            if self._trial is not None and self.controls.keeps_scene:
                plan = replace(plan, preset=self._trial.scene["preset"])
            self.preview.want(plan, self._frame, self.settings.antenna, *self._view())

    def _show_preview(self, picture: Picture) -> None:
        """Draw a frame of which nothing is estimated; called with the document locked."""
        with pn.io.hold():
            equal = bool(slope_remark(picture.crossing.true))
            self.headline.tell(EQUAL_HEADLINE if equal else PREVIEW_HEADLINE)
            self.transport.show_preview()
            self.controls.show_levels(picture.static_picture.levels_text)
            self.views.map.freeze(self.objects.moving is not None)
            self.views.show_before(picture, can_drag=self.chirps.can_drag)
            self.views.map.freeze(False)

    def _was_drawn(self, attr: str, old: Any, new: Any) -> None:
        super()._was_drawn(attr, old, new)
        self.preview.drawn()

    def _waits(self) -> bool:
        return self.guide.awaits_prediction

    def _speed(self) -> float:
        return super()._speed() * (OPENING_SHARE if self.transport.is_opening else 1.0)

    def start(self) -> None:
        """Begin the first run; called when the page has been drawn."""
        synchronise(self._context.location, self.settings, self.notify_error)
        self._write_experiment()
        self._write_words()
        if self._trial is not None:
            set_query(self._context.location, TRIAL_KEY, self._trial.link)
        if self._stored is None:
            self._begin()
        else:
            self._context.background.begin(self._begin_with(self._stored))

    async def _begin_with(self, stored: StoredFrame) -> None:
        """Begin with the frame of a link."""
        name, content = stored.frame.name, stored.frame.content
        frame = await self._read(name, content)

        def begin() -> None:
            if frame is not None:
                self._take_file(name, content, frame)
                self._stored = stored
                set_query(self._context.location, FRAME_KEY, stored.word)
            self._begin()

        self._context.post(begin)

    def _loaded(self, name: str, content: bytes) -> None:
        self._kept = KeptFrame(name=name, content=content)
        self._leave_trial()

    def _set(self, experiment: Experiment) -> None:
        self._leave_trial()
        super()._set(experiment)
        self.stage(experiment)

    def _take_frame(self, frame: Frame) -> None:
        super()._take_frame(frame)
        self.settings.antenna = 0

    def _take_trial(self, trial: OpenedTrial) -> None:
        """Show the frame of a trial; where its scene is known, with the controls unlocked."""
        if not trial.scene:
            self._take_frame(trial.frame)
            self.settings.choose_preset(LOADED_FRAME)
        else:
            self._frame = trial.frame
            self.controls.keeps_scene = True
            self.settings.preset = LOADED_FRAME
        self.headline.tell_scene(
            f"Trial of a study: {trial.frame.name}. A control of the scene that you move leaves "
            "it: a new frame is drawn with the settings that you see."
        )

    def _goes_on_from_trial(self) -> bool:
        """Leave a trial for its preset, if a setting of the scene is not that of the trial."""
        if self._trial is None or self.settings.preset != LOADED_FRAME:
            return False
        scene = {key: value for key, value in self._trial.scene.items() if key != "preset"}
        if all(getattr(self.settings, name) == value for name, value in scene.items()):
            return False
        self.settings.preset = self._trial.scene["preset"]
        return True

    def _leave_trial(self) -> None:
        """Take trial and frame out of the address once the scene is another one."""
        for held, key in ((self._trial, TRIAL_KEY), (self._stored, FRAME_KEY)):
            if held is not None:
                set_query(self._context.location, key, None)
        self._trial = self._stored = None
        self.controls.keeps_scene = False
        self.headline.tell_scene("")

    def show(self, picture: Picture) -> None:
        """Draw a picture on all views; called with the document locked."""
        if self.preview.is_active:
            self.loop.acknowledged()
            return
        if self.session.prepared_run is not None:
            # What several antennas take of the memory is that of fewer iterations.
            self.session.most_kept = self._most_kept // len(
                self.session.prepared_run.static_pictures
            )
        with pn.io.hold():
            self.fault.clear(shown=(picture.run_number, picture.iteration))
            running = self.session.phase is Phase.RUNNING
            self.headline.show(
                picture,
                is_first=not running and picture.iteration == 0,
                remark=slope_remark(picture.crossing.true),
            )
            if self._is_time_for_the_side(picture):
                self.views.show_side(picture)
                self.headline.describe(alternatives(picture))
                self.tell_pinned(picture)
                self.controls.show_levels(picture.static_picture.levels_text)
                if self.session.prepared_run is not None:
                    self.controls.show_threshold(self.session.prepared_run.estimator.threshold_db)
                self.transport.show(picture, self.loop.rate)
            elif picture.run_number != self._shown_run:
                self.transport.refresh(self.loop.rate, picture)
            begins = not running and picture.iteration == picture.num_iterations == 0
            self.views.show_cards(begins and self.guide.experiment is None)
            if picture.termination is not Termination.RUNNING:
                self.guide.finished(picture.score)
            self._shown_run = picture.run_number
            self.views.show_before(
                picture,
                can_drag=self.chirps.can_drag,
                with_map=not (running and picture.iteration > 0)
                or self._pace.sends_map(picture.iteration),
            )
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

    def _failed(self, sentence: str) -> None:
        super()._failed(sentence)
        self.transport.refresh(self.loop.rate)

    def _snapshot(self, key: str) -> Callable[[], SnapshotFile] | None:
        """Return what makes a file of what is shown now, None while there is nothing."""
        shown = self.session.snapshot()
        if shown is None:
            return None
        loaded = shown.prepared_run.plan.preset == LOADED_FRAME
        trial = self._trial.link if self._trial is not None and loaded else ""
        spec = ReportSpec(
            plan=shown.prepared_run.plan,
            trial=trial,
            frame=self._kept if loaded and not trial else None,
            antenna=self.settings.antenna if shown.prepared_run.num_antennas > 1 else 0,
            together=len(shown.prepared_run.static_pictures) > 1,
            fast_time=self.settings.fast_time,
        )
        return partial(make_snapshot, key, snapshot_spec(shown, spec, self.settings.ramp))

    def _restart(self) -> None:
        self.preview.end()
        if self._goes_on_from_trial():
            return
        if self.settings.preset != LOADED_FRAME:
            self._leave_trial()
        self.session.restart(self.settings.plan())
        self.loop.wake()

    def _antenna_chosen(self) -> None:
        """Begin a run of another antenna, where the estimator takes one alone."""
        shown = self.session.prepared_run
        if shown is not None and len(shown.static_pictures) < shown.num_antennas:
            self._restart()
