"""Serves the dashboard."""

import asyncio
import logging
import socket
from concurrent.futures import ThreadPoolExecutor
from functools import cache, partial
from typing import Any

import panel as pn
from tornado.websocket import WebSocketClosedError

from app.compare.page import TITLE as COMPARE_TITLE
from app.compare.page import ComparePage
from app.page import TITLE, Dashboard
from app.studies.page import TITLE as STUDIES_TITLE
from app.studies.page import StudyPage
from vsep._arrays import InputError

NUM_WORKERS = 2
UNUSED_SESSION_MS = 4000
CHECK_SESSIONS_MS = 2000
LOOPBACK = ("127.0.0.1", "::1", "localhost")
# Those whose studies have to be ended with the server.
_STUDY_PAGES: set[StudyPage] = set()


@cache
def shared_pool() -> ThreadPoolExecutor:
    """Return the workers that all sessions share."""
    return ThreadPoolExecutor(max_workers=NUM_WORKERS, thread_name_prefix="vsep")


def build() -> Any:
    """Build one session's page; called by the server for every visitor."""
    pn.extension(notifications=True, respect_explicit_sizing=True)
    document: Any = pn.state.curdoc
    query = pn.state.location.query_params if pn.state.location is not None else {}
    dashboard = Dashboard(
        shared_pool(), dict(query), document.add_next_tick_callback, partial(_watched, document)
    )
    pn.state.onload(dashboard.start)
    pn.state.on_session_destroyed(partial(_gone, dashboard))
    return dashboard.page()


def build_comparison() -> Any:
    """Build one session's compare page."""
    pn.extension(notifications=True, respect_explicit_sizing=True)
    document: Any = pn.state.curdoc
    query = pn.state.location.query_params if pn.state.location is not None else {}
    page = ComparePage(
        shared_pool(), dict(query), document.add_next_tick_callback, partial(_watched, document)
    )
    pn.state.onload(page.start)
    pn.state.on_session_destroyed(partial(_gone, page))
    return page.page()


def build_studies(*, own_folder: bool) -> Any:
    """Build one session's page of studies."""
    pn.extension(notifications=True, respect_explicit_sizing=True)
    document: Any = pn.state.curdoc
    page = StudyPage(document.add_next_tick_callback, own_folder=own_folder)
    pn.state.onload(page.start)
    pn.state.on_session_destroyed(partial(_closed, page))
    _STUDY_PAGES.add(page)
    return page.page()


def _closed(page: StudyPage, context: Any) -> None:
    del context
    _STUDY_PAGES.discard(page)
    page.close()


def _watched(document: Any) -> bool:
    context = document.session_context
    return context is None or context.session is None or context.session.connection_count > 0


def _gone(dashboard: Dashboard | ComparePage, context: Any) -> None:
    del context
    dashboard.loop.close()


def make_server(*, port: int, address: str, show: bool = False) -> Any:
    """Return a server that is ready to start.

    Raises
    ------
    InputError
        If the port cannot be used.
    """
    if not 0 <= port <= 65535:
        raise InputError(f"port is {port}; it must lie between 0 and 65535.")
    _require_free(port, address)
    everywhere = address in ("0.0.0.0", "::")
    origins = ["*"] if everywhere else [f"{address}:{port}", f"localhost:{port}"]
    server = pn.serve(
        # Only who sits at this machine may choose where on its disk rows go.
        {
            "/": build,
            "/compare": build_comparison,
            "/studies": lambda: build_studies(own_folder=address in LOOPBACK),
        },
        port=port,
        address=address,
        show=show,
        start=False,
        title={"/": TITLE, "/compare": COMPARE_TITLE, "/studies": STUDIES_TITLE},
        websocket_origin=origins if port else "*",
        check_unused_sessions=CHECK_SESSIONS_MS,
        unused_session_lifetime=UNUSED_SESSION_MS,
    )
    server.io_loop.asyncio_loop.set_exception_handler(_closed_pages_are_no_error)
    return server


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


def serve(*, port: int = 5006, address: str = "127.0.0.1", show: bool = False) -> None:
    """Serve the dashboard until interrupted.

    Parameters
    ----------
    port : int
        0 takes any free one.
    address : str
        127.0.0.1 serves this machine only, 0.0.0.0 its network.
    show : bool
        Open it in the browser.
    """
    logging.getLogger("bokeh").setLevel(logging.WARNING)
    server = make_server(port=port, address=address, show=show)
    server.start()
    try:
        server.io_loop.start()
    finally:
        for page in _STUDY_PAGES:
            page.close()
