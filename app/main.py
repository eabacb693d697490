"""Serves the dashboard."""

import asyncio
import logging
import socket
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import cache, partial
from pathlib import Path
from typing import Any

import panel as pn
from tornado.websocket import WebSocketClosedError

from app.compare.page import TITLE as COMPARE_TITLE
from app.compare.page import ComparePage
from app.laboratory.page import TITLE as LABORATORY_TITLE
from app.laboratory.page import LaboratoryPage
from app.page import TITLE, Dashboard
from app.studies.page import TITLE as STUDIES_TITLE
from app.studies.page import StudyPage
from app.teaching.experiment import (
    Experiment,
    read_experiments,
    require_different,
    shipped_experiments,
)
from app.visit import Visit, VisitedPage
from vsep._arrays import InputError

NUM_WORKERS = 2
UNUSED_SESSION_MS = 4000
CHECK_SESSIONS_MS = 2000
LOOPBACK = ("127.0.0.1", "::1", "localhost")
PAGES: dict[str, tuple[Callable[[Visit], VisitedPage], str]] = {
    "/": (Dashboard, TITLE),
    "/compare": (ComparePage, COMPARE_TITLE),
    "/laboratory": (LaboratoryPage, LABORATORY_TITLE),
    "/studies": (StudyPage, STUDIES_TITLE),
}
# Those whose work has to be ended with the server.
_OPEN_PAGES: set[VisitedPage] = set()


@cache
def shared_pool() -> ThreadPoolExecutor:
    """Return the workers that all sessions share."""
    return ThreadPoolExecutor(max_workers=NUM_WORKERS, thread_name_prefix="vsep")


def builder(
    page_class: Callable[[Visit], VisitedPage],
    *,
    own_folder: bool,
    experiments: Sequence[Experiment],
) -> Callable[[], Any]:
    """Return what the server calls for every visitor; it takes nothing but a plain function."""

    def build() -> Any:
        return _build(page_class, own_folder=own_folder, experiments=experiments)

    return build


def _build(
    page_class: Callable[[Visit], VisitedPage],
    *,
    own_folder: bool,
    experiments: Sequence[Experiment],
) -> Any:
    pn.extension(notifications=True, respect_explicit_sizing=True)
    document: Any = pn.state.curdoc
    location = pn.state.location
    visited = page_class(
        Visit(
            pool=shared_pool(),
            query=dict(location.query_params) if location is not None else {},
            post=document.add_next_tick_callback,
            watched=partial(_watched, document),
            own_folder=own_folder,
            experiments=experiments,
        )
    )
    pn.state.onload(visited.start)
    pn.state.on_session_destroyed(partial(_leave, visited))
    _OPEN_PAGES.add(visited)
    return visited.page()


def _watched(document: Any) -> bool:
    context = document.session_context
    return context is None or context.session is None or context.session.connection_count > 0


def _leave(visited: VisitedPage, context: Any) -> None:
    del context
    _OPEN_PAGES.discard(visited)
    visited.close()


def make_server(
    *, port: int, address: str, show: bool = False, experiments: Path | None = None
) -> Any:
    """Return a server that is ready to start; the parameters are those of `serve`.

    Raises
    ------
    InputError
        If the port cannot be used, or a file of the folder is no experiment.
    """
    if not 0 <= port <= 65535:
        raise InputError(f"port is {port}; it must lie between 0 and 65535.")
    guided = _all_experiments(experiments)
    _require_free(port, address)
    everywhere = address in ("0.0.0.0", "::")
    origins = ["*"] if everywhere else [f"{address}:{port}", f"localhost:{port}"]
    server = pn.serve(
        # Only who sits at this machine may choose where on its disk rows go.
        {
            route: builder(page_class, own_folder=address in LOOPBACK, experiments=guided)
            for route, (page_class, _) in PAGES.items()
        },
        port=port,
        address=address,
        show=show,
        start=False,
        title={route: title for route, (_, title) in PAGES.items()},
        websocket_origin=origins if port else "*",
        check_unused_sessions=CHECK_SESSIONS_MS,
        unused_session_lifetime=UNUSED_SESSION_MS,
    )
    server.io_loop.asyncio_loop.set_exception_handler(_closed_pages_are_no_error)
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
    """
    logging.getLogger("bokeh").setLevel(logging.WARNING)
    server = make_server(port=port, address=address, show=show, experiments=experiments)
    server.start()
    try:
        server.io_loop.start()
    finally:
        for visited in tuple(_OPEN_PAGES):
            visited.close()
