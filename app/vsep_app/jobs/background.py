"""Coroutines of one page on the event loop of the server, begun and ended from any thread.

Bokeh builds pages and runs callbacks on the event loop (3.9) or in threads of its own (3.10); what
goes on between them belongs on the loop in both cases.
"""

import asyncio
import logging
from collections.abc import Callable, Coroutine
from concurrent.futures import Future
from typing import Any

_LOG = logging.getLogger(__name__)


class BackgroundTasks:
    """The coroutines of a page.

    Parameters
    ----------
    loop : asyncio.AbstractEventLoop or None
        The event loop of the server; None takes the one on which the first coroutine is begun.
    """

    def __init__(self, loop: asyncio.AbstractEventLoop | None = None) -> None:
        self._loop = loop
        self._futures: set[Future[None]] = set()

    def another(self) -> "BackgroundTasks":
        """Return the coroutines of another page on the same event loop."""
        return BackgroundTasks(self._loop)

    @property
    def num_running(self) -> int:
        """Number of coroutines that have not ended."""
        return len(self._futures)

    def begin(self, work: Coroutine[Any, Any, None]) -> None:
        """Run a coroutine until it ends or the page closes; an exception goes to the log."""
        if self._loop is None:
            self._loop = asyncio.get_running_loop()
        future = asyncio.run_coroutine_threadsafe(work, self._loop)
        self._futures.add(future)
        future.add_done_callback(self._ended)

    def call(self, function: Callable[[], object]) -> None:
        """Call a function on the event loop, soon; at once where no loop runs yet."""
        if self._loop is None:
            function()
        else:
            self._loop.call_soon_threadsafe(function)

    def close(self) -> None:
        """End all coroutines."""
        for future in tuple(self._futures):
            future.cancel()

    def _ended(self, future: Future[None]) -> None:
        self._futures.discard(future)
        if not future.cancelled() and (error := future.exception()) is not None:
            _LOG.error("a task of a page failed", exc_info=error)
