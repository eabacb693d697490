"""A lecturer who leads a class through the experiments: when her changes are on every screen.

Called by `python tests/load/classroom.py --lead`. She has two pages, the lecturer's and a live
view; the class opens the page of the room. A change counts as seen once a browser is sent the first
picture of her new settings, or her iteration.
"""

import asyncio
import http.client
import json
import re
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from urllib.parse import urlencode, urlsplit

import numpy as np
from vsep_app.teaching.experiment import shipped_experiments

from tests.load.classroom import PATIENCE_S, SLIDERS, Student, _models, health

LIVE = "./"
AT_MOST_S = 60.0
"""So long is waited for what does not come."""


def cookies(url: str, **form: str) -> str:
    """Enter with a token or a code; return what the browser keeps."""
    place = urlsplit(url)
    connection = http.client.HTTPConnection(place.hostname, place.port, timeout=PATIENCE_S)
    headers = {"Content-Type": "application/x-www-form-urlencoded"}
    connection.request("POST", place.path, urlencode(form), headers)
    answer = connection.getresponse()
    held = [each.partition(";")[0] for each in answer.headers.get_all("Set-Cookie") or []]
    connection.close()
    return "; ".join(held)


@dataclass
class Browser(Student):
    """A page that notes its address, its pictures, and what is written on it."""

    tab: str = ""
    search: str = ""
    drawn: list[tuple[float, str]] = field(default_factory=list)  #: When, and the address by then.
    turned: list[tuple[float, str]] = field(default_factory=list)  #: Changes of the address.
    written: list[tuple[float, str]] = field(default_factory=list)  #: Texts, as they came.
    is_ready: asyncio.Event = field(default_factory=asyncio.Event)
    own_query: str = ""
    ids: dict[str, str] = field(default_factory=dict)

    @property
    def query(self) -> str:
        return self.own_query

    async def stay(self) -> None:
        """Look at the page until cancelled."""
        while True:
            try:
                async with self._connected(self.tab) as self._socket:
                    await self._read_document()
                    # A browser tells where it is.
                    await self._change(self.ids["location"], "pathname", f"/{self.tab}")
                    self.is_ready.set()
                    while True:
                        await self._take(await self._message(self._socket))
            except ConnectionError:
                await asyncio.sleep(0.5)

    def _find_models(self, document) -> None:
        super()._find_models(document)
        for model in _models(document):
            attributes = model.get("attributes", {})
            if str(model.get("name")).endswith("location.Location"):
                self.ids["location"] = model["id"]
            for name in (attributes.get("label"), attributes.get("name")):
                if isinstance(name, str) and ("value" in attributes or name == "pressed"):
                    self.ids[name] = model["id"]

    async def _take(self, content: str) -> None:
        """Take note of a message."""
        now = time.monotonic()
        if '"drawn"' in content:
            self._find_pictures(json.loads(content))
        for event in json.loads(content).get("events", ()):
            name, new = event.get("attr"), event.get("new")
            if name == "search":
                self.search = new
                self.turned.append((now, new))
            elif name == "text" and isinstance(new, str):
                self.written.append((now, new))
        drawn = self._drawn_by(content)
        if drawn is not None:
            self.pictures.append(now)
            self.drawn.append((now, self.search))
            number = {"type": "map", "entries": [["number", [len(self.pictures)]]]}
            await self._change(drawn, "data", number)

    async def set(self, label: str, value) -> None:
        """Set a component of the page by its label."""
        await self._change(self.ids[label], "value", value)
        if label in SLIDERS:
            await self._change(self.ids[label], "value_throttled", value)

    async def press(self, name: str) -> None:
        """Press a key, or click what has a name."""
        told = [["name", [name]], ["number", [time.monotonic_ns() % 10**6]]]
        await self._change(self.ids["pressed"], "data", {"type": "map", "entries": told})

    def seen_s(self, since: float, marks: tuple[str, ...], *, by_address: bool) -> float | None:
        """Return when an address with all marks was seen, in seconds after a time."""
        for at, search in self.turned if by_address else self.drawn:
            if at >= since and all(mark in search for mark in marks):
                return at - since
        return None


async def _until(condition: Callable[[], bool], at_most_s: float = AT_MOST_S) -> None:
    end = time.monotonic() + at_most_s
    while not condition() and time.monotonic() < end:
        await asyncio.sleep(0.01)


@dataclass
class Class:
    """All browsers of a lesson, and how long her changes took to reach them."""

    desk: Browser
    own: Browser
    students: list[Browser]
    latencies: dict[str, list[float]] = field(default_factory=dict)
    unseen: list[str] = field(default_factory=list)

    async def changes(self, kind: str, do: Callable, *marks: str, by_address: bool = False) -> None:
        """Let her do something, and wait until everybody sees it."""
        since = time.monotonic()
        await do()
        see = [
            lambda student=each: student.seen_s(since, marks, by_address=by_address)
            for each in self.students
        ]
        await _until(lambda: all(each() is not None for each in see))
        for number, each in enumerate(see):
            if each() is None:
                self.unseen.append(f"{kind} {marks}: student {number}")
            else:
                self.latencies.setdefault(kind, []).append(each())


async def led_lesson(
    url: str,
    *,
    token: str,
    sessions: int,
    rounds: int,
    pause_s: float,
    code: str = "",
    most: int = 6,
) -> Class:
    """Lead a class through all experiments, so many times; return what was seen when."""
    owner = cookies(url, token=token)
    desk = Browser(url, "", 1000, cookie=owner, tab="lead")
    own = Browser(url, "", 1001, cookie=owner, own_query="?preset=simulation-2-b&iteration=0")
    students = [
        Browser(url, "", n, cookie=cookies(url, token=code, name=f"Student {n}") if code else "")
        for n in range(sessions)
    ]
    everybody = [desk, own, *students]
    tasks = []
    try:
        for each in everybody:
            tasks.append(asyncio.create_task(each.stay()))
            await asyncio.wait_for(each.is_ready.wait(), PATIENCE_S)
        await _until(lambda: all(each.drawn for each in students), PATIENCE_S)
        lesson = Class(desk, own, students)
        await desk.set("Everybody", "Everybody to my view")
        await _until(lambda: all("sir=-20" in each.search for each in students))
        for number in range(rounds):
            await _one_round(lesson, number, pause_s, most)
        return lesson
    finally:
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)


async def _one_round(lesson: Class, number: int, pause_s: float, most: int) -> None:
    desk, own = lesson.desk, lesson.own
    before = LIVE
    for place, experiment in enumerate(shipped_experiments()[:most]):
        mark = f"experiment={experiment.name}"
        on_other_page = experiment.page != LIVE
        kind = "experiment" if experiment.page == before else "another tab"
        before = experiment.page
        await desk.set("Experiment for everybody", "None")
        await lesson.changes(
            kind, lambda name=experiment.title: desk.set("Experiment for everybody", name), mark
        )
        await asyncio.sleep(pause_s)
        if on_other_page:
            await desk.set("Experiment for everybody", "None")
            continue
        await _answers(lesson, experiment)
        snr = 50 + place - number % 2
        await lesson.changes(
            "slider", lambda snr=snr: own.set("SNR [dB, total]", snr), mark, f"snr={snr}"
        )
        await asyncio.sleep(pause_s)
        for name in ("reset", "step"):
            iteration = "iteration=0" if name == "reset" else "iteration=1"
            await lesson.changes(
                "iteration", lambda name=name: own.press(name), iteration, by_address=True
            )
            await asyncio.sleep(pause_s / 2)


async def _answers(lesson: Class, experiment) -> None:
    """Let everybody answer, and wait until her histogram has all answers."""
    if not experiment.staging.predictions:
        return
    given = len(lesson.students)
    for place, student in enumerate(lesson.students):
        await student.press(f"predict {place % 3}")
    since, told = time.monotonic(), f"{given} answers"
    pattern = re.compile(rf"(?<!\d){told}")

    def came() -> list[float]:
        return [
            at - since
            for at, text in lesson.desk.written
            if experiment.title in text and pattern.search(text.replace("&gt;", ">"))
        ]

    await _until(lambda: bool(came()))
    if came():
        lesson.latencies.setdefault("answers", []).append(max(came()[0], 0.0))
    else:
        lesson.unseen.append(f"answers to {experiment.name}")


def figures(lesson: Class) -> dict:
    """Return medians, 95th percentiles and the longest of each kind of change."""
    told = {
        kind: {
            "changes seen": len(seen),
            "median s": round(float(np.median(seen)), 3),
            "95th percentile s": round(float(np.percentile(seen, 95)), 3),
            "longest s": round(max(seen), 3),
        }
        for kind, seen in lesson.latencies.items()
    }
    return {**told, "unseen": lesson.unseen, "health": health(lesson.own.url)}
