"""Lets visitors in, and sees to it that who has left leaves nothing running."""

import asyncio
import socket
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache, partial
from typing import Any

import panel as pn
from bokeh.application.handlers.handler import Handler
from bokeh.models import CustomJS

from app.backdrop import Backdrop
from app.commons import Commons
from app.compare.lanes import LaneState
from app.compare.picture import LaneView
from app.compare.work import CompareStep, Comparison
from app.pool import Desk, WorkerPool
from app.recording.work import RecordingOpening
from app.session import MOST_KEPT
from app.teaching.experiment import Experiment
from app.visit import Visit, VisitedPage
from app.work import Prepared
from vsep.files.frame import Frame
from vsep.first_use import separate_one_frame
from vsep.inference.progress import Step
from vsep.inference.state import SeparationState

# A page whose browser is gone may come back within this time.
ABSENCE_MS = 4000
# Time for all open pages after a new one has been built.
PAUSE_S = 0.1
# A page that is still loading takes a place, too.
LOADING_S = 15.0
RETRY_S = 20
KEPT = (
    Backdrop,
    Comparison,
    CompareStep,
    Frame,
    LaneState,
    LaneView,
    Prepared,
    RecordingOpening,
    SeparationState,
    Step,
)


@dataclass(frozen=True, kw_only=True)
class Rules:
    """What a server gives to each visitor, and to all together.

    Parameters
    ----------
    most_pages : int or None
        Pages open at once; who comes later is asked to wait. None: no limit.
    most_kept : int
        Iterations of a run that can be shown.
    most_studies : int or None
        Studies that run at once; None: no limit.
    """

    most_pages: int | None = None
    most_kept: int = MOST_KEPT
    most_studies: int | None = None


@cache
def shared_pool() -> WorkerPool:
    """Return the workers that all sessions share."""
    return WorkerPool(KEPT, prepare=separate_one_frame)


@dataclass(frozen=True, kw_only=True, eq=False)
class Guest:
    """An open page.

    Parameters
    ----------
    page : VisitedPage
        The page.
    desk : Desk
        Where it hands in its jobs.
    watched : callable
        Whether a browser is connected.
    since : float
        When it was opened, by the monotonic clock.
    """

    page: VisitedPage
    desk: Desk
    watched: Callable[[], bool]
    since: float


class Lobby:
    """All open pages of a server.

    Parameters
    ----------
    rules : Rules
        How many are let in, and what they get.
    own_folder : bool
        Whether visitors sit at this machine and may choose where on its disk rows go.
    experiments : sequence of Experiment
        Guided experiments to choose from.
    """

    def __init__(
        self, rules: Rules, *, own_folder: bool, experiments: Sequence[Experiment] = ()
    ) -> None:
        self.rules, self._own_folder = rules, own_folder
        self._experiments = experiments
        self.commons = Commons()
        self.guests: dict[VisitedPage, Guest] = {}
        self.num_refused = self.num_opened = 0

    @property
    def num_places_taken(self) -> int:
        """Pages that are looked at or still loading."""
        now = time.monotonic()
        return sum(
            guest.watched() or now - guest.since < LOADING_S for guest in self.guests.values()
        )

    def builder(self, page_class: Callable[[Visit], VisitedPage]) -> Callable[[], Any]:
        """Return what the server calls for every visitor; it takes nothing but a function."""

        def build() -> Any:
            return self.enter(page_class)

        return build

    def enter(self, page_class: Callable[[Visit], VisitedPage]) -> Any:
        """Make a page for a visitor, or a kind word if there is no place."""
        pn.extension(notifications=True, respect_explicit_sizing=True)
        document: Any = pn.state.curdoc
        if _has_gone(document.session_context):
            return pn.pane.HTML("")
        most = self.rules.most_pages
        if most is not None and self.num_places_taken >= most:
            self.num_refused += 1
            return _no_place(document, most)
        location = pn.state.location
        desk, watched = shared_pool().desk(), partial(_watched, document)
        page = page_class(
            Visit(
                pool=desk,
                query=dict(location.query_params) if location is not None else {},
                post=document.add_next_tick_callback,
                watched=watched,
                own_folder=self._own_folder,
                experiments=self._experiments,
                commons=self.commons,
                most_kept=self.rules.most_kept,
                most_studies=self.rules.most_studies,
            )
        )
        self.num_opened += 1
        self.guests[page] = Guest(page=page, desk=desk, watched=watched, since=time.monotonic())
        pn.state.onload(page.start)
        pn.state.on_session_destroyed(partial(_leave, self, page))
        document.on_event("connection_lost", partial(self._lost, page))
        return page.page()

    def leave(self, page: VisitedPage) -> None:
        """End all work of a page; nothing happens if it has left already."""
        guest = self.guests.pop(page, None)
        if guest is not None:
            page.close()
            guest.desk.close()

    def close(self) -> None:
        """End all work."""
        for page in tuple(self.guests):
            self.leave(page)

    def _lost(self, page: VisitedPage, _: Any) -> None:
        """Give a page some time to come back."""
        asyncio.get_running_loop().call_later(ABSENCE_MS / 1000.0, self._leave_unwatched, page)

    def _leave_unwatched(self, page: VisitedPage) -> None:
        guest = self.guests.get(page)
        if guest is not None and not guest.watched():
            self.leave(page)


class Door(Handler):
    """Lets pages be built one after the other, with time between for those that are open.

    Building a page takes the server most of a second in which it does nothing else.
    """

    def __init__(self) -> None:
        super().__init__()
        self._one_by_one = asyncio.Lock()
        self._last = 0.0

    def modify_document(self, doc: Any) -> None:
        """Leave the document as it is."""

    async def on_session_created(self, session_context: Any) -> None:
        """Wait until it is the visitor's turn; the page is built right afterwards."""
        del session_context
        async with self._one_by_one:
            while time.monotonic() - self._last < PAUSE_S:
                await asyncio.sleep(PAUSE_S)
            self._last = time.monotonic()


def _leave(lobby: Lobby, page: VisitedPage, context: Any) -> None:
    del context
    lobby.leave(page)


def _watched(document: Any) -> bool:
    context = document.session_context
    return context is None or context.session is None or context.session.connection_count > 0


def _has_gone(context: Any) -> bool:
    """Whether the browser has hung up before its page was built, as after many reloads."""
    request = None if context is None else context.request
    try:
        stream = request.connection.stream.socket  # type: ignore[union-attr]
        return bool(stream.recv(1, socket.MSG_PEEK | socket.MSG_DONTWAIT) == b"")
    except (AttributeError, OSError):
        return False


def _no_place(document: Any, most: int) -> Any:
    document.js_on_event(
        "document_ready", CustomJS(code=f"setTimeout(() => location.reload(), {1000 * RETRY_S})")
    )
    return pn.pane.HTML(
        '<main style="max-width:34em;margin:18vh auto;padding:0 1em;font:17px/1.5 sans-serif">'
        f"<h1>All {most} places are taken</h1><p>This server shows as many pages as it can without "
        f"slowing them down. Close a page that nobody needs; this one tries again every {RETRY_S} "
        "seconds.</p></main>",
        sizing_mode="stretch_width",
    )
