"""Lets visitors in, and sees to it that who has left leaves nothing running."""

import asyncio
import math
import socket
import threading
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass, replace
from functools import cache, partial
from typing import Any

import panel as pn
from bokeh.application.handlers.handler import Handler
from bokeh.models import CustomJS
from panel.io.location import Location
from panel.io.state import set_curdoc

from vsep.files.frame import Frame
from vsep.inference.core.progress import Step
from vsep.inference.core.state import SeparationState
from vsep_app.jobs.background import BackgroundTasks
from vsep_app.jobs.pool import ClientQueue, WorkerPool
from vsep_app.jobs.run_session import MAX_KEPT
from vsep_app.jobs.shared_runs import SharedResources
from vsep_app.jobs.tasks import Prepared
from vsep_app.model.settings import Plan
from vsep_app.model.static_picture import StaticPicture
from vsep_app.pages import PAGES, PageEntry
from vsep_app.pages.base import PageBase, PageContext
from vsep_app.pages.compare.method_runs import MethodRunState
from vsep_app.pages.compare.picture import MethodView
from vsep_app.pages.compare.tasks import CompareStep, Comparison
from vsep_app.pages.live_address import plan_of_query
from vsep_app.pages.recording.tasks import PreparedRecording
from vsep_app.pages.tabs import Tabs
from vsep_app.server.access import Role
from vsep_app.server.lesson import Lesson, Seat
from vsep_app.server.patches import release_notifications
from vsep_app.server.seating import seat_for, start
from vsep_app.teaching.experiment import Experiment

# A page whose browser is gone may come back within this time.
ABSENCE_MS = 4000
# Time for all open pages after a new one has been built.
PAUSE_S = 0.1
# A page that is still loading takes a place, too; but when all are taken, the one that has loaded
# longest gives it up. Its browser, if there is one, gets the page all the same.
LOADING_S = 6.0
_FIRM_S = 2.0
RETRY_S = 20
# A page whose connection is lost is opened again, at its address, once the server can be reached.
# Bokeh's own way (`pn.config.reconnect`) leaves it empty: what a page has of functions cannot be
# read back into it.
_OPEN_AGAIN = """
const open_again = () => {
  fetch("health", {cache: "no-store"}).then(
    () => location.reload(), () => setTimeout(open_again, 1000))
}
setTimeout(open_again, 1000)
"""
KEPT = (
    StaticPicture,
    Comparison,
    CompareStep,
    Frame,
    MethodRunState,
    MethodView,
    Prepared,
    PreparedRecording,
    SeparationState,
    Step,
)


@dataclass(frozen=True, kw_only=True)
class ServerLimits:
    """What a server gives to each visitor, and to all together.

    Parameters
    ----------
    most_pages : int or None
        Pages open at once; who comes later is asked to wait. None: no limit.
    most_kept : int
        Iterations of a run that can be shown.
    most_studies : int or None
        Studies that run at once; None: no limit.
    with_lesson : bool
        Whether the owner can lead all visitors.
    """

    most_pages: int | None = None
    most_kept: int = MAX_KEPT
    most_studies: int | None = None
    with_lesson: bool = False


@cache
def shared_pool() -> WorkerPool:
    """Return the workers that all sessions share."""
    return WorkerPool(KEPT)


@dataclass(frozen=True, kw_only=True, eq=False)
class Session:
    """An open page.

    Parameters
    ----------
    page : PageBase
        The page.
    desk : ClientQueue
        Where it hands in its jobs.
    watched : callable
        Whether a browser is connected.
    since : float
        When it was opened, by the monotonic clock.
    expire : callable
        Lets the server forget it unless a browser connects.
    seat : Seat or None
        Its place in a lesson.
    """

    page: PageBase
    queue: ClientQueue
    watched: Callable[[], bool]
    since: float
    expire: Callable[[], None]
    seat: Seat | None = None


class SessionRegistry:
    """All open pages of a server.

    Parameters
    ----------
    rules : ServerLimits
        How many are let in, and what they get.
    experiments : sequence of Experiment
        Guided experiments to choose from.
    loop : asyncio.AbstractEventLoop or None
        The event loop of the server; None takes the one that runs when it is first needed.
    """

    def __init__(
        self,
        rules: ServerLimits,
        *,
        experiments: Sequence[Experiment] = (),
        loop: asyncio.AbstractEventLoop | None = None,
    ) -> None:
        self.rules = rules
        self._experiments, self._loop = experiments, loop
        self._background = BackgroundTasks(loop)
        self._building = threading.Lock()
        self.shared_resources = SharedResources()
        #: Who leads and who follows; None where nobody leads.
        self.lesson = Lesson() if rules.with_lesson else None
        self.open_sessions: dict[PageBase, Session] = {}
        self.num_refused = self.num_opened = 0

    @property
    def num_places_taken(self) -> int:
        """Pages that are looked at or still loading."""
        now = time.monotonic()
        return sum(
            session.watched() or now - session.since < LOADING_S
            for session in tuple(self.open_sessions.values())
        )

    @property
    def is_building(self) -> bool:
        """Whether a page is being built."""
        return self._building.locked()

    def builder(self, entry: PageEntry) -> Callable[[], Any]:
        """Return what the server calls for every visitor; it takes nothing but a function."""
        entry.load()

        def build() -> Any:
            return self.enter(entry)

        return build

    def first_picture(self, route: str, query: Mapping[str, str]) -> str:
        """Return the first picture of an address as HTML, or have it made for the next visitor."""
        plan = plan_of_query(query) if route == "/" else None
        if plan is None:
            return ""
        kept = self.shared_resources.first_pictures
        found = kept.get(plan)
        if found is None:
            self._background.begin(self._make_first_picture(plan))
        return "" if found is None else found.html

    async def _make_first_picture(self, plan: Plan) -> None:
        with closing(shared_pool().queue()) as queue:
            await self.shared_resources.first_pictures.make(plan, queue)

    async def make_card_pictures(self) -> None:
        """Make the small pictures of the experiments, for visitors to come."""
        with closing(shared_pool().queue()) as queue:
            await self.shared_resources.card_pictures.make(self._experiments, queue)

    def enter(self, entry: PageEntry) -> Any:
        """Make a page for a visitor, or a kind word if there is no place."""
        with self._building:
            return self._enter(entry)

    def _enter(self, entry: PageEntry) -> Any:
        pn.extension(notifications=True, browser_info=False, respect_explicit_sizing=True)
        document: Any = pn.state.curdoc
        release_notifications(document)
        if _has_gone(document.session_context):
            return pn.pane.HTML("")
        most = self.rules.most_pages
        if most is not None and not self._has_room(most):
            self.num_refused += 1
            return _no_place(document, most)
        queue, watched = shared_pool().queue(), partial(_watched, document)
        post = partial(_post, document)
        leads = _is_owner(document.session_context)
        seat, view = seat_for(
            self.lesson,
            entry.address,
            getattr(document.session_context, "request", None),
            leads=leads,
            post=post,
        )
        context = PageContext(
            pool=queue,
            query=dict(view.query),
            post=post,
            watched=watched,
            own_folder=leads,
            experiments=self._experiments,
            shared_resources=self.shared_resources,
            background=BackgroundTasks(self._loop),
            most_kept=self.rules.most_kept,
            most_studies=self.rules.most_studies,
            seat=seat,
            location=pn.state.location or Location(),
        )
        page = Tabs(context, view.page) if view.page in PAGES else entry.load()(context)
        self.num_opened += 1
        self.open_sessions[page] = Session(
            page=page,
            queue=queue,
            watched=watched,
            since=time.monotonic(),
            expire=partial(_expire, document),
            seat=seat,
        )
        pn.state.onload(partial(post, partial(start, page, seat)))
        pn.state.on_session_destroyed(partial(_leave, self, page))
        document.on_event("connection_lost", partial(self._lost, page))
        document.js_on_event("connection_lost", CustomJS(code=_OPEN_AGAIN))
        return page.page()

    def _has_room(self, most: int) -> bool:
        """Whether there is a place, and no crowd of pages that wait for their browsers."""
        if len(self.open_sessions) >= 2 * most:
            return False
        return self.num_places_taken < most or self._make_room()

    def _make_room(self) -> bool:
        """Take the place of the page that has waited longest for its browser; whether there is one.

        Whoever asks for pages without showing them, as a script does, holds no places by it.
        """
        now = time.monotonic()
        waiting = [
            session
            for session in self.open_sessions.values()
            if not session.watched() and _FIRM_S < now - session.since < LOADING_S
        ]
        if not waiting:
            return False
        longest = min(waiting, key=lambda session: session.since)
        self.open_sessions[longest.page] = replace(longest, since=-math.inf)
        longest.expire()
        return True

    def leave(self, page: PageBase) -> None:
        """End all work of a page; nothing happens if it has left already."""
        session = self.open_sessions.pop(page, None)
        if session is not None:
            if session.seat is not None:
                session.seat.leave()
            page.close()
            session.queue.close()

    def close(self) -> None:
        """End all work."""
        for page in tuple(self.open_sessions):
            self.leave(page)

    def _lost(self, page: PageBase, _: Any) -> None:
        """Give a page some time to come back."""
        self._background.begin(self._leave_unwatched(page))

    async def _leave_unwatched(self, page: PageBase) -> None:
        await asyncio.sleep(ABSENCE_MS / 1000.0)
        session = self.open_sessions.get(page)
        if session is not None and not session.watched():
            self.leave(page)


class Admission(Handler):
    """Lets pages be built one after the other, with time between for those that are open.

    Building a page takes most of a second, in which the server does little else.
    """

    def __init__(self, registry: SessionRegistry) -> None:
        super().__init__()
        self._registry = registry
        self._one_by_one = asyncio.Lock()
        self._last = 0.0

    def modify_document(self, doc: Any) -> None:
        """Leave the document as it is."""

    async def on_session_created(self, session_context: Any) -> None:
        """Wait until it is the visitor's turn; the page is built right afterwards."""
        del session_context
        async with self._one_by_one:
            while self._registry.is_building or time.monotonic() - self._last < PAUSE_S:
                await asyncio.sleep(PAUSE_S)
            self._last = time.monotonic()


def _post(document: Any, function: Callable[[], None]) -> None:
    """Run a function on the event loop with the document locked; Bokeh takes a thread for others.

    What is drawn so waits in the one queue whose length the pace of pictures follows; what comes
    after the document has gone is left.
    """

    async def run() -> None:
        if not _has_ended(document):
            with set_curdoc(document):
                function()

    if not _has_ended(document):
        document.add_next_tick_callback(run)


def _has_ended(document: Any) -> bool:
    """Whether the session of a document is over; nothing can be shown in it any more."""
    context = document.session_context
    return context is None or bool(context.destroyed)


def _leave(registry: SessionRegistry, page: PageBase, context: Any) -> None:
    del context
    registry.leave(page)


def _watched(document: Any) -> bool:
    context = document.session_context
    return context is None or context.session is None or context.session.connection_count > 0


def _expire(document: Any) -> None:
    context = document.session_context
    if context is not None and context.session is not None:
        context.session.request_expiration()


def _is_owner(context: Any) -> bool:
    """Whether a page was asked for with the token of who started the server; see `entry`."""
    request = None if context is None else context.request
    return getattr(request, "role", None) is Role.OWNER


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
