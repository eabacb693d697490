import asyncio
import itertools
import socket
import threading
import time
from types import SimpleNamespace

import pytest
from vsep_app.server import sessions as registry_module
from vsep_app.server.sessions import (
    LOADING_S,
    PAUSE_S,
    Admission,
    ServerLimits,
    Session,
    SessionRegistry,
    _has_gone,
    _post,
)

from tests.app.test_shared_runs import _run


class Page:
    """A page that only knows whether it is closed."""

    closed = expired = 0

    def close(self):
        self.closed += 1

    def expire(self):
        self.expired += 1


def _session(registry, *, watched, age_s=0.0):
    page, queue = Page(), Page()
    registry.open_sessions[page] = Session(
        page=page,
        queue=queue,
        watched=lambda: watched,
        since=time.monotonic() - age_s,
        expire=page.expire,
    )
    return page, queue


@pytest.fixture
def registry():
    """A lobby with two places."""
    return SessionRegistry(ServerLimits(most_pages=2))


def test_a_page_that_leaves_takes_its_work_along_once(registry):
    page, queue = _session(registry, watched=False)
    registry.leave(page)
    registry.leave(page)
    assert (page.closed, queue.closed) == (1, 1)


def test_places_are_for_pages_that_are_looked_at_or_loading(registry):
    _session(registry, watched=True, age_s=2.0 * LOADING_S)
    _session(registry, watched=False, age_s=0.0)
    _session(registry, watched=False, age_s=2.0 * LOADING_S)
    assert registry.num_places_taken == 2


def test_who_has_loaded_longest_gives_up_a_place_and_no_page_that_is_looked_at(registry):
    watched, _ = _session(registry, watched=True, age_s=3.0)
    first, _ = _session(registry, watched=False, age_s=4.0)
    second, _ = _session(registry, watched=False, age_s=3.0)
    fresh, _ = _session(registry, watched=False)
    assert registry._make_room()
    assert registry._make_room()
    assert not registry._make_room()
    assert [page.expired for page in (watched, first, second, fresh)] == [0, 1, 1, 0]
    assert registry.num_places_taken == 2
    # Its browser may still come.
    assert first in registry.open_sessions
    assert first.closed == 0


@pytest.mark.parametrize(("comes_back", "closed"), [(True, 0), (False, 1)])
def test_a_page_without_a_browser_has_some_time_to_come_back(
    registry, comes_back, closed, monkeypatch
):
    monkeypatch.setattr(registry_module, "ABSENCE_MS", 10)
    page, _ = _session(registry, watched=comes_back)

    async def scene():
        registry._lost(page, None)
        assert page.closed == 0
        await asyncio.sleep(0.1)

    _run(scene())
    assert page.closed == closed


def test_pages_are_built_one_by_one_with_room_between(registry):
    async def scene():
        door, times = Admission(registry), []

        async def come():
            await door.on_session_created(None)
            times.append(time.monotonic())

        await asyncio.gather(*(come() for _ in range(3)))
        assert min(b - a for a, b in itertools.pairwise(times)) > 0.9 * PAUSE_S

    _run(scene())


def test_nobody_is_let_in_while_a_thread_builds_a_page(registry):
    built = threading.Event()

    def build(_):
        assert built.wait(10.0)

    registry._enter = build

    async def scene():
        door = Admission(registry)
        await door.on_session_created(None)
        building = asyncio.create_task(asyncio.to_thread(registry.enter, None))
        waiting = asyncio.create_task(door.on_session_created(None))
        await asyncio.sleep(3.0 * PAUSE_S)
        assert not waiting.done()
        built.set()
        await asyncio.gather(building, waiting)

    _run(scene())


def test_a_browser_that_has_hung_up_is_noticed():
    ours, theirs = socket.socketpair()
    stream = SimpleNamespace(socket=ours)
    request = SimpleNamespace(connection=SimpleNamespace(stream=stream))
    context = SimpleNamespace(request=request)
    with ours:
        assert not _has_gone(context)
        theirs.close()
        assert _has_gone(context)
    assert not _has_gone(None)
    assert not _has_gone(SimpleNamespace(request=None))


def test_what_comes_after_the_session_is_left():
    queue, shown = [], []
    document = SimpleNamespace(
        session_context=SimpleNamespace(destroyed=False), add_next_tick_callback=queue.append
    )
    _post(document, lambda: shown.append("shown"))
    _post(document, lambda: shown.append("shown"))
    asyncio.run(queue.pop()())
    assert shown == ["shown"]
    document.session_context.destroyed = True
    asyncio.run(queue.pop()())
    document.session_context = None
    _post(document, lambda: shown.append("shown"))
    assert (shown, queue) == (["shown"], [])
