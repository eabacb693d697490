"""Plays a sequence of frames at the pace of a radar: each is due when it comes, late or not.

Frames come at fixed times. A worker gets the newest one with the state after the one before; what
comes while it is busy and is replaced by a newer one is lost, as in a car. A frame is in time if it
is separated before the next one comes. At most two pictures are on their way to the browser; the
newest waits, older ones are dropped.
"""

import asyncio
import logging
import math
import time
from collections.abc import Callable
from concurrent.futures import Executor
from dataclasses import dataclass
from functools import partial
from typing import Any, Generic, Protocol, TypeVar

from vsep.errors import InputError
from vsep_app.jobs.background import BackgroundTasks

_LOG = logging.getLogger(__name__)

MAX_FLIGHT_S = 3.0
MAX_IN_FLIGHT = 2


class PlayedFrame(Protocol):
    """What a worker returns of a frame."""

    @property
    def state(self) -> Any:
        """State for the next frame."""
        ...

    @property
    def picture(self) -> Any:
        """What is drawn."""
        ...


PictureT = TypeVar("PictureT")


@dataclass(frozen=True, kw_only=True)
class Punctuality:
    """How many frames have come, and how many were separated before the next."""

    frames: int = 0
    in_time: int = 0

    @property
    def share(self) -> float:
        """Frames in time, as a share of all; one before the first."""
        return self.in_time / self.frames if self.frames else 1.0

    def after(self, frames: int, *, in_time: bool) -> "Punctuality":
        """Return the counts after one separated frame and those that were lost before it."""
        return Punctuality(frames=self.frames + frames, in_time=self.in_time + int(in_time))


@dataclass(frozen=True, kw_only=True)
class StreamSink(Generic[PictureT]):
    """Where pictures go.

    Parameters
    ----------
    post : callable
        Runs a function on the event loop with the document locked.
    show : callable
        Draws a picture; called with the document locked.
    notify_error : callable
        Tells the user one sentence; called with the document locked.
    watched : callable
        Whether a browser is connected; nothing comes for a page that was closed.
    """

    post: Callable[[Callable[[], None]], Any]
    show: Callable[[PictureT, Punctuality], None]
    notify_error: Callable[[str], None]
    watched: Callable[[], bool]


class StreamLoop(Generic[PictureT]):
    """Drives one sequence; its methods may be called from any thread.

    Parameters
    ----------
    play : callable
        Settings, state, frame number and the number of cycles since the frame before to a
        `PlayedFrame`; a function of a module, called by the pool.
    settings : callable
        What the next frame is to be made with.
    sink : StreamSink
        Where pictures go.
    pool : Executor
        Does the work.
    period_s : float
        From frame to frame.
    background : BackgroundTasks
        Coroutines of the page.
    """

    def __init__(
        self,
        play: Callable[..., PlayedFrame],
        settings: Callable[[], Any],
        sink: StreamSink[PictureT],
        pool: Executor,
        *,
        period_s: float,
        background: BackgroundTasks,
    ) -> None:
        self.punctuality = Punctuality()
        self.number = 0
        self.is_playing = False
        self._play, self._settings, self._sink, self._pool = play, settings, sink, pool
        self._period_s, self._background = period_s, background
        self._command = asyncio.Event()
        self._state: Any = None
        self._run = 0
        self._in_flight, self._sent_at = 0, 0.0
        self._waiting: tuple[PictureT, Punctuality] | None = None

    def start(self) -> None:
        """Begin with the first frame."""
        self.is_playing = True
        self._background.begin(self._work())

    def close(self) -> None:
        """Stop for good."""
        self._background.close()

    def pause(self) -> None:
        """Let no further frame come."""
        self.is_playing = False

    def resume(self) -> None:
        """Let frames come again."""
        self.is_playing = True
        self._background.call(self._command.set)

    def restart(self) -> None:
        """Begin again with the first frame."""
        self._run += 1
        self._state, self.number, self.punctuality = None, 0, Punctuality()
        self.resume()

    def acknowledged(self) -> None:
        """Take note that the browser has drawn a picture."""
        self._background.call(self._landed)

    async def _work(self) -> None:
        due, cycles = time.monotonic(), 1
        while True:
            if not self.is_playing or not self._sink.watched():
                self._command.clear()
                # Whether somebody watches is not told: it is looked after.
                await _signalled(self._command, 1.0)
                due = time.monotonic()
                continue
            await asyncio.sleep(max(0.0, due - time.monotonic()))
            run, number = self._run, self.number
            played = await self._played(number, cycles)
            if run != self._run:
                due, cycles = time.monotonic(), 1
                continue
            late_s = time.monotonic() - due
            # The newest frame that has come by now is the next; at least one comes.
            cycles = max(1, math.floor(late_s / self._period_s))
            if played is not None and self._state is None:
                # Separated from nothing, by a worker that may just have begun: the pace starts now.
                due, cycles = time.monotonic(), 1
            elif played is not None:
                in_time = late_s <= self._period_s
                self.punctuality = self.punctuality.after(cycles, in_time=in_time)
            if played is not None:
                self._state = played.state
                self._offer(played.picture)
            due += cycles * self._period_s
            self.number = number + cycles

    async def _played(self, number: int, cycles: int) -> PlayedFrame | None:
        """Have a frame separated; whatever goes wrong becomes a sentence for the user."""
        loop = asyncio.get_running_loop()
        arguments = self._settings(), self._state, number, cycles
        try:
            return await loop.run_in_executor(self._pool, self._play, *arguments)
        except Exception as error:
            self.is_playing = False
            sentence = str(error)
            if not isinstance(error, InputError):
                _LOG.error("a frame of a sequence failed", exc_info=error)
                sentence = f"This frame failed ({type(error).__name__}: {error})."
            self._sink.post(partial(self._sink.notify_error, sentence))
            return None

    def _offer(self, picture: PictureT) -> None:
        if self._in_flight >= MAX_IN_FLIGHT and time.monotonic() - self._sent_at < MAX_FLIGHT_S:
            self._waiting = picture, self.punctuality
            return
        self._waiting = None
        self._send(picture, self.punctuality)

    def _send(self, picture: PictureT, punctuality: Punctuality) -> None:
        if time.monotonic() - self._sent_at >= MAX_FLIGHT_S:
            self._in_flight = 0  # a browser that was silent for too long
        self._in_flight, self._sent_at = self._in_flight + 1, time.monotonic()
        self._sink.post(partial(self._sink.show, picture, punctuality))

    def _landed(self) -> None:
        self._in_flight = max(0, self._in_flight - 1)
        if self._waiting is not None and self._in_flight < MAX_IN_FLIGHT:
            waiting, self._waiting = self._waiting, None
            self._send(*waiting)


async def _signalled(event: asyncio.Event, seconds: float) -> None:
    """Wait for an event, but not longer."""
    try:
        await asyncio.wait_for(event.wait(), seconds)
    except TimeoutError:
        return
