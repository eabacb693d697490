"""Serves the dashboard."""

import asyncio
import logging
import secrets
import socket
from pathlib import Path
from typing import Any

import panel as pn
from panel.io.application import build_applications
from tornado.ioloop import IOLoop
from tornado.websocket import WebSocketClosedError

from vsep.errors import InputError
from vsep_app.pages import PAGES
from vsep_app.server.health import HealthHandler
from vsep_app.server.patches import (
    COMPONENT_ROUTE,
    begin_busy_check,
    remember_defaults,
    replace_handlers,
)
from vsep_app.server.sessions import (
    LOADING_S,
    Admission,
    ServerLimits,
    SessionRegistry,
    shared_pool,
)
from vsep_app.teaching.experiment import (
    Experiment,
    read_experiments,
    require_different,
    shipped_experiments,
)

CHECK_SESSIONS_MS = 2000
LOOPBACK = ("127.0.0.1", "::1", "localhost")
# Thirty students, a lecturer, and a few who open a second page.
CLASSROOM = ServerLimits(most_pages=40, most_kept=32, most_studies=1)


def make_server(
    *,
    port: int,
    address: str,
    show: bool = False,
    experiments: Path | None = None,
    rules: ServerLimits | None = None,
) -> Any:
    """Return a server that is ready to start; its `registry` holds the open pages.

    The parameters are those of `serve`.

    Raises
    ------
    InputError
        If the port cannot be used, or a file of the folder is no experiment.
    """
    if not 0 <= port <= 65535:
        raise InputError(f"port is {port}; it must lie between 0 and 65535.")
    guided = _all_experiments(experiments)
    _require_free(port, address)
    replace_handlers()
    remember_defaults()
    everywhere = address in ("0.0.0.0", "::")
    origins = ["*"] if everywhere else [f"{address}:{port}", f"localhost:{port}"]
    loop: Any = IOLoop.current()
    # Only who sits at this machine may choose where on its disk rows go.
    registry = SessionRegistry(
        rules or ServerLimits(),
        own_folder=address in LOOPBACK,
        experiments=guided,
        loop=loop.asyncio_loop,
    )
    applications = build_applications(
        {page.route: registry.builder(page.load()) for page in PAGES.values()},
        title={page.route: page.title for page in PAGES.values()},
    )
    door = Admission(registry)
    for application in applications.values():
        application.add(door)
    server = pn.serve(
        applications,
        port=port,
        address=address,
        show=show,
        start=False,
        loop=loop,
        websocket_origin=origins if port else "*",
        check_unused_sessions_milliseconds=CHECK_SESSIONS_MS,
        unused_session_lifetime_milliseconds=round(1000 * LOADING_S),
        secret_key=secrets.token_urlsafe(32),
        sign_sessions=True,
        extra_patterns=[("/health", HealthHandler, {"registry": registry}), COMPONENT_ROUTE],
    )
    server.registry = registry
    begin_busy_check(loop)
    loop.asyncio_loop.set_exception_handler(_closed_pages_are_no_error)
    return server


def _all_experiments(folder: Path | None) -> tuple[Experiment, ...]:
    """Return the shipped experiments and those of a folder."""
    experiments = shipped_experiments()
    if folder is not None:
        experiments += read_experiments(folder)
        require_different(experiments)
    return experiments


def _closed_pages_are_no_error(loop: asyncio.AbstractEventLoop, context: dict[str, Any]) -> None:
    """Drop what the server says when a page is closed while a picture is on its way to it."""
    if not isinstance(context.get("exception"), WebSocketClosedError):
        loop.default_exception_handler(context)


def _require_free(port: int, address: str) -> None:
    """Raise `InputError` where the server could not listen."""
    family = socket.AF_INET6 if ":" in address else socket.AF_INET
    with socket.socket(family, socket.SOCK_STREAM) as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            probe.bind((address, port))
        except OSError as error:
            raise InputError(
                f"Port {port} on {address} cannot be used ({error.strerror}); choose another one."
            ) from error


def serve(
    *,
    port: int = 5006,
    address: str = "127.0.0.1",
    show: bool = False,
    experiments: Path | None = None,
    rules: ServerLimits | None = None,
) -> None:
    """Serve the dashboard until interrupted.

    Parameters
    ----------
    port : int
        0 takes any free one.
    address : str
        127.0.0.1 serves this machine only, 0.0.0.0 its network.
    show : bool
        Open it in the browser.
    experiments : Path or None
        Folder of further guided experiments.
    rules : ServerLimits or None
        What visitors get; None sets no limits.
    """
    logging.getLogger("bokeh").setLevel(logging.WARNING)
    server = make_server(
        port=port, address=address, show=show, experiments=experiments, rules=rules
    )
    shared_pool()
    server.start()
    try:
        server.io_loop.start()
    finally:
        server.registry.close()
        shared_pool().close()
