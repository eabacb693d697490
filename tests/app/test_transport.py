import pytest
from param.parameterized import edit_constant
from vsep_app.jobs.run_session import Phase, RunSession
from vsep_app.jobs.tasks import advance, compose
from vsep_app.model.settings import Settings
from vsep_app.widgets.transport import Transport


@pytest.fixture
def session(one_ramp):
    """A finished run of some iterations."""
    session = RunSession()
    session.restart("a plan")
    session.prepared(session.next_job(), one_ramp.prepared)
    while (job := session.next_job()) is not None:
        session.advanced(job, advance(job.prepared_run, job.state))
    return session


@pytest.fixture
def transport(session):
    """The row above the views of that run."""
    return Transport(Settings(), session, lambda: None)


def release(slider, value):
    """What the browser sends when the slider is released."""
    slider.value = value
    with edit_constant(slider):
        slider.value_throttled = value


def test_an_old_value_that_a_slow_browser_sends_back_does_not_hold_the_run(session, transport):
    last = session.num_steps
    transport.scrub.end = last
    transport.scrub._process_events({"value": last - 1})
    assert transport.scrub.value == last - 1
    assert (session.cursor, session.phase) == (last, Phase.FINISHED)


def test_what_the_server_shows_is_no_command_of_the_user(session, transport):
    last = session.num_steps
    for iteration in range(last):
        transport.show_place(iteration, last)
        assert (session.cursor, session.phase) == (last, Phase.FINISHED)
    assert transport.scrub.value_throttled == -1


def test_the_same_iteration_can_be_looked_at_twice(session, transport):
    transport.scrub.end = session.num_steps
    # The browser reports changes only: what it holds must be no iteration.
    assert transport.scrub.value_throttled == -1
    for _ in range(2):
        release(transport.scrub, 1)
        assert (session.cursor, session.phase) == (1, Phase.PAUSED)
        release(transport.scrub, session.num_steps)
        assert session.phase is Phase.FINISHED
        assert transport.scrub.value_throttled == -1


def test_a_error_leaves_the_status_of_the_run_as_it_is(session, transport):
    transport.show(compose(session.snapshot(), 0, "level"), 0.0)
    status = transport.status.object
    assert ">converged<" in status
    assert f"iteration {session.num_steps} of" in status
    transport.refresh(0.0)
    assert transport.status.object == status
    session.restart("another plan")
    transport.refresh(0.0)
    assert ">running<" in transport.status.object
    assert "iteration" not in transport.status.object
