import asyncio
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from types import SimpleNamespace

import pytest
from vsep_app.jobs.run_loop import MAX_IN_FLIGHT, FrameLoop, PictureSink, RunCallbacks
from vsep_app.jobs.run_session import Phase, RunSession

from tests.app.test_run_session import LAST_ITERATION, PreparedRun, _state, _step
from vsep.errors import InputError


@dataclass
class Theatre:
    """A loop with its session and all that it showed and said."""

    loop: FrameLoop
    session: RunSession
    pictures: list
    sentences: list
    watched: dict


def _prepare(plan):
    if plan == "bad":
        raise InputError("The plan is bad; it must be good.")
    return PreparedRun(plan, _state(0))


released = threading.Event()


def _advance(prepared_run, state):
    if prepared_run.plan == "slow":
        released.wait(10.0)
    if prepared_run.plan == "breaks" and state.iteration == 1:
        raise ZeroDivisionError("no")
    return _step(state)


def _compose(snapshot):
    return SimpleNamespace(
        run_number=snapshot.run_number,
        iteration=len(snapshot.steps),
        plan=snapshot.prepared_run.plan,
    )


async def _open(pool, *, acknowledge=True, speed=1000.0):
    watched = {"now": True}
    pictures, sentences, session = [], [], RunSession()
    event_loop = asyncio.get_running_loop()

    def show(picture):
        pictures.append(picture)
        if acknowledge:
            theatre.loop.acknowledged()

    sink = PictureSink(
        post=event_loop.call_soon,
        show=show,
        notify_error=sentences.append,
        speed=lambda: speed,
        watched=lambda: watched["now"],
    )
    loop = FrameLoop(
        session, RunCallbacks(prepare=_prepare, advance=_advance, compose=_compose), sink, pool
    )
    theatre = Theatre(loop, session, pictures, sentences, watched)
    loop.start()
    return theatre


async def _until(condition, seconds=5.0):
    deadline = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < deadline, "waited in vain"
        await asyncio.sleep(0.005)


@pytest.fixture
def pool():
    """Two workers."""
    with ThreadPoolExecutor(2) as workers:
        yield workers


def _play(pool, scene, **options):
    async def play():
        theatre = await _open(pool, **options)
        try:
            await scene(theatre)
        finally:
            theatre.loop.close()

    # A thread of its own: the browser tests keep an event loop running in this one.
    with ThreadPoolExecutor(1) as thread:
        thread.submit(lambda: asyncio.run(play())).result()


def _start(theatre, plan):
    theatre.session.restart(plan)
    theatre.loop.wake()


def test_a_run_is_shown_to_its_end(pool):
    async def scene(theatre):
        _start(theatre, "plan")
        await _until(lambda: theatre.pictures and theatre.pictures[-1].iteration == LAST_ITERATION)
        assert theatre.session.phase is Phase.FINISHED

    _play(pool, scene)


def test_a_slow_browser_is_not_flooded_and_gets_the_final_picture(pool):
    async def scene(theatre):
        _start(theatre, "plan")
        await _until(lambda: theatre.session.phase is Phase.FINISHED)
        await asyncio.sleep(0.1)
        assert 1 <= len(theatre.pictures) <= MAX_IN_FLIGHT
        for _ in range(MAX_IN_FLIGHT):
            theatre.loop.acknowledged()
        await _until(lambda: theatre.pictures[-1].iteration == LAST_ITERATION)

    _play(pool, scene, acknowledge=False)


def test_bad_input_is_one_sentence_and_the_session_goes_on(pool):
    async def scene(theatre):
        _start(theatre, "bad")
        await _until(lambda: theatre.sentences)
        assert theatre.sentences == ["The plan is bad; it must be good."]
        _start(theatre, "plan")
        await _until(lambda: theatre.session.phase is Phase.FINISHED)

    _play(pool, scene)


def test_an_exception_in_a_step_is_told_and_logged_and_pauses(pool, caplog):
    async def scene(theatre):
        _start(theatre, "breaks")
        await _until(lambda: theatre.sentences)
        assert theatre.sentences == ["This iteration failed (ZeroDivisionError: no)."]
        assert theatre.session.phase is Phase.PAUSED
        _start(theatre, "plan")
        await _until(lambda: theatre.session.phase is Phase.FINISHED)

    _play(pool, scene)
    assert "a step of a run failed" in caplog.text


def test_a_slow_pace_does_not_hold_up_a_restart(pool):
    async def scene(theatre):
        _start(theatre, "first")
        await _until(lambda: theatre.session.num_steps == 1)
        _start(theatre, "second")
        # At one iteration in 100 s only an interrupted wait lets the second run begin.
        await _until(lambda: theatre.pictures and theatre.pictures[-1].plan == "second")

    _play(pool, scene, speed=0.01)


def test_a_step_of_an_older_run_does_not_hold_up_a_new_one(pool):
    async def scene(theatre):
        _start(theatre, "slow")
        await _until(lambda: theatre.session.prepared_run is not None)
        await asyncio.sleep(0.05)
        _start(theatre, "plan")
        await _until(lambda: theatre.pictures and theatre.pictures[-1].plan == "plan")
        assert not released.is_set()
        released.set()
        await _until(lambda: theatre.session.phase is Phase.FINISHED)
        assert theatre.session.num_steps == LAST_ITERATION

    released.clear()
    _play(pool, scene)


def test_no_picture_of_an_older_run_is_shown_after_a_new_one(pool):
    async def scene(theatre):
        for number in range(20):
            _start(theatre, f"plan {number}")
            await asyncio.sleep(0.003)
        await _until(lambda: theatre.session.phase is Phase.FINISHED)
        await asyncio.sleep(0.05)
        numbers = [picture.run_number for picture in theatre.pictures]
        assert numbers == sorted(numbers)
        assert theatre.pictures[-1].plan == "plan 19"

    _play(pool, scene)


def test_commands_from_threads_are_obeyed(pool):
    """As Bokeh 3.10 gives them: it runs callbacks of a page in threads."""

    async def scene(theatre):
        for number in range(20):
            await asyncio.to_thread(_start, theatre, f"plan {number}")
        await _until(lambda: theatre.session.phase is Phase.FINISHED)
        await _until(
            lambda: (
                (theatre.pictures[-1].plan, theatre.pictures[-1].iteration)
                == ("plan 19", LAST_ITERATION)
            )
        )
        await asyncio.to_thread(theatre.loop.acknowledged)
        assert theatre.session.num_steps == LAST_ITERATION

    _play(pool, scene)


def test_a_session_takes_one_command_after_the_other():
    session, entered, leave = RunSession(), threading.Event(), threading.Event()
    session.restart("plan")
    job = session.next_job()

    def hold(step):
        entered.set()
        leave.wait(10.0)
        return step

    session.prepared(job, PreparedRun("plan", _state(0)))
    session.advanced(session.next_job(), _step(_state(0)))
    session._compact = hold
    hold.made = lambda _: False
    outcome = session.next_job(), _step(_state(1))
    advance = threading.Thread(target=session.advanced, args=outcome)
    advance.start()
    assert entered.wait(10.0)
    restart = threading.Thread(target=session.restart, args=("another",))
    restart.start()
    restart.join(0.1)
    assert restart.is_alive()
    leave.set()
    advance.join(10.0)
    restart.join(10.0)
    assert (session.num_steps, session.prepared_run) == (0, None)


def test_scrubbing_shows_that_iteration(pool):
    async def scene(theatre):
        _start(theatre, "plan")
        await _until(lambda: theatre.session.phase is Phase.FINISHED)
        theatre.session.scrub(1)
        theatre.loop.wake()
        await _until(lambda: theatre.pictures[-1].iteration == 1)

    _play(pool, scene)


def test_rate_is_that_of_the_iterations(pool):
    async def scene(theatre):
        assert theatre.loop.rate == 0.0
        _start(theatre, "plan")
        await _until(lambda: theatre.session.phase is Phase.FINISHED)
        await asyncio.sleep(0.01)
        # Paced to 20 a second; a busy machine is slower, and a clock tick may make it look faster.
        assert 1.0 < theatre.loop.rate < 22.0

    _play(pool, scene, speed=20.0)


def test_nothing_runs_for_a_page_that_was_closed(pool):
    async def scene(theatre):
        _start(theatre, "plan")
        await _until(lambda: theatre.session.num_steps == 1)
        theatre.watched["now"] = False
        await asyncio.sleep(0.15)
        # At 20 iterations a second the rest of the run would have taken 0.1 s.
        assert theatre.session.num_steps <= 2
        assert theatre.session.phase is Phase.RUNNING

    _play(pool, scene, speed=20.0)
