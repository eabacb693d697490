"""The loop of sequences: frames come at their times, the newest counts, browsers may be slow."""

import asyncio
import time
from concurrent.futures import ThreadPoolExecutor
from itertools import pairwise
from typing import NamedTuple

import pytest
from vsep_app.jobs.background import BackgroundTasks
from vsep_app.jobs.stream_loop import MAX_IN_FLIGHT, Punctuality, StreamLoop, StreamSink

from tests.app.conftest import until
from vsep.errors import InputError

PERIOD_S = 0.02


class Made(NamedTuple):
    """A frame that was played: the numbers of all before it, and its own."""

    state: tuple
    picture: int


class Player:
    """A loop whose frames are numbers, and what came of them."""

    def __init__(self, pool, *, seconds=0.0, acknowledges=True):
        self.seconds, self.acknowledges = seconds, acknowledges
        self.shown, self.errors, self.cycles, self.settings = [], [], [], []
        self.setting, self.is_watched = "first", True
        sink = StreamSink(
            post=lambda call: call(),
            show=self._show,
            notify_error=self.errors.append,
            watched=lambda: self.is_watched,
        )
        self.background = BackgroundTasks()
        self.loop = StreamLoop(
            self._play,
            lambda: self.setting,
            sink,
            pool,
            period_s=PERIOD_S,
            background=self.background,
        )

    def _play(self, setting, state, number, cycles):
        time.sleep(self.seconds)
        if setting == "bad":
            raise InputError("The setting is bad.")
        self.cycles.append(cycles)
        self.settings.append(setting)
        return Made(state=(*(state or ()), number), picture=number)

    def _show(self, picture, punctuality):
        self.shown.append((picture, punctuality))
        if self.acknowledges:
            self.loop.acknowledged()

    async def played(self, num_frames):
        self.loop.start()
        await until(lambda: len(self.cycles) >= num_frames)
        self.background.close()


def test_frames_that_are_quick_are_all_played_in_time(pool):
    player = Player(pool)
    asyncio.run(player.played(12))
    numbers = [number for number, _ in player.shown]
    assert numbers == list(range(len(numbers)))
    last = player.shown[-1][1]
    # One may be late on a busy machine.
    assert last.in_time >= last.frames - 2


def test_frames_come_at_the_pace_of_the_radar(pool):
    player = Player(pool)
    began = time.monotonic()
    asyncio.run(player.played(11))
    assert time.monotonic() - began >= 9 * PERIOD_S


def test_what_comes_while_a_worker_is_busy_is_lost_and_counted(pool):
    player = Player(pool, seconds=2.5 * PERIOD_S)
    asyncio.run(player.played(5))
    numbers = [number for number, _ in player.shown]
    assert all(after - before >= 2 for before, after in pairwise(numbers[1:]))
    last = player.shown[-1][1]
    assert last.in_time == 0
    # The first, which begins the count, is none of them.
    assert last.frames >= 2 * (len(numbers) - 1)
    assert max(player.cycles) >= 2


def test_a_setting_acts_on_the_next_frame(pool):
    player = Player(pool)

    async def change():
        player.loop.start()
        await until(lambda: len(player.cycles) >= 3)
        player.setting = "second"
        seen = len(player.settings)
        await until(lambda: len(player.settings) > seen + 1)
        player.background.close()
        return seen

    seen = asyncio.run(change())
    assert player.settings[seen + 1] == "second"


def test_a_pause_lets_nothing_come_and_a_restart_begins_anew(pool):
    player = Player(pool)

    async def command():
        player.loop.start()
        await until(lambda: len(player.cycles) >= 3)
        player.loop.pause()
        await asyncio.sleep(3 * PERIOD_S)
        still = len(player.cycles)
        await asyncio.sleep(3 * PERIOD_S)
        assert len(player.cycles) == still
        player.shown.clear()
        player.loop.restart()
        await until(lambda: len(player.shown) >= 3)
        player.background.close()

    asyncio.run(command())
    assert [number for number, _ in player.shown[:3]] == [0, 1, 2]


def test_a_browser_that_is_silent_gets_no_more_than_two_pictures(pool):
    player = Player(pool, acknowledges=False)

    async def play():
        player.loop.start()
        await until(lambda: len(player.cycles) >= 8)
        assert len(player.shown) == MAX_IN_FLIGHT
        # The newest is what it gets next.
        newest = len(player.cycles) - 1
        player.loop.acknowledged()
        await until(lambda: len(player.shown) == MAX_IN_FLIGHT + 1)
        assert player.shown[-1][0] >= newest - 1
        player.background.close()

    asyncio.run(play())


def test_nothing_comes_for_a_page_that_was_closed(pool):
    player = Player(pool)
    player.is_watched = False

    async def play():
        player.loop.start()
        await asyncio.sleep(5 * PERIOD_S)
        player.background.close()

    asyncio.run(play())
    assert player.cycles == []


def test_a_frame_that_cannot_be_made_is_told_and_stops_the_sequence(pool):
    player = Player(pool)
    player.setting = "bad"

    async def play():
        player.loop.start()
        await until(lambda: player.errors)
        await asyncio.sleep(3 * PERIOD_S)
        player.background.close()

    asyncio.run(play())
    assert player.errors == ["The setting is bad."]
    assert not player.loop.is_playing


def test_the_share_of_frames_in_time():
    counted = Punctuality().after(1, in_time=True).after(3, in_time=False)
    assert (counted.frames, counted.in_time, counted.share) == (4, 1, 0.25)
    assert Punctuality().share == pytest.approx(1.0)


def test_a_pool_of_one_thread_is_enough():
    with ThreadPoolExecutor(max_workers=1) as pool:
        player = Player(pool)
        asyncio.run(player.played(2))
    assert player.shown
