import gc

import pytest
from vsep_app.jobs.object_cache import ObjectCache

from tests.app.test_run_session import _state, _step
from vsep.inference.core.progress import Step
from vsep.inference.core.state import SeparationState

KEPT = (Step, SeparationState)


@pytest.fixture
def ends():
    """The server's end and the worker's end of a pipe."""
    return ObjectCache(KEPT, serving=True), ObjectCache(KEPT, serving=False)


def test_a_record_is_sent_once(ends):
    server, worker = ends
    step = _step(_state(0))
    first = server.pack((step, "first"))
    copy, _ = worker.unpack(first)
    again = server.pack((step, "again"))
    assert worker.unpack(again)[0] is copy
    # The arrays of a state alone are longer than a message that only names it.
    assert len(again) < 200 < len(first)


def test_a_record_comes_back_as_itself_also_from_inside_of_another(ends):
    server, worker = ends
    step = _step(_state(0))
    state = worker.unpack(server.pack(step)).state
    assert server.unpack(worker.pack([state]))[0] is step.state


def test_what_the_worker_made_is_known_to_both(ends):
    server, worker = ends
    made = _step(_state(4))
    received = server.unpack(worker.pack(made))
    assert received.state.iteration == 5
    assert worker.unpack(server.pack(received)) is made
    assert worker.unpack(server.pack(received.state)) is made.state


def test_nothing_is_kept_that_the_server_has_no_use_for(ends):
    server, worker = ends
    step = _step(_state(0))
    worker.unpack(server.pack(step))
    server.unpack(worker.pack(_step(_state(1))))
    assert len(worker) == 4
    del step
    gc.collect()
    assert len(server) == 0
    worker.unpack(server.pack("tells what is gone"))
    assert len(worker) == 0


def test_a_parcel_that_cannot_be_packed_leaves_no_trace(ends):
    server, worker = ends
    step = _step(_state(0))
    with pytest.raises((AttributeError, TypeError)):
        server.pack((step, lambda: None))
    assert len(server) == 0
    assert worker.unpack(server.pack(step)).state.iteration == 1
