from dataclasses import dataclass, replace

import numpy as np
import pytest
from vsep_app.jobs.run_session import JobKind, Phase, RunSession
from vsep_app.jobs.weak_memo import WeakMemo

from vsep.inference.core.progress import IterationInfo, Step, Termination
from vsep.inference.core.state import ObjectComponents, SeparationState

LAST_ITERATION = 3


def _state(iteration):
    empty = np.zeros(0)
    signal = np.zeros((1, 8), dtype=np.complex128)
    objects = ObjectComponents(
        component_ids=np.zeros(0, dtype=np.int64),
        beats=empty,
        dopplers=empty,
        amplitudes=empty.astype(complex),
        covariance=np.zeros((0, 0), dtype=complex),
        precisions=empty,
    )
    return SeparationState(
        iteration=iteration,
        objects=objects,
        bursts=(),
        noise_precision=1.0,
        object_signal=signal,
        interference_signal=signal.copy(),
        next_component_id=0,
    )


@dataclass(frozen=True)
class PreparedRun:
    """A run of three steps."""

    plan: str
    initial_state: SeparationState


def _step(state):
    """The estimator: counts to three."""
    iteration = state.iteration + 1
    info = IterationInfo(
        elbo=float(iteration),
        events=(),
        max_frequency_change=0.0,
        noise_precision_change=0.0,
        searched=False,
        separability_ratio_db=float("nan"),
    )
    ended = iteration == LAST_ITERATION
    return Step(
        state=replace(state, iteration=iteration),
        info=info,
        termination=Termination.CONVERGED if ended else Termination.RUNNING,
        seconds=0.01,
    )


def _do(session):
    """Do the next job as the frame loop would; return what it was."""
    job = session.next_job()
    if job is None:
        return None
    if job.kind is JobKind.PREPARE:
        session.prepared(job, PreparedRun(job.plan, _state(0)))
    elif job.kind is JobKind.REPLAY:
        session.replayed(job)
    else:
        session.advanced(job, _step(job.state))
    return job.kind


def _do_all(session):
    kinds = []
    while (kind := _do(session)) is not None:
        kinds.append(kind)
    return kinds


@pytest.fixture
def session():
    """A session whose run is prepared and going."""
    new = RunSession()
    new.restart("plan")
    _do(new)
    return new


@pytest.fixture
def finished(session):
    """A session whose run has ended."""
    _do_all(session)
    return session


def test_a_new_session_has_nothing_to_do():
    session = RunSession()
    assert session.phase is Phase.IDLE
    assert session.next_job() is None
    assert session.snapshot() is None


def test_a_run_prepares_advances_and_finishes():
    session = RunSession()
    session.restart("plan")
    assert _do_all(session) == [JobKind.PREPARE, *[JobKind.ADVANCE] * LAST_ITERATION]
    assert session.phase is Phase.FINISHED
    assert session.termination is Termination.CONVERGED
    assert [step.state.iteration for step in session.snapshot().steps] == [1, 2, 3]


def test_pause_holds_and_run_goes_on_from_there(session):
    _do(session)
    session.pause()
    assert session.phase is Phase.PAUSED
    assert session.next_job() is None
    session.run()
    assert _do_all(session) == [JobKind.ADVANCE] * 2
    assert session.num_steps == LAST_ITERATION


def test_a_step_under_way_at_pause_is_kept_but_not_shown(session):
    job = session.next_job()
    session.pause()
    assert session.advanced(job, _step(job.state))
    assert (session.cursor, session.num_steps) == (0, 1)
    session.step()
    assert _do_all(session) == [JobKind.REPLAY]
    assert session.cursor == 1


def test_step_does_one_iteration_and_pauses(session):
    session.pause()
    session.step()
    assert _do_all(session) == [JobKind.ADVANCE]
    assert (session.cursor, session.phase) == (1, Phase.PAUSED)


def test_a_run_goes_to_an_iteration_and_pauses_there(session):
    session.run_to(2)
    assert _do_all(session) == [JobKind.ADVANCE] * 2
    assert (session.cursor, session.phase) == (2, Phase.PAUSED)
    session.run_to(1)
    assert (session.cursor, session.phase) == (1, Phase.PAUSED)
    session.run_to(99)
    _do_all(session)
    assert (session.cursor, session.phase) == (LAST_ITERATION, Phase.FINISHED)


@pytest.mark.parametrize("command", ["run", "restart"])
def test_what_the_user_does_meanwhile_forgets_where_to_pause(session, command):
    session.run_to(2)
    session.restart("another plan") if command == "restart" else session.run()
    _do_all(session)
    assert session.phase is Phase.FINISHED


def test_a_run_can_pause_before_its_first_iteration():
    session = RunSession()
    session.restart("plan")
    session.run_to(0)
    assert _do_all(session) == [JobKind.PREPARE]
    assert session.phase is Phase.PAUSED


def test_step_back_moves_the_cursor_only(finished):
    finished.step_back()
    assert (finished.cursor, finished.num_steps) == (2, LAST_ITERATION)
    assert finished.phase is Phase.PAUSED
    assert finished.termination is Termination.RUNNING
    assert len(finished.snapshot().steps) == 2


def test_step_back_stops_at_the_first_state(session):
    session.step_back()
    session.step_back()
    assert session.cursor == 0
    assert session.snapshot().steps == ()


@pytest.mark.parametrize(("wanted", "shown"), [(-4, 0), (0, 0), (2, 2), (3, 3), (99, 3)])
def test_scrub_stays_within_the_iterations_so_far(finished, wanted, shown):
    finished.scrub(wanted)
    assert finished.cursor == shown
    assert finished.phase is (Phase.FINISHED if shown == LAST_ITERATION else Phase.PAUSED)


def test_running_on_from_the_middle_replays_and_computes_nothing_anew(finished):
    before = finished.snapshot().steps
    finished.scrub(1)
    finished.run()
    assert _do_all(finished) == [JobKind.REPLAY] * 2
    assert finished.snapshot().steps == before
    assert finished.phase is Phase.FINISHED


def test_run_after_the_end_stays_finished(finished):
    finished.run()
    finished.step()
    assert finished.next_job() is None
    assert finished.phase is Phase.FINISHED


def test_reset_keeps_the_scene_and_forgets_the_steps(finished):
    finished.reset()
    assert (finished.cursor, finished.num_steps, finished.phase) == (0, 0, Phase.IDLE)
    assert finished.next_job() is None
    finished.run()
    assert _do_all(finished) == [JobKind.ADVANCE] * LAST_ITERATION


def test_outcomes_of_an_older_run_are_dropped(session):
    job = session.next_job()
    session.restart("new plan")
    assert not session.advanced(job, _step(job.state))
    assert not session.prepared(job, PreparedRun("plan", _state(0)))
    assert not session.replayed(job)
    assert not session.failed(job)
    assert session.prepared_run is None
    assert session.next_job().plan == "new plan"


def test_a_step_of_before_a_reset_is_dropped(session):
    job = session.next_job()
    session.reset()
    assert not session.advanced(job, _step(job.state))
    assert session.num_steps == 0


def test_a_failed_preparation_waits_for_another_plan():
    session = RunSession()
    session.restart("bad plan")
    assert session.failed(session.next_job())
    assert session.phase is Phase.IDLE
    assert session.next_job() is None
    session.restart("good plan")
    assert _do_all(session)[-1] is JobKind.ADVANCE


def test_a_failed_step_pauses_and_may_be_tried_again(session):
    _do(session)
    assert session.failed(session.next_job())
    assert (session.phase, session.num_steps) == (Phase.PAUSED, 1)
    session.run()
    assert _do_all(session) == [JobKind.ADVANCE] * 2


def test_restart_runs_even_if_the_last_run_was_paused(session):
    session.pause()
    session.restart("next")
    assert _do_all(session) == [JobKind.PREPARE, *[JobKind.ADVANCE] * LAST_ITERATION]


def test_of_a_long_run_some_steps_are_kept_without_what_shows_them():
    stripped = []

    def strip(step):
        stripped.append(step.state.iteration)
        return replace(step, seconds=-1.0)

    session = RunSession(None, strip, most_kept=2)
    session.restart("plan")
    _do(session)
    for _ in range(LAST_ITERATION - 1):
        _do(session)
    session.pause()
    assert stripped == []
    session.run()
    _do(session)
    # Three steps, two may be shown: every second one and the last.
    assert stripped == [1]
    session.scrub(1)
    assert session.cursor == 2
    session.step_back()
    assert session.cursor == 0
    session.step()
    _do(session)
    assert session.cursor == 2
    assert [step.seconds for step in session.snapshot().steps] == [-1.0, 0.01]


def test_a_run_goes_to_an_iteration_that_is_not_kept_and_pauses_there():
    session = RunSession(None, lambda step: replace(step, seconds=-1.0), most_kept=2)
    session.restart("plan")
    _do_all(session)
    for start in (session.cursor, 0):
        session.scrub(start)
        session.run_to(1)
        _do_all(session)
        assert (session.cursor, session.phase) == (1, Phase.PAUSED)
        assert session.snapshot().steps[0].seconds == 0.01
        session.run()
        _do_all(session)
        assert session.phase is Phase.FINISHED


def test_a_job_says_whether_its_state_is_exact():
    session = RunSession(WeakMemo(replace))
    session.restart("plan")
    _do(session)
    job = session.next_job()
    assert (job.iteration, job.is_exact) == (1, True)
    shared = WeakMemo(replace)
    session = RunSession(shared)
    session.restart("plan")
    _do(session)
    session.advanced(session.next_job(), shared(_step(_state(0))))
    job = session.next_job()
    assert (job.iteration, job.is_exact) == (2, False)
