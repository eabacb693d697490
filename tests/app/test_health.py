import json
import os
from dataclasses import replace

from vsep_app.server.health import figures
from vsep_app.server.process_figures import all_memory_mb, cpu_s, memory_mb
from vsep_app.server.sessions import ServerLimits, SessionRegistry, shared_pool


def test_figures_are_plain_numbers_of_the_server():
    told = json.loads(json.dumps(figures(SessionRegistry(ServerLimits(most_pages=7)))))
    assert told["pages_at_most"] == 7
    assert told["pages"] == told["jobs_waiting"] == 0
    assert len(told["workers_mb"]) == told["workers"]


def test_health_is_not_ok_without_a_worker(monkeypatch):
    registry = SessionRegistry(ServerLimits())
    shared_pool().queue().submit(os.getpid).result(60.0)
    assert figures(registry)["status"] == "ok"
    lacking = replace(shared_pool().figures(), workers=0, process_ids=())
    monkeypatch.setattr(type(shared_pool()), "figures", lambda _: lacking)
    told = figures(registry)
    assert told["status"] == "no worker process is running"
    assert told["workers"] == 0 < told["workers_wanted"]


def test_memory_and_time_of_a_process():
    # This one has loaded numpy, and used some time for that.
    assert memory_mb(os.getpid()) > 20.0
    assert cpu_s(os.getpid()) > 0.05
    assert memory_mb(2**22 + 1) is None
    assert all_memory_mb(2**22 + 1) is None
    assert cpu_s(2**22 + 1) is None
