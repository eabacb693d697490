"""Previews while a thumb moves: the newest only, and none once the settings stand."""

import asyncio
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any

from vsep_app.jobs.background import BackgroundTasks
from vsep_app.jobs.preview import Preview

from tests.app.conftest import until
from vsep.errors import InputError


def slow(number: int) -> int:
    if number < 0:
        raise InputError("It cannot be shown.")
    time.sleep(0.02)
    return number


def previewed(
    pool: ThreadPoolExecutor, play: Callable[[Preview[int], list[int]], Any]
) -> list[int]:
    """Return what was shown while `play` went on."""
    shown: list[int] = []

    async def go() -> None:
        background = BackgroundTasks()
        loop = asyncio.get_running_loop()
        preview = Preview(
            pool, slow, shown.append, post=loop.call_soon_threadsafe, background=background
        )
        await play(preview, shown)
        await asyncio.sleep(0.05)
        background.close()

    asyncio.run(go())
    return shown


def test_the_newest_settings_are_shown_and_those_between_are_left_out(
    pool: ThreadPoolExecutor,
) -> None:
    async def play(preview: Preview[int], shown: list[int]) -> None:
        for number in range(20):
            preview.want(number)
            preview.drawn()
            await asyncio.sleep(0.01)
        await until(lambda: shown and shown[-1] == 19)

    shown = previewed(pool, play)
    assert shown == sorted(set(shown))
    assert 2 < len(shown) < 15


def test_nothing_is_shown_once_the_settings_stand(pool: ThreadPoolExecutor) -> None:
    async def play(preview: Preview[int], _: list[int]) -> None:
        preview.want(1)
        await asyncio.sleep(0.005)
        preview.end()
        assert not preview.is_active
        await asyncio.sleep(0.1)

    assert previewed(pool, play) == []


def test_settings_that_cannot_be_shown_do_not_end_the_previews(pool: ThreadPoolExecutor) -> None:
    async def play(preview: Preview[int], shown: list[int]) -> None:
        preview.want(-1)
        await asyncio.sleep(0.05)
        preview.want(5)
        await until(lambda: shown == [5])

    assert previewed(pool, play) == [5]
