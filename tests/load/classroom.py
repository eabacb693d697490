"""A class in front of the served dashboard: many sessions that move sliders and read pictures.

Each session speaks the server's own protocol: it opens the page, draws nothing, and says that it
has drawn as the browser does. Run it by hand:

    python tests/load/classroom.py --sessions 30 --minutes 10 --browsers 2

With `--reopen-every 30` all pages of the program are visited, each left for the next one after so
many seconds: what stays of them shows in the memory.
"""

import argparse
import asyncio
import contextlib
import json
import os
import random
import re
import shutil
import socket
import statistics
import subprocess
import sys
import time
import urllib.request
from collections.abc import AsyncIterator, Iterator
from dataclasses import dataclass, field

import numpy as np
from tornado.httpclient import HTTPRequest
from tornado.websocket import WebSocketClientConnection, websocket_connect
from vsep_app.pages import PAGES

PRESETS = ("simulation-1", "simulation-2-a", "simulation-2-b", "simulation-2-c")
SLIDERS = {"SNR [dB, total]": (20, 70), "SIR [dB, total]": (-30, 0)}
# A run is over when no picture has come for so long.
RUN_GAP_S = 1.0
# The memory at the end is compared with that after so long, when caches are full.
SETTLED_S = 300.0
# A machine that others use, too, takes its time to build a page.
PATIENCE_S = 180.0
SERVE = "import sys; from vsep_app.cli.main import main; sys.exit(main())"
ITERATION = re.compile(r"iteration (\d+) of")
# A picture that was on its way when a slider was moved is older than this.
ON_ITS_WAY_S = 0.15
CHANGED = re.compile(r'"model":\s*{"id":\s*"([^"]+)"}')
ENDED = re.compile(r"converged|stopped at the limit")
TABS = tuple(address.removeprefix("./") for address in PAGES)


@dataclass
class Student:
    """One session and what it has seen."""

    url: str
    preset: str
    number: int
    cookie: str = ""
    opened_s: float = 0.0
    pictures: list[float] = field(default_factory=list)
    latencies: list[float] = field(default_factory=list)
    errors: list[str] = field(default_factory=list)
    gaps_s: list[float] = field(default_factory=list)  #: Between pictures while a run goes on.
    num_moves: int = 0
    num_visits: int = 0
    received_bytes: int = 0
    _moved_at: float | None = None
    _has_ended: bool = False
    _sending: asyncio.Lock = field(default_factory=asyncio.Lock)
    _seen_at: float | None = None
    _iteration: int = 0

    async def attend(
        self,
        until: float,
        first_at: float,
        pause_s: tuple[float, float],
        patience_s: float,
        reopen_every_s: float = 0.0,
    ) -> None:
        """Look at the page until the lesson is over; or at one page after the other."""
        chance = random.Random(self.number)
        await asyncio.sleep(max(0.0, first_at - time.monotonic()))
        if not reopen_every_s:
            await self.visit("", until, pause_s, patience_s, chance)
        while reopen_every_s and time.monotonic() < until:
            tab = TABS[(self.number + self.num_visits) % len(TABS)]
            try:
                leave_at = time.monotonic() + reopen_every_s
                await self.visit(tab, leave_at, pause_s, patience_s, chance)
            except Exception as error:
                self.errors.append(f"opening {tab!r}: {error!r}")
                await asyncio.sleep(1.0)

    async def visit(
        self,
        tab: str,
        until: float,
        pause_s: tuple[float, float],
        patience_s: float,
        chance: random.Random,
    ) -> None:
        """Open a page, look at it and move its sliders, where it has any, at least once."""
        self._moved_at = self._seen_at = None
        moves_before = self.num_moves
        started = time.monotonic()
        async with self._connected(tab) as self._socket:
            await self._read_document()
            reader = asyncio.create_task(self._read())
            self.opened_s = max(self.opened_s, time.monotonic() - started)
            self.num_visits += 1
            try:
                if tab:
                    await asyncio.sleep(until - time.monotonic())
                    return
                while time.monotonic() < until or self.num_moves == moves_before:
                    await asyncio.sleep(chance.uniform(*pause_s))
                    label, (lowest, highest) = chance.choice(list(SLIDERS.items()))
                    # Where the slider is already, nothing would happen.
                    others = set(range(lowest, highest + 1)) - {self._places[label]}
                    await self._answered(patience_s)
                    await self._move(label, chance.choice(sorted(others)))
                await asyncio.sleep(pause_s[0])
                await self._answered(patience_s)
                if self._moved_at is not None:
                    self.errors.append("the last move was not answered by a picture")
            except Exception as error:
                self.errors.append(repr(error))
            finally:
                reader.cancel()
                await asyncio.gather(reader, return_exceptions=True)

    @property
    def query(self) -> str:
        """What the page is asked with."""
        return f"?preset={self.preset}&seed={self.number % 5}"

    async def _answered(self, patience_s: float) -> None:
        """Wait for the picture that the last move asked for, so long and no longer."""
        end = time.monotonic() + patience_s
        while self._moved_at is not None and time.monotonic() < end:
            await asyncio.sleep(0.05)

    @contextlib.asynccontextmanager
    async def _connected(self, tab: str) -> AsyncIterator[WebSocketClientConnection]:
        """Open a page and its connection; leave when both sides have closed it."""
        page = await asyncio.to_thread(_get, self.url + tab + self.query, self.cookie)
        token = re.search(r'"token":"([^"]+)"', page).group(1)
        where = self.url.replace("http", "ws") + (f"{tab}/ws" if tab else "ws")
        request = HTTPRequest(
            where,
            headers={"Cookie": self.cookie},
            connect_timeout=PATIENCE_S,
            request_timeout=PATIENCE_S,
        )
        connection = await websocket_connect(
            request, subprotocols=["bokeh", token], max_message_size=2**26
        )
        self._has_ended = False
        try:
            yield connection
        finally:
            connection.close()
            # The server answers before the connection is gone; until then there may be pictures.
            while not self._has_ended and await connection.read_message() is not None:
                pass

    async def _read_document(self) -> None:
        connection = self._socket
        await self._message(connection)  # the server's greeting
        await self._send(connection, "PULL-DOC-REQ", {})
        document = await self._message(connection)
        self._find_models(json.loads(document))
        ready = {"type": "event", "name": "document_ready", "values": {"type": "map"}}
        event = {"kind": "MessageSent", "msg_type": "bokeh_event", "msg_data": ready}
        await self._send(connection, "PATCH-DOC", {"events": [event]})

    def _find_models(self, document) -> None:
        """Note the numbers of the sliders and of the two sources that pictures go through."""
        self._sliders, self._places, self._pictures = {}, {}, {}
        self._find_pictures(document)
        for model in _models(document):
            attributes = model.get("attributes", {})
            if attributes.get("label") in SLIDERS and "value_throttled" in attributes:
                self._sliders[attributes["label"]] = model["id"]
                # Bokeh leaves out what has its default.
                self._places[attributes["label"]] = attributes.get("value", 0)

    def _find_pictures(self, document) -> None:
        """Note the two sources that the pictures of each tab go through."""
        source = drawn = None
        for model in _models(document):
            attributes = model.get("attributes", {})
            if "drawn" in str(attributes.get("js_property_callbacks")):
                source = model["id"]
            if attributes.get("name") == "drawn":
                drawn = model["id"]
        # A page without pictures of a run has none of the two.
        if source is not None:
            self._pictures[source] = drawn

    def _drawn_by(self, content: str) -> str | None:
        """Return the source in which a browser says that it has drawn this; None for no picture."""
        for told in CHANGED.findall(content):
            if told in self._pictures:
                return self._pictures[told]
        return None

    def _answers(self, content: str, since_move_s: float) -> bool:
        """Whether a picture is of the run that the last move has begun.

        Pictures leave out iterations where they are slower than these: the first of a run need not
        be that of its first iteration, and that of a short run may be its last.
        """
        told = ITERATION.search(content)
        before, self._iteration = self._iteration, int(told.group(1)) if told else 10**9
        begun_anew = told is not None and (self._iteration <= 2 or self._iteration < before)
        return begun_anew or (since_move_s > ON_ITS_WAY_S and ENDED.search(content) is not None)

    async def _read(self) -> None:
        """Take pictures and say that they are drawn."""
        try:
            while True:
                content = await self._message(self._socket)
                drawn = self._drawn_by(content)
                if drawn is None:
                    continue
                now = time.monotonic()
                self.pictures.append(now)
                if self._seen_at is not None:
                    self.gaps_s.append(now - self._seen_at)
                # What follows the last picture of a run is no gap; a move begins the next one.
                self._seen_at = None if ENDED.search(content) else now
                if self._moved_at is not None and self._answers(content, now - self._moved_at):
                    self.latencies.append(now - self._moved_at)
                    self._moved_at = None
                number = {"type": "map", "entries": [["number", [len(self.pictures)]]]}
                await self._change(drawn, "data", number)
        except asyncio.CancelledError:
            raise
        except Exception as error:
            self.errors.append(f"reading: {error!r}")

    async def _move(self, label: str, value: int) -> None:
        if self._moved_at is not None:
            self.errors.append(f"no picture {time.monotonic() - self._moved_at:.1f} s after a move")
        self.num_moves += 1
        self._places[label] = value
        self._moved_at = self._seen_at = time.monotonic()
        for attribute in ("value", "value_throttled"):
            await self._change(self._sliders[label], attribute, value)

    async def _change(self, model: str, attribute: str, value) -> None:
        event = {"kind": "ModelChanged", "model": {"id": model}, "attr": attribute, "new": value}
        await self._send(self._socket, "PATCH-DOC", {"events": [event]})

    async def _send(self, connection, kind: str, content) -> None:
        header = {"msgid": f"{self.number}-{time.monotonic_ns()}", "msgtype": kind}
        # The parts of a message follow each other, whoever else has something to say.
        async with self._sending:
            for part in (header, {}, content):
                await connection.write_message(json.dumps(part))

    async def _message(self, connection) -> str:
        """Return the content of the next message; what is sent with it is only counted."""
        header, _, content = [await self._fragment(connection) for _ in range(3)]
        for _ in range(2 * json.loads(header).get("num_buffers", 0)):
            await self._fragment(connection)
        if '"ERROR"' in header:
            self.errors.append(content[:300])
        return content

    async def _fragment(self, connection):
        fragment = await connection.read_message()
        if fragment is None:
            self._has_ended = True
            raise ConnectionError("the server has closed the connection")
        self.received_bytes += len(fragment)
        return fragment

    @property
    def rate(self) -> float:
        """Pictures a second while a run went on, from the first to the last picture of each."""
        gaps = [b - a for a, b in zip(self.pictures, self.pictures[1:], strict=False)]
        gaps = [gap for gap in gaps if gap < RUN_GAP_S]
        return len(gaps) / sum(gaps) if gaps else 0.0


def _models(value) -> Iterator[dict]:
    if isinstance(value, dict):
        if "id" in value and "attributes" in value:
            yield value
        value = list(value.values())
    if isinstance(value, list):
        for one in value:
            yield from _models(one)


def _get(url: str, cookie: str = "") -> str:
    asked = urllib.request.Request(url, headers={"Cookie": cookie})
    with urllib.request.urlopen(asked, timeout=PATIENCE_S) as answer:
        return answer.read().decode()


def health(url: str) -> dict:
    """Return what the server says of itself."""
    return json.loads(_get(url + "health"))


@contextlib.contextmanager
def serving(*options: str) -> Iterator[tuple[subprocess.Popen, str]]:
    """Serve the dashboard in a process of its own; yield that and its address."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    command = [sys.executable, "-c", SERVE, "serve", "--classroom", "--no-token"]
    with subprocess.Popen(
        [*command, *("--address", "127.0.0.1", "--port", str(port)), *options]
    ) as process:
        url = f"http://127.0.0.1:{port}/"
        try:
            for _ in range(600):
                with contextlib.suppress(OSError):
                    health(url)
                    break
                time.sleep(0.2)
            yield process, url
        finally:
            process.terminate()
            process.wait(PATIENCE_S)


@contextlib.contextmanager
def served(*options: str) -> Iterator[str]:
    """Serve the dashboard in a process of its own; yield its address."""
    with serving(*options) as (_, url):
        yield url


async def lesson(
    url: str,
    *,
    sessions: int,
    seconds: float,
    pause_s: tuple[float, float] = (5.0, 15.0),
    patience_s: float = 0.0,
    reopen_every_s: float = 0.0,
) -> tuple[list[Student], list[dict]]:
    """Let a class attend; return the students and the server's health every five seconds.

    A student moves on after a pause; who has no picture by then notes it, after so much patience.
    """
    now = time.monotonic()
    # Pages are opened one a second; the lesson is counted from when all are there.
    until = now + sessions + seconds
    students = [Student(url, PRESETS[i % len(PRESETS)], i) for i in range(sessions)]
    attending = asyncio.gather(
        *(
            each.attend(until, now + i, pause_s, patience_s, reopen_every_s)
            for i, each in enumerate(students)
        )
    )
    healths = []
    while not attending.done():
        healths.append(await asyncio.to_thread(health, url))
        healths[-1]["at_s"] = time.monotonic() - now
        await asyncio.wait([attending], timeout=5.0)
    await attending
    return students, healths


def summary(students: list[Student], healths: list[dict], empty_mb: float) -> dict:
    """Return the figures of a lesson."""
    latencies = sorted(one for each in students for one in each.latencies)
    memory = [one["all_mb"] for one in healths]
    num_pictures = sum(len(each.pictures) for each in students)

    def cpu_ms(who) -> float:
        """Return processor time a picture."""
        begin = next(one for one in healths if one["pages_opened"] == healths[-1]["pages_opened"])
        return round(1e3 * (who(healths[-1]) - who(begin)) / num_pictures, 1)

    settled = next(
        (m for m, one in zip(memory, healths, strict=True) if one["at_s"] > SETTLED_S), 0.0
    )
    percentiles = [np.percentile(each.gaps_s, (95, 99.9, 100)) for each in students if each.gaps_s]
    third = max(1, len(memory) // 3)
    drawn_at = [at for each in students for at in each.pictures]
    seconds = max(drawn_at) - min(drawn_at)
    return {
        "sessions": len(students),
        "seconds": round(seconds),
        "errors": [error for each in students for error in each.errors],
        "moves": sum(each.num_moves for each in students),
        "pictures": num_pictures,
        "processor time a picture, server, ms": cpu_ms(lambda one: one["server_cpu_s"]),
        "processor time a picture, workers, ms": cpu_ms(lambda one: sum(one["workers_cpu_s"])),
        "lowest updates/s of a session": round(min(each.rate for each in students), 2),
        "median updates/s of a session": round(statistics.median(s.rate for s in students), 2),
        "slider to first picture, median s": round(statistics.median(latencies), 3),
        "slider to first picture, 95th percentile s": round(
            latencies[min(len(latencies) - 1, int(0.95 * len(latencies)))], 3
        ),
        "slider to first picture, longest s": round(latencies[-1], 3),
        "opening, longest s": round(max(each.opened_s for each in students), 2),
        "visits": sum(each.num_visits for each in students),
        "gaps in a run, 95th and 99.9th percentile, longest, slowest session s": (
            np.round(np.max(percentiles, axis=0), 2).tolist()
        ),
        "server processor time an opening, with all pictures, s": round(
            (healths[-1]["server_cpu_s"] - healths[0]["server_cpu_s"])
            / sum(each.num_visits for each in students),
            2,
        ),
        "kB/s a session": round(
            statistics.mean(each.received_bytes for each in students) / seconds / 1e3, 1
        ),
        "memory without a page, MB": round(empty_mb),
        "memory after five minutes, MB": round(settled),
        "memory at two thirds, MB": round(memory[2 * third - 1]),
        "memory at the end, MB": round(memory[-1]),
        "memory a session, MB": round((max(memory) - empty_mb) / len(students), 1),
    }


def watch(url: str, seconds: float) -> list[float]:
    """Open the page in a real browser and move a slider; return the times to the first picture."""
    from playwright.sync_api import sync_playwright

    first_drawn = """async () => {
      const model = [...Bokeh.documents[0].all_models].find((m) => m.name === "drawn")
      const begun = performance.now()
      const drawn = new Promise((done) => model.properties.data.change.connect(done))
      await drawn
      return (performance.now() - begun) / 1000
    }"""
    latencies = []
    with sync_playwright() as driver:
        browser = driver.chromium.launch(
            executable_path=shutil.which("chromium"), args=["--no-sandbox", "--disable-gpu"]
        )
        page = browser.new_page(viewport={"width": 1400, "height": 900})
        page.goto(url + "?preset=simulation-2-b")
        page.locator("[role=status]", has_text="converged").wait_for(timeout=120_000)
        until = time.monotonic() + seconds
        while time.monotonic() < until:
            page.wait_for_timeout(8000)
            page.get_by_role("slider", name=re.compile("^SNR")).focus()
            waiting = page.evaluate_handle(f"window.first = ({first_drawn})()")
            page.keyboard.press("ArrowRight" if len(latencies) % 2 else "ArrowLeft")
            latencies.append(page.evaluate("window.first"))
            waiting.dispose()
        browser.close()
    return latencies


async def _lead(options: argparse.Namespace) -> None:
    """Lead a class in the place of letting it play."""
    from tests.load.leading import figures, led_lesson

    token = "a-token-of-the-load-test"
    os.environ["VSEP_TOKEN"] = token
    with served() as url:
        led = await led_lesson(
            url,
            token=token,
            sessions=options.sessions,
            rounds=options.rounds,
            pause_s=options.pause[0],
        )
        sys.stdout.write(json.dumps(figures(led), indent=1) + "\n")


async def _main(options: argparse.Namespace) -> None:
    if options.lead:
        await _lead(options)
        return
    with served() as url:
        # The first page loads what all others share.
        await lesson(url, sessions=1, seconds=5.0, pause_s=(1.0, 2.0))
        await asyncio.sleep(8.0)
        empty_mb = health(url)["all_mb"]
        seconds = 60.0 * options.minutes
        browsers = [
            asyncio.to_thread(watch, url, seconds + options.sessions)
            for _ in range(options.browsers)
        ]
        watching = asyncio.gather(*browsers)
        students, healths = await lesson(
            url,
            sessions=options.sessions,
            seconds=seconds,
            pause_s=tuple(options.pause),
            reopen_every_s=options.reopen_every,
        )
        history = [(round(h["at_s"]), round(h["server_mb"]), round(h["all_mb"])) for h in healths]
        sys.stdout.write(json.dumps({"s, server MB, in all MB": history[::12]}) + "\n")
        figures = summary(students, healths, empty_mb)
        for latencies in await watching:
            figures.setdefault("real browsers, median and longest s", []).append(
                (round(statistics.median(latencies), 2), round(max(latencies), 2))
            )
        await asyncio.sleep(90.0)
        figures["health after all have left"] = health(url)
        sys.stdout.write(json.dumps(figures, indent=1) + "\n")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--sessions", type=int, default=30)
    parser.add_argument("--minutes", type=float, default=10.0)
    parser.add_argument("--reopen-every", type=float, default=0.0, metavar="S")
    parser.add_argument("--lead", action="store_true", help="a lecturer leads; see leading.py")
    parser.add_argument("--rounds", type=int, default=1, help="through all experiments")
    parser.add_argument("--browsers", type=int, default=0)
    parser.add_argument("--pause", type=float, nargs=2, default=(5.0, 15.0))
    asyncio.run(_main(parser.parse_args()))
