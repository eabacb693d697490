"""Pages of runs: settings, session and loop, the frame that is loaded, and how a run begins."""

import asyncio
from abc import abstractmethod
from collections.abc import Mapping
from functools import partial
from typing import Any, Generic

import param
from bokeh.models import ColumnDataSource, CustomJS

from vsep.errors import InputError
from vsep.files.frame import Frame
from vsep_app.jobs.run_loop import FrameLoop, PictureSink, PictureT, PlanT, PreparedT, RunCallbacks
from vsep_app.jobs.run_session import Phase, RunSession, StepT
from vsep_app.jobs.tasks import READ_UPLOAD
from vsep_app.model.settings import LOADED_FRAME, Settings
from vsep_app.model.url import QUERY_NAMES, parse_iteration, parse_query
from vsep_app.pages.base import PageBase, PageContext
from vsep_app.teaching.experiment import EXPERIMENT_KEY, Experiment
from vsep_app.teaching.guide import Guide
from vsep_app.widgets.controls import Controls
from vsep_app.widgets.fault import FaultNotice
from vsep_app.widgets.location import SharedIteration, set_query

FOLLOWING_RATE = 200.0
"""Iterations a second at most on the way to where the lecturer is."""
_SAY_SO = """
requestAnimationFrame(() => setTimeout(() => {
  drawn.data = {number: [drawn.data.number[0] + 1]}
}, 0))
"""


class RunPage(PageBase, Generic[PlanT, PreparedT, StepT, PictureT]):
    """A page that shows a run as it goes on, of the settings that its controls set."""

    session: RunSession[PlanT, PreparedT, StepT]
    loop: FrameLoop[PlanT, PreparedT, StepT, PictureT]

    def __init__(self, context: PageContext, settings: Settings) -> None:
        super().__init__(context)
        self.settings = settings
        self.fault = FaultNotice()
        #: What was drawn last, None at first.
        self.picture: PictureT | None = None

    @abstractmethod
    def show(self, picture: PictureT) -> None:
        """Draw a picture on all views; called with the document locked."""

    @abstractmethod
    def _restart(self) -> Any:
        """Begin a run of what is chosen now."""

    def _make_loop(self, callbacks: RunCallbacks[PlanT, PreparedT, StepT, PictureT]) -> None:
        context = self._context
        self.session = RunSession(callbacks.compact, callbacks.strip, most_kept=context.most_kept)
        sink = PictureSink(
            post=context.post,
            show=self._show_and_keep,
            notify_error=self._failed,
            speed=self._speed,
            watched=context.watched,
        )
        self.loop = FrameLoop(
            self.session,
            callbacks,
            sink,
            context.pool,
            context.shared_resources,
            context.background,
        )

    def _speed(self) -> float:
        """Return how many iterations a second the user wants."""
        follows = self._context.seat is not None and self.session.is_on_its_way
        return FOLLOWING_RATE if follows else float(self.settings.speed)

    def _answered(self, experiment: Experiment, value: float, is_right: bool | None) -> bool | None:
        """Take an answer, a number judged by the truth of the scene; return whether it is right."""
        picture: Any = self.picture
        if experiment.ask is not None and picture is not None:
            is_right = experiment.ask.is_right(value, picture.static_picture)
        if self._context.seat is not None:
            self._context.seat.answer(experiment.name, value, is_right)
        return is_right

    def _show_and_keep(self, picture: PictureT) -> None:
        self.picture = picture
        self.show(picture)

    def hold(self, held: bool) -> None:
        """Let the run stand still until it is let go."""
        if held != self.session.is_held:
            self.session.is_held = held
            self.loop.wake()

    def show_again(self) -> None:
        """Go on with the run, unless it stands where it was drawn last."""
        picture: Any = self.picture
        drawn = None if picture is None else (picture.run_number, picture.iteration)
        if self.session.phase is Phase.RUNNING or drawn != self._shown():
            self.loop.wake()

    def _view(self) -> tuple[Any, ...]:
        """Return how the user wants to see the run."""
        return self.settings.ramp, self.settings.fast_time, self.settings.antenna

    def _acknowledge(self, source: ColumnDataSource) -> None:
        """Let the browser say when it has drawn what a source brings with every picture."""
        self._drawn = ColumnDataSource({"number": [0]}, name="drawn")
        self._drawn.on_change("data", self._was_drawn)
        source.js_on_change("data", CustomJS(args={"drawn": self._drawn}, code=_SAY_SO))

    def _was_drawn(self, attr: str, old: Any, new: Any) -> None:
        del attr, old, new
        self.loop.acknowledged()

    def close(self) -> None:
        """Stop the run for good: the browser has left."""
        self.loop.close()

    def _failed(self, sentence: str) -> None:
        """Say above the views what cannot be computed; called with the document locked."""
        self.fault.tell(sentence, shown=self._shown())

    def _shown(self) -> tuple[int, int]:
        return self.session.run_number, self.session.cursor

    def _ramp_selected(self, ramp: int) -> None:
        self.settings.ramp = ramp


class ScenePage(RunPage[PlanT, PreparedT, StepT, PictureT]):
    """A page of runs of a preset or of a frame that is loaded."""

    controls: Controls
    guide: Guide

    def __init__(self, context: PageContext, settings: Settings) -> None:
        super().__init__(context, settings)
        self._frame: Frame | None = None
        self._errors: list[str] = []
        self._stop_at: int | None = None
        self._shared_iteration = SharedIteration(context.location)

    def _write_experiment(self) -> None:
        """Keep the experiment in the address, from now on."""

        def write(*_: Any) -> None:
            set_query(self._context.location, EXPERIMENT_KEY, self.guide.choice.value or None)

        self.guide.choice.param.watch(write, "value")
        write()

    def _waits(self) -> bool:
        """Whether the run is not to go on by itself beyond its first picture."""
        return False

    def _begin(self) -> None:
        """Begin the first run, up to the iteration that the address names."""
        for error in self._errors:
            self.notify_error(error)
        self.loop.start()
        self._restart()
        if self._stop_at is not None or self._waits():
            self.session.run_to(self._stop_at or 0)

    def load(self, name: str, content: bytes) -> None:
        """Take a frame file; a bad one is shown as refused and nothing else changes."""

        async def read() -> None:
            frame = await self._read(name, content)
            if frame is not None:
                self._context.post(partial(self._take_file, name, content, frame))

        self._context.background.begin(read())

    async def _read(self, name: str, content: bytes) -> Frame | None:
        """Have a frame file read by a worker; of a bad one the user is told."""
        loop, pool = asyncio.get_running_loop(), self._context.pool
        try:
            frame: Frame = await loop.run_in_executor(pool, READ_UPLOAD, name, content)
        except InputError as error:
            self._context.post(partial(self._refused, str(error)))
            return None
        return frame

    def _refused(self, sentence: str) -> None:
        """Say that a frame file cannot be used, and that it is not."""
        self.notify_error(sentence)
        self.controls.show_refused(sentence)

    def _take_file(self, name: str, content: bytes, frame: Frame) -> None:
        """Show the frame of a file; called with the document locked."""
        self._take_frame(frame)
        self._loaded(name, content)
        if self.settings.preset == LOADED_FRAME:
            self._restart()
        else:
            self.settings.choose_preset(LOADED_FRAME)

    def _loaded(self, name: str, content: bytes) -> None:
        """Take note of the file that the frame is from."""

    def _take_frame(self, frame: Frame) -> None:
        """Suit the controls to a frame, without a run for each of them."""
        self._frame = frame
        brought = frame.anti_aliasing_filter
        with param.parameterized.discard_events(self.settings):
            self.controls.fit_frame(
                frame.radar.sample_rate_hz,
                measured=brought is not None and brought.kind == "measured",
            )

    def _take_settings(self, query: Mapping[str, str]) -> None:
        """Go to the settings and the iteration of an address; what it leaves out is as usual."""
        usual = {name: self.settings.param[name].default for name in QUERY_NAMES}
        self.settings.param.update(**{**usual, **parse_query(query)[0]})
        iteration = parse_iteration(query)[0]
        if iteration is not None:
            self.session.run_to(iteration)
        elif not self._waits():
            self.session.run()
        self.loop.wake()

    def take_experiment(self, experiment: Experiment) -> None:
        """Set all controls as an experiment wants them and begin a run."""
        number = self.session.run_number
        self._set(experiment)
        if self.session.run_number == number:
            self._restart()
        if self._waits():
            self.session.run_to(0)

    def _set(self, experiment: Experiment) -> None:
        self.settings.param.update(**experiment.settings())
