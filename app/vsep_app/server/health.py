"""Health of the server as JSON at `/health`."""

import json
import os
from typing import Any

from tornado.web import RequestHandler

from vsep_app.server.process_figures import all_memory_mb, cpu_s, memory_mb
from vsep_app.server.sessions import SessionRegistry, shared_pool

MEGABYTE = 1e6
OK = "ok"


class HealthHandler(RequestHandler):
    """Answer `/health`; asking builds no page and starts no work."""

    def initialize(self, registry: SessionRegistry) -> None:
        """Take the sessions of the server."""
        self._registry = registry

    def get(self) -> None:
        """Write the figures; the code is 503 while there is no worker to make pictures."""
        told = figures(self._registry)
        self.set_status(200 if told["status"] == OK else 503)
        self.set_header("Content-Type", "application/json")
        self.set_header("Cache-Control", "no-store")
        self.write(json.dumps(told, indent=1) + "\n")


def figures(registry: SessionRegistry) -> dict[str, Any]:
    """Return what a server is doing: pages, jobs, memory in MB, pictures a second."""
    open_sessions, pool, shared_resources = (
        tuple(registry.open_sessions.values()),
        shared_pool().figures(),
        registry.shared_resources,
    )
    return {
        "status": OK if pool.workers else "no worker process is running",
        "pages": len(open_sessions),
        "pages_watched": sum(session.watched() for session in open_sessions),
        "pages_at_most": registry.rules.most_pages,
        "pages_opened": registry.num_opened,
        "pages_refused": registry.num_refused,
        "pages_with_jobs": sum(bool(session.queue.at_work) for session in open_sessions),
        "workers": pool.workers,
        "workers_wanted": pool.wanted,
        "workers_replaced": pool.replaced,
        "jobs_at_work": pool.at_work,
        "jobs_waiting": pool.waiting,
        "jobs_done": pool.done,
        "pictures_per_s": shared_resources.pace.rate,
        "shortest_time_between_pictures_s": shared_resources.pace.period_s,
        "shared_runs": len(shared_resources.runs),
        "shared_runs_mb": shared_resources.runs.size / MEGABYTE,
        "all_mb": all_memory_mb(os.getpid()),
        "server_mb": memory_mb(os.getpid()),
        "workers_mb": [memory_mb(number) for number in pool.process_ids],
        "server_cpu_s": cpu_s(os.getpid()),
        "workers_cpu_s": [cpu_s(number) for number in pool.process_ids],
    }
