"""Sessions that go on while workers are killed, descriptors run out and the network is cut.

Each session moves a slider and waits for its picture, as those of `classroom.py` do. When its
connection is cut it opens its page again at the address that the server wrote into it, as a browser
does, and looks whether the settings that were answered are there. Run it by hand:

    python tests/load/chaos.py --sessions 6 --minutes 10
"""

import argparse
import asyncio
import contextlib
import json
import os
import random
import re
import resource
import signal
import sys
import time
import urllib.error
from dataclasses import dataclass, field
from pathlib import Path

from tornado.websocket import WebSocketClosedError

from tests.load.classroom import PRESETS, SLIDERS, Student, health, serving

GOES_ON_S = 10.0
# Figures and processes are not read at the same moment.
SETTLED_S = 3.0
STARVED_S = 8.0
HEALTH_S = 0.5

SEARCH = re.compile(r'"attr":\s*"search",\s*"new":\s*"([^"]*)"')


@dataclass
class Survivor(Student):
    """A session that opens its page again."""

    address: str = ""
    acknowledged: dict[str, int] = field(default_factory=dict)
    answered_after_s: list[float] = field(default_factory=list)
    num_cuts: int = 0
    _address_before: str = ""
    calm_since: float = 0.0  # the end of the last time without descriptors

    @property
    def query(self) -> str:
        """The address as the server has written it."""
        return self.address or super().query

    async def survive(self, until: float) -> None:
        """Move sliders, page after page, until the time is over."""
        chance = random.Random(self.number)
        while time.monotonic() < until:
            begun = time.monotonic()
            try:
                await self._visit(chance, begun, until)
            except (ConnectionError, WebSocketClosedError):
                pass  # cut; the page is opened again
            except Exception as error:
                self.errors.append(repr(error))
                await asyncio.sleep(0.5)

    def cut(self) -> None:
        """Lose the connection as when the network goes."""
        self.num_cuts += 1
        if getattr(self, "_socket", None) is not None:
            self._socket.close()

    async def _visit(self, chance: random.Random, begun: float, until: float) -> None:
        async with self._connected("") as self._socket:
            await self._read_document()
            self._compare()
            reader = asyncio.create_task(self._read())
            try:
                while time.monotonic() < until and not reader.done():
                    label = chance.choice(list(SLIDERS))
                    lowest, highest = SLIDERS[label]
                    others = set(range(lowest, highest + 1)) - {self._places[label]}
                    await self._move(label, chance.choice(sorted(others)))
                    await self._answer(reader, begun)
                    begun = None
                    await asyncio.sleep(chance.uniform(0.5, 1.5))
            finally:
                reader.cancel()
                await asyncio.gather(reader, return_exceptions=True)
                self._sent, self._moved_at = dict(self._places), None

    async def _answer(self, reader: asyncio.Task, begun: float | None) -> None:
        """Wait for the picture of the last move; note how long it took since the session stood.

        The time in which the server was without descriptors does not count.
        """
        since = self._moved_at if begun is None else begun
        while self._moved_at is not None and not reader.done():
            await asyncio.sleep(0.02)
            if time.monotonic() - since > 3 * GOES_ON_S:
                self.errors.append("no picture at all")
                return
        if not reader.done():
            self.answered_after_s.append(time.monotonic() - max(since, self.calm_since))
            self.acknowledged = dict(self._places)

    def _compare(self) -> None:
        """Note what was answered before and is not there any more.

        A move that was on its way may have arrived.
        """
        for label, value in self.acknowledged.items():
            if self._places[label] not in (value, self._sent[label]):
                self.errors.append(f"{label} is {self._places[label]}, it was {value}")

    async def _read(self) -> None:
        """Take pictures until the connection is cut; the first after the new address answers."""
        with contextlib.suppress(ConnectionError, WebSocketClosedError):
            while True:
                content = await self._message(self._socket)
                drawn = self._drawn_by(content)
                if drawn is None:
                    continue
                self.pictures.append(time.monotonic())
                if self.address != self._address_before:
                    self._moved_at = None
                number = {"type": "map", "entries": [["number", [len(self.pictures)]]]}
                await self._change(drawn, "data", number)

    async def _move(self, label: str, value: int) -> None:
        self._moved_at, self._address_before = None, self.address
        await super()._move(label, value)

    async def _message(self, connection) -> str:
        content = await super()._message(connection)
        for search in SEARCH.findall(content):
            self.address = search
        return content


@dataclass
class Watch:
    """What health said, beside what there was."""

    slowest_s: float = 0.0
    num_asked: int = 0
    num_without_worker: int = 0
    errors: list[str] = field(default_factory=list)
    _untrue_since: float | None = None

    async def follow(self, url: str, server: int, until: float) -> None:
        """Ask once and again."""
        while time.monotonic() < until:
            begun = time.monotonic()
            told = await asyncio.to_thread(_told, url)
            self.slowest_s = max(self.slowest_s, time.monotonic() - begun)
            self.num_asked += 1
            self._judge(told, len(workers_of(server)))
            await asyncio.sleep(HEALTH_S)

    def _judge(self, told: dict, living: int) -> None:
        self.num_without_worker += told["workers"] == 0
        if (told["status"] == "ok") != (told["workers"] > 0):
            self.errors.append(f"{told['status']} with {told['workers']} workers")
        now = time.monotonic()
        if told["workers"] == living:
            self._untrue_since = None
        elif self._untrue_since is None:
            self._untrue_since = now
        elif now - self._untrue_since > SETTLED_S:
            self.errors.append(f"health says {told['workers']} workers, there are {living}")
            self._untrue_since = None


def _told(url: str) -> dict:
    try:
        return health(url)
    except urllib.error.HTTPError as answer:
        return json.loads(answer.read())


# They outlive the process that they are forks of, and are then no longer below the server.
_seen: dict[int, set[int]] = {}


def workers_of(server: int) -> list[int]:
    """Return the numbers of the worker processes of a server that live."""
    found = _seen.setdefault(server, set())
    found.update(_children(server, b"spawn_main"))
    for origin in origins_of(server):
        found.update(_children(origin, b"forkserver"))
    found.intersection_update(each for each in found if _lives(each))
    return sorted(found)


def _lives(process: int) -> bool:
    with contextlib.suppress(OSError):
        return (Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[0]) != "Z"
    return False


def origins_of(server: int) -> list[int]:
    """Return the number of the process that workers are forks of, if it lives."""
    return _children(server, b"forkserver")


def _children(parent: int, word: bytes) -> list[int]:
    """Return the numbers of living processes of a parent whose command has a word in it."""
    found = []
    for folder in Path("/proc").glob("[0-9]*"):
        with contextlib.suppress(OSError, IndexError):
            state, its_parent = (folder / "stat").read_text().rpartition(")")[2].split()[:2]
            command = (folder / "cmdline").read_bytes()
            if int(its_parent) == parent and state != "Z" and word in command:
                found.append(int(folder.name))
    return found


def kill(process: int) -> None:
    """End a process as the system does when memory is short."""
    with contextlib.suppress(ProcessLookupError):
        os.kill(process, signal.SIGKILL)


async def starve(server: int, seconds: float) -> None:
    """Leave a server one free descriptor, enough for health and too few for a worker."""
    used = {int(each.name) for each in Path(f"/proc/{server}/fd").iterdir()}
    free = [number for number in range(max(used) + 3) if number not in used]
    soft, hard = resource.prlimit(server, resource.RLIMIT_NOFILE)
    resource.prlimit(server, resource.RLIMIT_NOFILE, (free[1], hard))
    for process in workers_of(server):
        kill(process)
    await asyncio.sleep(seconds)
    resource.prlimit(server, resource.RLIMIT_NOFILE, (soft, hard))


async def chaos(
    url: str, server: int, *, sessions: int, seconds: float, kill_every_s: float, num_cuts: int
) -> tuple[list[Survivor], Watch, int]:
    """Let sessions live through it; return them, what health said and the workers killed."""
    # The first page loads what all others share.
    await Survivor(url, PRESETS[0], 0).survive(time.monotonic() + 3.0)
    until = time.monotonic() + seconds
    survivors = [Survivor(url, PRESETS[i % len(PRESETS)], i) for i in range(sessions)]
    watch, chance = Watch(), random.Random(1)
    living = asyncio.gather(
        *(each.survive(until) for each in survivors), watch.follow(url, server, until)
    )
    starving = min(STARVED_S, seconds / 8.0)
    events = [(seconds * (i + 1) / (num_cuts + 2), "cut") for i in range(num_cuts)]
    events += [(seconds * share, "starve") for share in (0.35, 0.7)]
    events += [
        (number * kill_every_s, "kill") for number in range(1, int(seconds / kill_every_s) - 1)
    ]
    begun, num_killed = time.monotonic(), 0
    for at, what in sorted(events):
        await asyncio.sleep(max(0.0, begun + at - time.monotonic()))
        if what == "cut":
            chance.choice(survivors).cut()
        elif what == "starve":
            num_killed += len(workers_of(server))
            await starve(server, starving)
            for each in survivors:
                each.calm_since = time.monotonic()
        elif workers := workers_of(server):
            num_killed += 1
            # Now and then it meets the process that they are forks of.
            kill(chance.choice(workers + origins_of(server)))
    await living
    return survivors, watch, num_killed


def summary(survivors: list[Survivor], watch: Watch, num_killed: int) -> dict:
    """Return the figures."""
    gaps = sorted(gap for each in survivors for gap in each.answered_after_s)
    return {
        "sessions": len(survivors),
        "moves answered": len(gaps),
        "workers killed": num_killed,
        "connections cut": sum(each.num_cuts for each in survivors),
        "until a move is answered, median s": round(gaps[len(gaps) // 2], 2),
        "until a move is answered, 99.9th percentile s": round(gaps[int(0.999 * len(gaps))], 2),
        "until a move is answered, longest s": round(gaps[-1], 2),
        "health asked": watch.num_asked,
        "health, longest answer s": round(watch.slowest_s, 2),
        "health without a worker": watch.num_without_worker,
        "errors": [error for each in survivors for error in each.errors] + watch.errors,
    }


def main() -> None:
    """Run it and print the figures."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sessions", type=int, default=6)
    parser.add_argument("--minutes", type=float, default=10.0)
    parser.add_argument("--kill-every", type=float, default=5.0, metavar="S")
    parser.add_argument("--cuts", type=int, default=10)
    options = parser.parse_args()
    with serving() as (process, url):
        survivors, watch, num_killed = asyncio.run(
            chaos(
                url,
                process.pid,
                sessions=options.sessions,
                seconds=60.0 * options.minutes,
                kill_every_s=options.kill_every,
                num_cuts=options.cuts,
            )
        )
    sys.stdout.write(json.dumps(summary(survivors, watch, num_killed), indent=1) + "\n")


if __name__ == "__main__":
    main()
