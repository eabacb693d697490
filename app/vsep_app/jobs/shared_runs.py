"""Runs shared by all sessions with the same settings, and the rate limiter of pictures."""

import asyncio
import time
from collections import OrderedDict, deque
from collections.abc import Awaitable, Callable, Hashable
from dataclasses import dataclass, field
from typing import Any

from vsep_app.jobs.card_pictures import CardPictures
from vsep_app.jobs.first_pictures import FirstPictures
from vsep_app.jobs.frame_store import FrameStore
from vsep_app.jobs.weak_memo import WeakMemo, num_bytes

SHARED_BYTES = 160_000_000
# A longer run is no longer shared.
MAX_RUN_BYTES = 40_000_000

MIN_PERIOD_S = 1.0 / 30.0
MAX_PERIOD_S = 0.25
# A picture that has waited so long to be drawn says that the server is busy, or that it is not.
BUSY_DELAY_S = 0.03
CALM_DELAY_S = 0.01
_SLOWER, _FASTER = 1.1, 0.97
# From this period on maps are sent with every third picture only.
SPARING_PERIOD_S = 0.1
SPARING_EVERY = 3
RATE_WINDOW_S = 5.0


class RateLimiter:
    """How often a running session gets a picture: rarely enough for the server to keep up.

    The time from a picture being ready to its being drawn is that of the server's queue. While it
    is long, all sessions get pictures less often; while it is short, more often.
    """

    def __init__(self) -> None:
        self.period_s = MIN_PERIOD_S
        self._drawn_at: deque[float] = deque(maxlen=4096)

    def drawn(self, delay_s: float) -> None:
        """Take note that a picture was drawn, so long after it was ready."""
        self._drawn_at.append(time.monotonic())
        if delay_s > BUSY_DELAY_S:
            self.period_s = min(MAX_PERIOD_S, _SLOWER * self.period_s)
        elif delay_s < CALM_DELAY_S:
            self.period_s = max(MIN_PERIOD_S, _FASTER * self.period_s)

    def sends_map(self, iteration: int) -> bool:
        """Whether the picture of an iteration of a running session is to have its maps."""
        return self.period_s < SPARING_PERIOD_S or iteration % SPARING_EVERY == 0

    @property
    def rate(self) -> float:
        """Pictures a second, of all sessions, lately."""
        since = time.monotonic() - RATE_WINDOW_S
        return sum(at > since for at in tuple(self._drawn_at)) / RATE_WINDOW_S


@dataclass
class _Run:
    prepared_run: Any
    compact: WeakMemo[Any] | None
    steps: list[Any] = field(default_factory=list)
    size: int = 0

    def append(self, step: Any) -> None:
        """Take the next step; of the one before, what is kept of it is enough."""
        if self.steps and self.compact is not None:
            before = self.steps[-1]
            self.steps[-1] = self.compact(before)
            self.size += num_bytes(self.steps[-1]) - num_bytes(before)
        self.steps.append(step)
        self.size += num_bytes(step)


@dataclass
class _Work:
    task: asyncio.Future[Any]
    waiting: int = 0


class SharedRuns:
    """Runs that several sessions follow: each step is computed by whoever is first.

    All runs together take `largest_bytes` of memory; those not looked at for longest are forgotten.
    """

    def __init__(self, largest_bytes: int = SHARED_BYTES) -> None:
        self._largest = largest_bytes
        self._runs: OrderedDict[Hashable, _Run] = OrderedDict()
        self._under_way: dict[Hashable, _Work] = {}

    def __len__(self) -> int:
        """Return the number of runs."""
        return len(self._runs)

    @property
    def size(self) -> int:
        """Memory of all runs in bytes."""
        return sum(run.size for run in self._runs.values())

    async def prepared_run(
        self, key: Hashable, make: Callable[[], Awaitable[Any]], compact: WeakMemo[Any] | None
    ) -> Any:
        """Return the prepared run of a key; None as key shares nothing."""
        if key is None:
            return await make()
        if key not in self._runs:
            prepared_run = await self._share((key, 0), make)
            if key not in self._runs:
                self._runs[key] = _Run(prepared_run, compact, size=num_bytes(prepared_run))
                self._forget_some()
        self._runs.move_to_end(key)
        return self._runs[key].prepared_run

    async def step(self, key: Hashable, iteration: int, make: Callable[[], Awaitable[Any]]) -> Any:
        """Return a step of a run, as computed or as it is kept for the display."""
        if key is None:
            return await make()
        run = self._runs.get(key)
        if run is not None and iteration <= len(run.steps):
            self._runs.move_to_end(key)
            return run.steps[iteration - 1]
        step = await self._share((key, iteration), make)
        run = self._runs.get(key)
        if run is not None and iteration == len(run.steps) + 1:
            run.append(step)
            self._forget_some(key if run.size > MAX_RUN_BYTES else None)
        return step

    async def _share(self, slot: Hashable, make: Callable[[], Awaitable[Any]]) -> Any:
        """Do work once for all who wait for it; it is dropped when nobody does any more."""
        while True:
            work = self._under_way.get(slot)
            if work is None or work.task.done():
                work = self._under_way[slot] = _Work(asyncio.ensure_future(make()))
            work.waiting += 1
            try:
                return await asyncio.shield(work.task)
            except asyncio.CancelledError:
                # Whoever did the work has left; somebody else has to do it.
                task = asyncio.current_task()
                if not work.task.cancelled() or (task is not None and task.cancelling()):
                    raise
            finally:
                work.waiting -= 1
                if not work.waiting:
                    work.task.cancel()
                if self._under_way.get(slot) is work and (work.task.done() or not work.waiting):
                    del self._under_way[slot]

    def _forget_some(self, too_large: Hashable = None) -> None:
        if too_large is not None:
            self._runs.pop(too_large, None)
        while self._runs and self.size > self._largest:
            self._runs.popitem(last=False)


@dataclass(frozen=True, kw_only=True)
class SharedResources:
    """What all sessions share."""

    runs: SharedRuns = field(default_factory=SharedRuns)
    pace: RateLimiter = field(default_factory=RateLimiter)
    frames: FrameStore = field(default_factory=FrameStore)
    first_pictures: FirstPictures = field(default_factory=FirstPictures)
    card_pictures: CardPictures = field(default_factory=CardPictures)
