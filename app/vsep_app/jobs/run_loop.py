"""Runs a session: jobs go to a pool of workers, the newest picture goes to the screen.

The functions that do the work run in other processes: they belong to modules, and all they need is
handed to them.

Two tasks on the event loop. One takes the session's jobs to the pool, at the pace the user set. The
other makes a picture whenever something changed, of whatever is newest by then, and hands it to the
document; at most two pictures are on their way until the browser says that it has drawn them, so
that a slow browser never falls behind. Nothing else is queued: a new run replaces whatever is under
way. Callbacks of the page may come from any thread; what they change of the tasks is changed on the
event loop.
"""

import asyncio
import contextlib
import logging
import time
from collections import deque
from collections.abc import Callable, Hashable
from concurrent.futures import Executor
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, Generic, Protocol, TypeVar

from vsep.errors import InputError
from vsep_app.jobs.background import BackgroundTasks
from vsep_app.jobs.run_session import AnyStep, Job, JobKind, PreparedRun, RunSession, Snapshot
from vsep_app.jobs.shared_runs import SharedResources
from vsep_app.jobs.weak_memo import WeakMemo

_LOG = logging.getLogger(__name__)

MAX_FLIGHT_S = 3.0
MAX_IN_FLIGHT = 2  # one that the browser draws while the next one is on its way
RATE_WINDOW_S = 2.0


class AnyPicture(Protocol):
    """What is drawn of a run; the loop only looks whose it is."""

    @property
    def run_number(self) -> int:
        """The run that it shows."""
        ...


PlanT = TypeVar("PlanT")
PreparedT = TypeVar("PreparedT", bound=PreparedRun)
StepT = TypeVar("StepT", bound=AnyStep)
PictureT = TypeVar("PictureT", bound=AnyPicture)


def _no_key(_: Any) -> Hashable:
    return None


@dataclass(frozen=True, kw_only=True)
class RunCallbacks(Generic[PlanT, PreparedT, StepT, PictureT]):
    """The three pieces of work, done by the pool.

    Parameters
    ----------
    prepare : callable
        Plan, and what `extra_arguments` returns, to prepared run; may raise `InputError` with a
        sentence for the user.
    advance : callable
        Prepared run and state to the next step.
    compose : callable
        Snapshot, and what `view` returns, to picture.
    extra_arguments, view : callable
        Further arguments: what a plan does not hold, and how the user wants to see the run.
    key : callable
        Name of the run of a plan, under which all sessions share it; None shares nothing.
    compact : WeakMemo or None
        Makes of a step what is kept of it for the display.
    strip : callable or None
        Makes of a step what the picture of a later one needs; None takes it whole.
    """

    prepare: Callable[..., PreparedT]
    advance: Callable[[PreparedT, Any], StepT]
    compose: Callable[..., PictureT]
    extra_arguments: Callable[[], tuple[Any, ...]] = tuple
    view: Callable[[], tuple[Any, ...]] = tuple
    key: Callable[[PlanT], Hashable] = _no_key
    compact: WeakMemo[StepT] | None = None
    strip: Callable[[StepT], StepT] | None = None


@dataclass(frozen=True, kw_only=True)
class PictureSink(Generic[PictureT]):
    """Where results go.

    Parameters
    ----------
    post : callable
        Runs a function on the event loop with the document locked.
    show : callable
        Draws a picture; called with the document locked.
    notify_error : callable
        Tells the user one sentence; called with the document locked.
    speed : callable
        Iterations per second that the user wants.
    watched : callable
        Whether a browser is connected; nothing runs for a page that was closed.
    """

    post: Callable[[Callable[[], None]], Any]
    show: Callable[[PictureT], None]
    notify_error: Callable[[str], None]
    speed: Callable[[], float]
    watched: Callable[[], bool]


class FrameLoop(Generic[PlanT, PreparedT, StepT, PictureT]):
    """Drives one session; its methods may be called from any thread."""

    def __init__(
        self,
        session: RunSession[PlanT, PreparedT, StepT],
        callbacks: RunCallbacks[PlanT, PreparedT, StepT, PictureT],
        sink: PictureSink[PictureT],
        pool: Executor,
        shared_resources: SharedResources | None = None,
        background: BackgroundTasks | None = None,
    ) -> None:
        self.session = session
        self.shown = 0
        self._callbacks, self._sink, self._pool = callbacks, sink, pool
        self._shared_resources = shared_resources or SharedResources()
        self._background = background or BackgroundTasks()
        self._command = asyncio.Event()
        self._changed = asyncio.Event()
        self._drawn = asyncio.Event()
        self._hurry = asyncio.Event()
        self._in_flight = 0
        self._arrivals: deque[float] = deque(maxlen=256)

    @property
    def rate(self) -> float:
        """Iterations per second over the last two seconds."""
        since = time.monotonic() - RATE_WINDOW_S
        arrivals = [at for at in tuple(self._arrivals) if at >= since]
        if len(arrivals) < 2:
            return 0.0
        return (len(arrivals) - 1) / max(arrivals[-1] - arrivals[0], 1e-3)

    def start(self) -> None:
        """Begin to work; the session may have a plan already."""
        self._background.begin(self._work())
        self._background.begin(self._draw())

    def close(self) -> None:
        """Stop for good."""
        self._background.close()

    def wake(self) -> None:
        """Look at the session again: the user commanded something."""
        self._background.call(self._look_again)

    def redraw(self) -> None:
        """Make the picture again: a view setting changed."""
        self._background.call(self._changed.set)

    def acknowledged(self) -> None:
        """Take note that the browser has drawn a picture."""
        self._background.call(self._landed)

    def _look_again(self) -> None:
        self._arrivals.clear()
        self._command.set()
        self._changed.set()
        self._hurry.set()

    def _landed(self) -> None:
        self._in_flight = max(0, self._in_flight - 1)
        self._drawn.set()

    async def _in_pool(self, function: Callable[..., Any], *arguments: Any) -> Any:
        return await asyncio.get_running_loop().run_in_executor(self._pool, function, *arguments)

    async def _work(self) -> None:
        due = 0.0
        while True:
            self._command.clear()
            job = self.session.next_job()
            if job is None or not self._sink.watched():
                await self._command.wait()
                continue
            await self._unless_stale(job, asyncio.ensure_future(self._do(job)))
            if job.run_number != self.session.run_number:
                continue
            if job.kind is JobKind.PREPARE:
                due = time.monotonic()
                continue
            self._arrivals.append(time.monotonic())
            due = max(due + 1.0 / self._sink.speed(), time.monotonic())
            await _wait(self._command, due - time.monotonic())

    async def _unless_stale(self, job: Job[PlanT, PreparedT], doing: asyncio.Future[None]) -> None:
        """Wait for a job, but not once its run is over; it is dropped then."""
        while not doing.done() and job.run_number == self.session.run_number:
            self._command.clear()
            command = asyncio.ensure_future(self._command.wait())
            either: set[asyncio.Future[Any]] = {doing, command}
            try:
                await asyncio.wait(either, return_when=asyncio.FIRST_COMPLETED)
            except asyncio.CancelledError:
                doing.cancel()
                raise
            finally:
                command.cancel()
        doing.cancel()

    async def _do(self, job: Job[PlanT, PreparedT]) -> None:
        """Do one job; whatever goes wrong becomes a sentence for the user."""
        try:
            if job.kind is JobKind.PREPARE:
                prepared_run = await self._prepared_run(job.plan)
                news = self.session.prepared(job, prepared_run)
            elif job.kind is JobKind.REPLAY:
                news = self.session.replayed(job)
            else:
                key, make = self._callbacks.key(job.plan), partial(self._step, job)
                step = await self._shared_resources.runs.step(key, job.iteration, make)
                news = self.session.advanced(job, step)
        except Exception as error:
            news = self.session.failed(job)
            if news:
                self._complain(error)
        if news:
            self._changed.set()

    async def _prepared_run(self, plan: PlanT) -> Any:
        callbacks = self._callbacks
        make = partial(self._in_pool, callbacks.prepare, plan, *callbacks.extra_arguments())
        return await self._shared_resources.runs.prepared_run(
            callbacks.key(plan), make, callbacks.compact
        )

    async def _step(self, job: Job[PlanT, PreparedT]) -> Any:
        """Compute the step of a job; where its state is only kept for the display, from the start.

        That happens when the run was shared and is forgotten.
        """
        prepared_run: Any = job.prepared_run
        state = job.state
        if not job.is_exact:
            state = prepared_run.initial_state
            for _ in range(job.iteration - 1):
                state = (await self._in_pool(self._callbacks.advance, prepared_run, state)).state
        return await self._in_pool(self._callbacks.advance, prepared_run, state)

    async def _picture(self, snapshot: Snapshot[PreparedT, StepT]) -> PictureT:
        callbacks, steps = self._callbacks, snapshot.steps
        if callbacks.strip is not None and steps:
            earlier = tuple(callbacks.strip(step) for step in steps[:-1])
            snapshot = replace(snapshot, steps=(*earlier, steps[-1]))
        picture: PictureT = await self._in_pool(callbacks.compose, snapshot, *callbacks.view())
        return picture

    async def _draw(self) -> None:
        while True:
            await self._changed.wait()
            await self._room_in_flight()
            self._changed.clear()
            self._hurry.clear()
            snapshot = self.session.snapshot()
            if snapshot is None or not self._sink.watched():
                continue
            started = time.monotonic()
            try:
                picture = await self._picture(snapshot)
            except Exception as error:
                self._complain(error)
                continue
            if snapshot.run_number != self.session.run_number:
                continue
            self._in_flight += 1
            self._sink.post(partial(self._show, picture, time.monotonic()))
            period_s = self._shared_resources.pace.period_s
            await _wait(self._hurry, started + period_s - time.monotonic())

    async def _room_in_flight(self) -> None:
        """Wait until the browser has drawn enough, or has been silent for too long."""
        while self._in_flight >= MAX_IN_FLIGHT:
            self._drawn.clear()
            if not await _wait(self._drawn, MAX_FLIGHT_S):
                self._in_flight = 0

    def _show(self, picture: PictureT, ready_at: float) -> None:
        self._shared_resources.pace.drawn(time.monotonic() - ready_at)
        if picture.run_number != self.session.run_number:
            self.acknowledged()
            return
        self._sink.show(picture)
        self.shown += 1

    def _complain(self, error: Exception) -> None:
        sentence = str(error)
        if not isinstance(error, InputError):
            _LOG.error("a step of a run failed", exc_info=error)
            sentence = f"This iteration failed ({type(error).__name__}: {error})."
        self._sink.post(lambda: self._sink.notify_error(sentence))


async def _wait(event: asyncio.Event, seconds: float) -> bool:
    """Wait for an event, but not longer; return whether it came."""
    if seconds > 0.0 and not event.is_set():
        with contextlib.suppress(TimeoutError):
            await asyncio.wait_for(event.wait(), seconds)
    return event.is_set()
