"""Pictures of settings that still move: the newest is made as soon as the one before is drawn."""

import asyncio
import contextlib
import time
from collections.abc import Callable
from concurrent.futures import Executor
from functools import partial
from typing import Any, Generic, TypeVar

from vsep.errors import InputError
from vsep_app.jobs.background import BackgroundTasks

LEAST_PERIOD_S = 0.05
MAX_FLIGHT_S = 0.5

PictureT = TypeVar("PictureT")


class Preview(Generic[PictureT]):
    """Makes pictures without an estimator while a thumb moves; nothing of them is kept.

    Parameters
    ----------
    pool : Executor
        Does the work.
    make : callable
        Function of a module that makes the picture of what is wanted.
    show : callable
        Draws it; called with the document locked.
    post : callable
        Runs a function with the document locked.
    background : BackgroundTasks
        Coroutines of the page.
    """

    def __init__(
        self,
        pool: Executor,
        make: Callable[..., PictureT],
        show: Callable[[PictureT], None],
        *,
        post: Callable[[Callable[[], None]], Any],
        background: BackgroundTasks,
    ) -> None:
        self._pool, self._make, self._show_picture = pool, make, show
        self._post, self._background = post, background
        self._wanted: tuple[Any, ...] | None = None
        self._working = False
        self._drawn = asyncio.Event()
        #: Whether what is shown, or soon will be, is a preview.
        self.is_active = False

    def want(self, *arguments: Any) -> None:
        """Show the picture of these arguments next, in the place of what was wanted before."""
        self.is_active = True
        self._wanted = arguments
        self._background.call(self._begin)

    def end(self) -> None:
        """Show no preview any more: the settings stand."""
        self.is_active = False
        self._wanted = None

    def drawn(self) -> None:
        """Take note that the browser has drawn something."""
        if self._working:
            self._background.call(self._drawn.set)

    def _begin(self) -> None:
        if not self._working:
            self._working = True
            self._background.begin(self._work())

    async def _work(self) -> None:
        try:
            while (wanted := self._wanted) is not None:
                self._wanted = None
                started = time.monotonic()
                self._drawn.clear()
                loop = asyncio.get_running_loop()
                try:
                    picture = await loop.run_in_executor(self._pool, self._make, *wanted)
                except InputError:
                    continue  # The run that follows says what is wrong with the settings.
                self._post(partial(self._show, picture))
                with contextlib.suppress(TimeoutError):
                    await asyncio.wait_for(self._drawn.wait(), MAX_FLIGHT_S)
                await asyncio.sleep(max(0.0, started + LEAST_PERIOD_S - time.monotonic()))
        finally:
            self._working = False

    def _show(self, picture: PictureT) -> None:
        if self.is_active:
            self._show_picture(picture)
