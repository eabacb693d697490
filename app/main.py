"""Serves the dashboard."""

import logging
from concurrent.futures import ThreadPoolExecutor
from functools import cache, partial
from typing import Any

import panel as pn

from app.page import TITLE, Dashboard
from vsep._arrays import InputError

NUM_WORKERS = 2
UNUSED_SESSION_MS = 4000
CHECK_SESSIONS_MS = 2000


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


def _watched(document: Any) -> bool:
    context = document.session_context
    return context is None or context.session is None or context.session.connection_count > 0


def _gone(dashboard: Dashboard, context: Any) -> None:
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
    everywhere = address in ("0.0.0.0", "::")
    origins = ["*"] if everywhere else [f"{address}:{port}", f"localhost:{port}"]
    try:
        return pn.serve(
            build,
            port=port,
            address=address,
            show=show,
            start=False,
            title=TITLE,
            websocket_origin=origins if port else "*",
            check_unused_sessions=CHECK_SESSIONS_MS,
            unused_session_lifetime=UNUSED_SESSION_MS,
        )
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
    server.io_loop.start()
