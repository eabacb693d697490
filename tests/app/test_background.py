"""Coroutines of a page, begun from threads as Bokeh has them and from the event loop."""

import asyncio
import threading

import pytest
from vsep_app.jobs.background import BackgroundTasks

from tests.app.test_shared_runs import _run


async def _until(condition):
    async with asyncio.timeout(5.0):
        while not condition():
            await asyncio.sleep(0.002)


@pytest.mark.parametrize("in_thread", [False, True])
def test_a_coroutine_runs_on_the_loop_of_the_server(in_thread):
    seen = []

    async def work():
        seen.append(threading.get_ident())

    async def scene():
        background = BackgroundTasks(asyncio.get_running_loop())
        if in_thread:
            await asyncio.to_thread(background.begin, work())
        else:
            background.begin(work())
        await _until(lambda: not background.num_running)
        assert seen == [threading.get_ident()]

    _run(scene())


def test_a_call_from_a_thread_wakes_who_waits_on_the_loop():
    async def scene():
        background, event = BackgroundTasks(asyncio.get_running_loop()), asyncio.Event()
        waiting = asyncio.create_task(event.wait())
        await asyncio.to_thread(background.call, event.set)
        assert await asyncio.wait_for(waiting, 5.0)

    _run(scene())


@pytest.mark.parametrize("in_thread", [False, True])
def test_a_page_that_closes_ends_its_coroutines(in_thread):
    ended = []

    async def work():
        try:
            await asyncio.Event().wait()
        finally:
            ended.append(True)

    async def scene():
        background = BackgroundTasks(asyncio.get_running_loop())
        background.begin(work())
        await asyncio.sleep(0.01)
        if in_thread:
            await asyncio.to_thread(background.close)
        else:
            background.close()
        await _until(lambda: ended)
        assert background.num_running == 0

    _run(scene())


def test_what_goes_wrong_in_a_coroutine_is_in_the_log(caplog):
    async def work():
        raise ZeroDivisionError("no")

    async def scene():
        background = BackgroundTasks()
        background.begin(work())
        await _until(lambda: not background.num_running)

    _run(scene())
    assert "a task of a page failed" in caplog.text
    assert "ZeroDivisionError" in caplog.text
