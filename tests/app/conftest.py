"""Fixtures of the application's tests: finished runs, and the served dashboard."""

import asyncio
import contextlib
import os
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from typing import Any, NamedTuple

import numpy as np
import pytest
from vsep_app.jobs.run_session import Phase, Snapshot
from vsep_app.jobs.tasks import Prepared, advance, prepare
from vsep_app.model.settings import Settings

from vsep._typing import ComplexArray
from vsep.inference.core.progress import Step, Termination
from vsep.presets.scenes import simulate_preset
from vsep.recordings.settings_text import settings_text
from vsep.studies.catalogue import make_study
from vsep.studies.trial import Row, run_trial


class FinishedRun(NamedTuple):
    """A prepared run and all its steps."""

    prepared: Prepared
    steps: tuple[Step, ...]

    def snapshot(self, num_steps: int | None = None) -> Snapshot[Prepared, Step]:
        """Return what a view would get after some of the steps."""
        shown = self.steps if num_steps is None else self.steps[:num_steps]
        return Snapshot(
            run_number=1,
            prepared_run=self.prepared,
            steps=shown,
            num_steps=len(self.steps),
            phase=Phase.FINISHED,
        )


async def until(condition: Callable[[], object]) -> None:
    """Wait in an event loop until a condition holds, at most 20 s."""
    for _ in range(2000):
        if condition():
            return
        await asyncio.sleep(0.01)
    pytest.fail("waited in vain")


@pytest.fixture
def pool() -> Iterator[ThreadPoolExecutor]:
    """The workers of all sessions, one thread."""
    with ThreadPoolExecutor(max_workers=1) as workers:
        yield workers


def finish(preset: str, **changes: object) -> FinishedRun:
    """Run a preset to its end."""
    settings = Settings()
    settings.choose_preset(preset)
    settings.param.update(**changes)
    prepared = prepare(settings.plan())
    steps = [advance(prepared, prepared.initial_state)]
    while steps[-1].termination is Termination.RUNNING:
        steps.append(advance(prepared, steps[-1].state))
    return FinishedRun(prepared, tuple(steps))


@pytest.fixture(scope="session")
def one_ramp() -> FinishedRun:
    """Simulation I to its end."""
    return finish("simulation-1")


@pytest.fixture(scope="session")
def many_ramps() -> FinishedRun:
    """Simulation II b to its end."""
    return finish("simulation-2-b")


@pytest.fixture(scope="session")
def study_rows() -> list[Row]:
    """Three realisations of two points of Fig. 3a, by two methods."""
    study = make_study("fig-3", methods=("object-only", "no-interference"), selection="6,9")
    trials = [study.trial(index, r) for r in range(3) for index in study.point_indices]
    return [row for trial in trials for row in run_trial(trial)]


class RawCapture(NamedTuple):
    """A raw capture and what it is, as files; and the frame that is in it."""

    content: bytes
    settings: bytes
    received: ComplexArray

    def text(self, **changes: str) -> bytes:
        """Return the settings with some lines changed."""
        values = dict(line.split(": ") for line in self.settings.decode().splitlines())
        lines = (f"{name}: {value}\n" for name, value in (values | changes).items())
        return "".join(lines).encode()


@pytest.fixture(scope="session")
def raw_capture() -> RawCapture:
    """Simulation II b as a sensor with two lanes records it, 16 bits a word."""
    scenario, observation = simulate_preset("simulation-2-b", snr_db=60.0, sir_db=-20.0, seed=7)
    radar, received = scenario.radar, observation.received
    scale = 2**15 * 0.9 / np.max(np.abs(received))
    # I(n) I(n+1) Q(n) Q(n+1): pairs of samples, first their real parts, then the imaginary ones.
    pairs = (scale * received).reshape(radar.num_ramps, -1, 2)
    words = np.round(np.stack([pairs.real, pairs.imag], axis=2)).astype("<i2")
    settings = {
        "format": "dca1000-xwr16xx",
        "start_frequency_hz": radar.start_frequency_hz,
        "slope_hz_per_s": radar.slope_hz_per_s,
        "sample_rate_hz": radar.sample_rate_hz,
        "ramp_period_s": radar.ramp_period_s,
        "num_samples": radar.num_samples,
        "sign": "negative",
    }
    return RawCapture(words.tobytes(), settings_text(settings).encode(), received)


@contextlib.contextmanager
def served(**options: Any) -> Iterator[Any]:
    """Serve the dashboard from a thread with its own event loop, with options of `make_server`."""
    from vsep_app.server import sessions
    from vsep_app.server.main import make_server

    ready, box = threading.Event(), {}

    def serve() -> None:
        loop = asyncio.new_event_loop()
        asyncio.set_event_loop(loop)
        server = box["server"] = make_server(**{"port": 0, "address": "127.0.0.1", **options})
        server.io_loop.add_callback(ready.set)
        server.start()
        server.io_loop.start()

    thread = threading.Thread(target=serve, daemon=True)
    thread.start()
    assert ready.wait(60)
    sessions.shared_pool().queue().submit(os.getpid).result(60)  # a worker is there
    server = box["server"]
    yield server

    async def leave() -> None:
        server.stop()
        await server._http.close_all_connections()
        # What the browsers have closed is closed here, too, before the loop ends.
        await asyncio.sleep(0.2)
        server.io_loop.stop()

    server.io_loop.add_callback(leave)
    thread.join(10)


@pytest.fixture(scope="session")
def app_server() -> Iterator[Any]:
    """The served dashboard, which lets everybody in; see `test_access_server` for who gets in."""
    from vsep_app.server.access import EntryRules

    with served(entry=EntryRules(open_to_all=True)) as server:
        yield server
