"""A page that is closed leaves nothing in the memory of the server."""

import asyncio
import gc
import random
import time
import weakref
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from typing import Any

import pytest
from bokeh.document import Document
from bokeh.model import Model
from vsep_app.jobs.run_session import RunSession
from vsep_app.pages.base import PageBase
from vsep_app.server import main, sessions
from vsep_app.server.access import EntryRules

from tests.app.conftest import served
from tests.load.classroom import TABS, Student


class Threads(ThreadPoolExecutor):
    """The workers of all pages, in this process."""

    def queue(self) -> "Threads":
        """Return where a page hands in its jobs."""
        return self

    def close(self) -> None:
        """A page has left; the workers stay."""


@pytest.fixture
def opened(monkeypatch: pytest.MonkeyPatch) -> Iterator[Any]:
    """Serve the dashboard from a thread; sessions end soon after their connection."""
    monkeypatch.setattr(main, "CHECK_SESSIONS_MS", 100)
    monkeypatch.setattr(main, "UNUSED_SESSION_MS", 1000)
    monkeypatch.setattr(sessions, "ABSENCE_MS", 100)
    with Threads(max_workers=1) as workers:
        monkeypatch.setattr(sessions, "shared_pool", lambda: workers)
        with served(entry=EntryRules(open_to_all=True)) as server:
            yield server


def living() -> list[Any]:
    """Return pages, runs, documents and their models that something holds."""
    gc.collect()
    return [one for one in gc.get_objects() if is_of_a_page(type(one))]


@cache
def is_of_a_page(kind: type) -> bool:
    """Whether objects of a class belong to one page."""
    return issubclass(kind, PageBase | RunSession | Document | Model)


async def visit_all(url: str) -> list[str]:
    """Open each page, wait for what it shows and leave it; return what went wrong."""
    student = Student(url, "simulation-1&trials=0", 0)
    for tab in TABS:
        await student.visit(tab, time.monotonic() + 0.3, (0.1, 0.2), 10.0, random.Random(1))
    assert student.num_visits == len(TABS)
    assert student.pictures
    return student.errors


def test_nothing_is_left_of_pages_that_were_closed(opened: Any) -> None:
    before = weakref.WeakSet(living())
    assert asyncio.run(visit_all(f"http://127.0.0.1:{opened.port}/")) == []
    # Timers of a page may have some seconds to go.
    for _ in range(20):
        left = [type(one).__name__ for one in living() if one not in before]
        if not left:
            break
        time.sleep(0.5)
    assert left == []
    assert not opened.registry.open_sessions
