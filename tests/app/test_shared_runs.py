import asyncio
from concurrent.futures import ThreadPoolExecutor

import numpy as np
from vsep_app.jobs.shared_runs import (
    BUSY_DELAY_S,
    CALM_DELAY_S,
    MAX_PERIOD_S,
    MIN_PERIOD_S,
    SPARING_EVERY,
    RateLimiter,
    SharedRuns,
)
from vsep_app.jobs.weak_memo import WeakMemo

from tests.app.test_run_session import _state, _step


def _run(scene):
    # A thread of its own: the browser tests keep an event loop running in this one.
    with ThreadPoolExecutor(1) as thread:
        return thread.submit(lambda: asyncio.run(scene)).result()


def _maker(result, made, seconds=0.0):
    async def make():
        made.append(result)
        await asyncio.sleep(seconds)
        return result

    return make


def test_what_several_want_is_made_once():
    async def scene():
        runs, made = SharedRuns(), []
        same = await asyncio.gather(
            *(runs.prepared_run("key", _maker("opening", made, 0.01), None) for _ in range(3))
        )
        steps = await asyncio.gather(
            *(runs.step("key", 1, _maker(_step(_state(0)), made, 0.01)) for _ in range(3))
        )
        later = await runs.step("key", 1, _maker("never", made))
        assert same == ["opening"] * 3
        assert all(step is later for step in steps)
        assert len(made) == 2

    _run(scene())


def test_without_a_key_nothing_is_shared():
    async def scene():
        runs, made = SharedRuns(), []
        for _ in range(2):
            await runs.prepared_run(None, _maker("opening", made), None)
            await runs.step(None, 1, _maker("step", made))
        assert len(made) == 4
        assert len(runs) == 0

    _run(scene())


def test_who_leaves_does_not_take_the_others_work_along():
    async def scene():
        runs, made = SharedRuns(), []
        first = asyncio.create_task(runs.prepared_run("key", _maker("opening", made, 0.05), None))
        second = asyncio.create_task(runs.prepared_run("key", _maker("opening", made, 0.05), None))
        await asyncio.sleep(0.01)
        first.cancel()
        assert await second == "opening"
        assert len(made) == 1

    _run(scene())


def test_work_that_nobody_waits_for_is_dropped():
    async def scene():
        runs, ended = SharedRuns(), []

        async def make():
            try:
                await asyncio.sleep(60.0)
            except asyncio.CancelledError:
                ended.append(True)
                raise

        only = asyncio.create_task(runs.prepared_run("key", make, None))
        await asyncio.sleep(0.01)
        only.cancel()
        await asyncio.sleep(0.01)
        assert ended == [True]

    _run(scene())


def test_an_error_reaches_all_and_is_not_kept():
    async def scene():
        runs = SharedRuns()

        async def fail():
            await asyncio.sleep(0.01)
            raise ValueError("no")

        waiting = [runs.prepared_run("key", fail, None) for _ in range(2)]
        outcomes = await asyncio.gather(*waiting, return_exceptions=True)
        assert [str(one) for one in outcomes] == ["no", "no"]
        assert await runs.prepared_run("key", _maker("good", []), None) == "good"

    _run(scene())


def test_memory_is_bounded_and_the_oldest_runs_are_forgotten():
    async def scene():
        runs = SharedRuns(largest_bytes=250 * 8)
        for key in "abc":
            await runs.prepared_run(key, _maker((np.zeros(100),), []), None)
        assert len(runs) == 2
        assert runs.size == 200 * 8
        made = []
        await runs.prepared_run("c", _maker("never", made), None)
        assert made == []

    _run(scene())


def test_earlier_steps_are_kept_compact():
    async def scene():
        runs, small = SharedRuns(), _step(_state(7))
        compact = WeakMemo(lambda _: small)
        await runs.prepared_run("key", _maker("opening", []), compact)
        for iteration in (1, 2):
            await runs.step("key", iteration, _maker(_step(_state(iteration)), []))
        assert await runs.step("key", 1, _maker("never", [])) is small
        assert (await runs.step("key", 2, _maker("never", []))).state.iteration == 3

    _run(scene())


def test_pictures_come_less_often_while_they_have_to_wait_and_more_often_again():
    pace = RateLimiter()
    assert pace.period_s == MIN_PERIOD_S
    assert pace.sends_map(1)
    for _ in range(100):
        pace.drawn(2.0 * BUSY_DELAY_S)
    assert pace.period_s == MAX_PERIOD_S
    assert [pace.sends_map(i) for i in range(SPARING_EVERY + 1)] == [True, False, False, True]
    for _ in range(100):
        pace.drawn(0.5 * CALM_DELAY_S)
    assert pace.period_s == MIN_PERIOD_S
    assert pace.rate > 0.0
