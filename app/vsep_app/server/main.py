"""Serves the dashboard."""

import asyncio
import logging
import secrets
import socket
import sys
from pathlib import Path
from typing import Any

import panel as pn
from bokeh.settings import settings
from panel.io.application import build_applications
from panel.io.server import ComponentResourceHandler
from tornado.ioloop import IOLoop
from tornado.websocket import WebSocketClosedError

from vsep.errors import InputError
from vsep_app.pages import EMBED, LEAD, PAGES
from vsep_app.server.access import Access, EntryRules
from vsep_app.server.announce import announcement, base_address, open_browser
from vsep_app.server.component_facts import spare_components
from vsep_app.server.connections import HTTP_BOUNDS, bound_connections
from vsep_app.server.entry import guard_entry, log_request
from vsep_app.server.health import HealthHandler
from vsep_app.server.memory import begin_tidying, few_arenas, look_through_less
from vsep_app.server.message_facts import look_up_models
from vsep_app.server.message_guard import MAX_BUFFER, MAX_TEXT
from vsep_app.server.model_facts import remember_defaults
from vsep_app.server.opening import Opening
from vsep_app.server.patches import (
    COMPONENT_ROUTE,
    begin_busy_check,
    replace_handlers,
)
from vsep_app.server.sessions import (
    Admission,
    ServerLimits,
    SessionRegistry,
    shared_pool,
)
from vsep_app.server.static_files import PACKED
from vsep_app.teaching.experiment import (
    Experiment,
    read_experiments,
    require_different,
    shipped_experiments,
)

CHECK_SESSIONS_MS = 2000
UNUSED_SESSION_MS = 15_000  # a slow browser has connected by then
# Thirty students, a lecturer, and a few who open a second page.
CLASSROOM = ServerLimits(most_pages=40, most_kept=32, most_studies=1, with_lesson=True)


def make_server(
    *,
    port: int,
    address: str,
    prefix: str = "",
    entry: EntryRules | None = None,
    experiments: Path | None = None,
    rules: ServerLimits | None = None,
) -> Any:
    """Return a server that is ready to start.

    Its `registry` holds the open pages, its `access` the token and the code.

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
    few_arenas()
    replace_handlers()
    remember_defaults()
    spare_components()
    look_up_models()
    # The first looks at the signature of each callback of every page anew, the second through all
    # models of a page for mistakes of its author, which the tests would have met.
    settings.perform_error_diagnostics = False
    settings.perform_document_validation = False
    loop: Any = IOLoop.current()
    registry = SessionRegistry(rules or ServerLimits(), experiments=guided, loop=loop.asyncio_loop)
    pages = [*PAGES.values(), EMBED, *([] if registry.lesson is None else [LEAD])]
    applications = build_applications(
        {page.route: registry.builder(page) for page in pages},
        title={page.route: page.title for page in pages},
    )
    door = Admission(registry)
    for application in applications.values():
        application.add(door)
    server = pn.serve(
        applications,
        port=port,
        address=address,
        prefix=prefix,
        show=False,
        start=False,
        verbose=False,
        loop=loop,
        check_unused_sessions_milliseconds=CHECK_SESSIONS_MS,
        unused_session_lifetime_milliseconds=UNUSED_SESSION_MS,
        secret_key=secrets.token_urlsafe(32),
        sign_sessions=True,
        # A page holds a signed copy of what it was asked with, which is nobody's business.
        include_headers=["Host"],
        include_cookies=[],
        websocket_max_message_size=MAX_TEXT + MAX_BUFFER,
        http_server_kwargs=HTTP_BOUNDS,
        log_function=log_request,
        extra_patterns=[("/health", HealthHandler, {"registry": registry}), COMPONENT_ROUTE],
    )
    server.registry = registry
    server.access = Access(entry or EntryRules(), port=server.port)
    # Panel's own route of components stands behind ours, and would import modules.
    routes = server._tornado.wildcard_router.rules
    routes[:] = [rule for rule in routes if rule.target is not ComponentResourceHandler]
    for rule in routes:
        rule.target = PACKED.get(rule.target, rule.target)
    server._tornado.settings.update(opening=Opening(), registry=registry)
    guard_entry(
        server._tornado,
        server.access,
        f"{server.prefix}/health",
        owned=[f"{server.prefix}{LEAD.route}"],
    )
    if registry.lesson is not None:
        registry.lesson.place = base_address(address, server.port, server.prefix)
        registry.lesson.code = server.access.code or ""
    bound_connections(server)
    begin_busy_check(loop)
    begin_tidying(loop, lambda: len(registry.open_sessions))
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
    prefix: str = "",
    entry: EntryRules | None = None,
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
    prefix : str
        Folder of all addresses, as ``tools/vsep``.
    entry : EntryRules or None
        Who gets in; None: who has the token that is printed.
    experiments : Path or None
        Folder of further guided experiments.
    rules : ServerLimits or None
        What visitors get; None sets no limits.
    """
    logging.getLogger("bokeh").setLevel(logging.WARNING)
    server = make_server(
        port=port,
        address=address,
        prefix=prefix,
        entry=entry,
        experiments=experiments,
        rules=rules,
    )
    shared_pool()
    server.start()
    look_through_less()
    # The first visitor is to see the first picture, too.
    server.io_loop.add_callback(server.registry.first_picture, "/", {})
    server.io_loop.add_callback(server.registry.make_card_pictures)
    access, prefix = server.access, server.prefix
    sys.stderr.write(
        announcement(
            access, address=address, prefix=prefix, leads=server.registry.lesson is not None
        )
    )
    if show:
        place = f"{base_address(address, access.port, prefix)}?token={access.token}"
        server.io_loop.add_callback(open_browser, place, server.io_loop)
    try:
        server.io_loop.start()
    finally:
        server.registry.close()
        shared_pool().close()
