"""Changes to Bokeh and Panel: all that this program alters of their behaviour, with the reason.

Each entry names the report in the project it belongs to, and `tests/app/test_patches.py` and the
tests of the two modules show that the project as it is still needs it.

=====================  ==========================================================================
what is changed        upstream
=====================  ==========================================================================
`PromptHandler`        tornado issue 755 gave connections `set_nodelay`; Bokeh does not call it, no
                       report; nor does Bokeh hold what a browser sends against any bound
`OwnSessionHandler`    no report: Bokeh lets any address name the session that a page joins
`LoadedOnlyHandler`    Panel pull request 3284 made the route; no report on what it imports
`model_facts`          Bokeh pull request 15322 keeps the overridden defaults of a class from 3.10
                       on; all else that a model works out anew, no report
`component_facts`      Panel sends no modules with a bundle from 1.10 on; all else that a component
                       works out anew, no report; nor on links of all pages that are looked
                       through while another page adds some, nor on classes that no page uses
`message_facts`        no report: Bokeh makes a table of all models of a page for each message
`bundles`, `fonts`     no report: scripts and fonts are sent whole
`begin_busy_check`     no report: a task of the whole server runs in the context of one document
`leave_busy_state`     no report: param watches a reference whose place a value has taken
`release_notifications` no report: Panel keeps the notifications of a page that has gone
`page/opening.js`      no report: BokehJS writes a style sheet again that has not changed, and lays
                       out the whole page, with what is hidden, as often as any component asks for
                       it; Panel adds an entry to the history with every change of the address
=====================  ==========================================================================
"""

import logging
import sys
from functools import partial
from typing import Any

import panel as pn
from bokeh.document import Document
from bokeh.server.urls import per_app_patterns
from panel.io.server import ComponentResourceHandler, DocHandler, WSHandler
from panel.util import parse_query
from panel.util.parameters import edit_readonly
from tornado.web import GZipContentEncoding, HTTPError

from vsep.errors import InputError
from vsep_app.server.message_guard import MAX_BUFFER, MAX_TEXT, MessageGuard

_log = logging.getLogger(__name__)
# Why a connection is closed, by RFC 6455.
_TOO_LARGE, _UNREADABLE, _ENDED, _FAILED = 1009, 1007, 1001, 1011
_FOREIGN = ("bokeh-session-id", "bokeh-token")
# What the pages show is made of classes of these packages.
_SERVED = ("panel", "panel_material_ui", "vsep_app")


class PromptHandler(WSHandler):
    """A connection that sends small messages at once, and takes no message out of bounds.

    A picture is some dozens of them, and the second would wait until the browser has confirmed the
    first, which a browser with nothing to say does after 40 ms.
    """

    def __init__(self, *arguments: Any, **named: Any) -> None:
        super().__init__(*arguments, **named)
        self._guard = MessageGuard()
        self._num_bytes = 0

    def check_origin(self, origin: str) -> bool:
        """Whether the request came through the entry, which has looked at its origin."""
        del origin
        return hasattr(self.request, "role")

    async def _async_open(self, token: str) -> None:
        """Open the session; a connection without one would wait for ever, and is closed."""
        try:
            await super()._async_open(token)
        except Exception as error:
            _log.error("a page could not be opened", exc_info=error)
            self.close(_FAILED, "The page could not be opened.")

    async def on_message(self, fragment: str | bytes) -> None:
        """Take a part of a message; all of a message together has a bound, too."""
        self._num_bytes += len(fragment)
        is_text = isinstance(fragment, str)
        if self.receiver is None or self._num_bytes > MAX_TEXT + (0 if is_text else MAX_BUFFER):
            self.close(_TOO_LARGE, "The message is too large.")
            return
        try:
            message = await self.receiver.consume(fragment)
        except Exception:
            self.close(_UNREADABLE, "The message cannot be read.")
            return
        if message is not None:
            self._num_bytes = 0
            await self._answer(message)

    async def _answer(self, message: Any) -> None:
        connection = self.connection
        document = _document_of(connection)
        if connection is None:
            return
        if document is None:
            self.close(_ENDED, "The session of this page has ended.")
            return
        refusal = self._refusal(message, document)
        if refusal:
            _log.info("refused a message: %s", refusal)
            await self.send_message(connection.error(message, refusal))
            return
        work = await self._handle(message)
        if work is not None and work.msgtype == "ERROR":
            # Where the program lies on this machine is nobody's business.
            work.content = {**work.content, "traceback": None}
        if work is not None:
            await self.send_message(work)

    def _refusal(self, message: Any, document: Document) -> str:
        """Return why a message is not taken, nothing if it is."""
        try:
            self._guard.check(message, document)
        except InputError as error:
            return str(error)
        return ""

    def on_close(self) -> None:
        """Let the connection go, also where its session has ended before it."""
        if self.connection is not None and _document_of(self.connection) is None:
            self.application.client_lost(self.connection)
            return
        super().on_close()

    def open(self, *arguments: str, **named: str) -> None:
        """Begin to send and receive."""
        self.set_nodelay(True)
        super().open(*arguments, **named)


def _document_of(connection: Any) -> Document | None:
    """Document that a connection shows; None when its session has ended."""
    try:
        document: Document = connection.session.document
    except (AssertionError, AttributeError):  # what Bokeh 3.9 makes of no session
        return None
    return document


class OwnSessionHandler(DocHandler):
    """A page that always gets a session of its own.

    Whoever could name the session in an address that another person opens would share that
    person's page.
    """

    def set_default_headers(self) -> None:
        """Say which pages may show this one in a frame."""
        super().set_default_headers()
        policy = self.settings["access"].frame_policy
        self.set_header("Content-Security-Policy", policy)
        self.set_header("Referrer-Policy", "same-origin")
        self.set_header("X-Content-Type-Options", "nosniff")

    async def get(self, *arguments: Any, **named: Any) -> None:
        """Answer with the beginning of the page at once, and with the rest once it is built."""
        opening, registry = self.settings["opening"], self.settings["registry"]
        route = self.request.path.removeprefix(self.application.prefix) or "/"
        query = {
            key: each[-1].decode(errors="replace")
            for key, each in self.request.query_arguments.items()
        }
        first = registry.first_picture(route, query)
        self.set_header("Content-Type", "text/html")
        self.set_header("Cache-Control", "no-store")
        # The setting of Tornado for this would pack parts of files, too, as if they were whole.
        self._transforms.append(GZipContentEncoding(self.request))
        self.write(opening.beginning(route, query.get("theme", ""), first))
        await self.flush()
        self._has_begun = True
        answer = super().get(*arguments, **named)
        if answer is not None:
            await answer

    _has_begun = False

    def write(self, chunk: Any) -> None:
        """Write a part of the answer; of a whole page what follows its beginning."""
        if self._has_begun and isinstance(chunk, str):
            route = self.request.path.removeprefix(self.application.prefix) or "/"
            chunk = self.settings["opening"].rest(route, chunk)
        super().write(chunk)

    async def prepare(self) -> None:
        """Refuse a request that names a session, or whose query Panel cannot read (1.9: `x=²`)."""
        named = [name for name in _FOREIGN if name in self.request.arguments]
        if named or "Bokeh-Session-Id" in self.request.headers:
            raise HTTPError(403, reason="A page cannot join the session of another.")
        try:
            parse_query(f"?{self.request.query}")
        except ValueError:
            raise HTTPError(400, reason="The query of the address cannot be read.") from None
        await super().prepare()


class LoadedOnlyHandler(ComponentResourceHandler):
    """Files of components whose module is loaded; Panel's own handler imports any module."""

    def parse_url_path(self, url_path: str) -> str:
        """Return the path of a file, by module, class and attribute."""
        module = url_path.partition("/")[0]
        if module.partition(".")[0] not in _SERVED or module not in sys.modules:
            raise HTTPError(404)
        path: str = super().parse_url_path(url_path)
        return path


COMPONENT_ROUTE = (r"/components/(.*)", LoadedOnlyHandler)


def replace_handlers() -> None:
    """Let all servers made from now on have these handlers, and no route that no page uses."""
    per_app_patterns[:] = [(r"/ws", PromptHandler), (r"/?", OwnSessionHandler)]


def leave_busy_state(page: Any) -> None:
    """Let a page (of panel-material-ui) follow no longer whether the server is busy.

    Every page would be told whenever anybody's event is at work, and look through all its models
    each time: tens of milliseconds a page. A value alone would end that, but param goes on to watch
    what was followed, and so the server's state would hold every page for good.
    """
    page.param._update_ref("busy", False)
    with edit_readonly(page):
        page.busy = False


def begin_busy_check(loop: Any) -> None:
    """Begin what looks every ten seconds whether the server is still busy; Panel does so only once.

    By itself it begins with the first event of the first page, whose document it holds for good.
    """
    loop.add_callback(pn.state._schedule_busy_cleanup)


def release_notifications(document: Document) -> None:
    """Let the notifications of a document go with it.

    Panel looks for them when a session has ended, but has forgotten by then whose they were; their
    entry among all views would hold document and page for good.
    """
    document.on_session_destroyed(partial(_release, pn.state.notifications))


def _release(notifications: Any, _: Any) -> None:
    for reference, (model, _) in tuple(notifications._models.items()):
        notifications._cleanup(model)
        pn.state._views.pop(reference, None)
