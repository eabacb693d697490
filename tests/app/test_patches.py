"""What is changed of Bokeh and Panel: it works, and Bokeh and Panel as they are still need it."""

import asyncio
import json
import re
import subprocess
import sys
import urllib.error
import urllib.parse
import urllib.request
from types import SimpleNamespace

import panel as pn
import panel_material_ui as pmu
import pytest
from bokeh.server.views.ws import WSHandler
from bokeh.util.token import generate_jwt_token, generate_session_id, get_session_id
from panel.io.server import ComponentResourceHandler
from panel.util.parameters import edit_readonly
from tornado.web import HTTPError
from vsep_app.pages import PAGES
from vsep_app.server.patches import (
    LoadedOnlyHandler,
    PromptHandler,
    leave_busy_state,
)

IMPORTED = "wsgiref.simple_server"  # of the standard library, and of no use here


def test_bokeh_lets_small_messages_wait():
    """The day it does no longer, `PromptHandler` is not needed."""
    told = []
    handler = SimpleNamespace(set_nodelay=told.append)
    assert "set_nodelay" not in WSHandler.open.__code__.co_names
    with pytest.raises((AttributeError, TypeError)):
        PromptHandler.open(handler)
    assert told == [True]


def component_path(handler_class, path):
    return handler_class.parse_url_path(
        SimpleNamespace(_resource_attrs=ComponentResourceHandler._resource_attrs)
        if handler_class is ComponentResourceHandler
        else handler_class.__new__(handler_class),
        path,
    )


def test_panel_imports_what_an_address_names():
    """The day it does no longer, `LoadedOnlyHandler` is not needed."""
    script = (
        "import sys\n"
        "from types import SimpleNamespace\n"
        "from panel.io.server import ComponentResourceHandler as Handler\n"
        f"assert {IMPORTED!r} not in sys.modules\n"
        "try:\n"
        f"    Handler.parse_url_path(Handler.__new__(Handler), '{IMPORTED}/a/_css/b')\n"
        "except Exception as error:\n"
        "    print(type(error).__name__)\n"
        f"print({IMPORTED!r} in sys.modules)\n"
    )
    told = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, timeout=60, check=False
    )
    assert told.stdout.split() == ["HTTPError", "True"]


@pytest.mark.parametrize(
    "module",
    ["unittest.__main__", "sys", "os", "panel.command.serve", "vsep_app.cli.entry", "vsep", ""],
)
def test_no_module_is_imported_by_address(module):
    before = set(sys.modules)
    with pytest.raises(HTTPError) as refused:
        component_path(LoadedOnlyHandler, f"{module}/a/_css/b")
    assert refused.value.status_code == 404
    assert {name for name in set(sys.modules) - before if name == module} == set()


# The served program, over the loopback interface.


def get(server, path, **headers):
    """Return status and text of a page."""
    request = urllib.request.Request(f"http://127.0.0.1:{server.port}{path}", headers=headers)
    try:
        with urllib.request.urlopen(request, timeout=60) as answer:
            return answer.status, answer.read().decode()
    except urllib.error.HTTPError as error:
        with error:
            return error.code, error.read().decode()


def token_of(text):
    return re.search(r'"token":"([^"]+)"', text).group(1)


def test_an_address_that_names_a_module_leaves_the_server_alive(app_server):
    for path in ("unittest.__main__/a/_css/b", "unittest.__main__", "panel/config/_css/../../x"):
        status, _ = get(app_server, f"/components/{path}")
        assert status in (400, 403, 404)
    assert "unittest.__main__" not in sys.modules
    assert json.loads(get(app_server, "/health")[1])["pages"] >= 0


class EndedConnection:
    """What Bokeh leaves of a connection whose session has ended: it asserts that there is one."""

    def __init__(self):
        self.closed, self.lost = [], []

    @property
    def session(self):
        raise AssertionError

    @property
    def handler(self):
        return SimpleNamespace(
            connection=self,
            application=SimpleNamespace(client_lost=self.lost.append),
            close=lambda code, _: self.closed.append(code),
        )


def test_a_message_after_its_session_closes_the_connection():
    connection = EndedConnection()
    asyncio.run(PromptHandler._answer(connection.handler, SimpleNamespace()))
    assert connection.closed == [1001]  # going away, RFC 6455


def test_a_connection_is_let_go_that_outlived_its_session():
    connection = EndedConnection()
    with pytest.raises(AssertionError):  # as Bokeh has it
        WSHandler.on_close(
            SimpleNamespace(close_code=1000, close_reason="", **vars(connection.handler))
        )
    assert connection.lost == []
    PromptHandler.on_close(connection.handler)
    assert connection.lost == [connection]


def test_every_page_has_a_signed_session_of_its_own(app_server):
    texts = [get(app_server, "/studies")[1] for _ in range(2)]
    first, second = (get_session_id(token_of(text)) for text in texts)
    assert first != second
    assert "." in first  # the id and its signature


@pytest.mark.parametrize("route", ["/", "/studies"])
def test_nobody_joins_a_session_by_its_id(app_server, route):
    token = token_of(get(app_server, route)[1])
    for name, value in (
        ("bokeh-session-id", "mine"),
        ("bokeh-session-id", generate_session_id(secret_key=b"guessed", signed=True)),
        ("bokeh-session-id", get_session_id(token)),
        ("bokeh-token", token),
    ):
        assert get(app_server, f"{route}?{name}={urllib.parse.quote(value)}")[0] == 403
    assert get(app_server, route, **{"Bokeh-Session-Id": get_session_id(token)})[0] == 403


@pytest.mark.parametrize("route", ["/autoload.js?bokeh-autoload-element=1", "/metadata"])
def test_routes_that_no_page_uses_are_not_there(app_server, route):
    assert get(app_server, route)[0] == 404


def first_message(server, token):
    """Return what a connection gets, nothing if it is closed before."""
    from tornado.httpclient import HTTPRequest
    from tornado.websocket import websocket_connect

    async def connect():
        request = HTTPRequest(f"ws://127.0.0.1:{server.port}/studies/ws")
        connection = await websocket_connect(request, subprotocols=["bokeh", token])
        message = await asyncio.wait_for(connection.read_message(), 20)
        connection.close()
        # Nothing of it is left for the garbage collector once the server has answered.
        last = message
        while last is not None:
            last = await asyncio.wait_for(connection.read_message(), 20)
        return message

    return asyncio.run(connect())


@pytest.mark.parametrize("kind", ["unsigned", "signed by another", "own"])
def test_a_connection_needs_a_token_of_this_server(app_server, kind):
    """A web socket that comes with a foreign token is closed before it gets a message."""
    token = {
        "unsigned": lambda: generate_jwt_token("mine", signed=False),
        "signed by another": lambda: generate_jwt_token(
            generate_session_id(secret_key=b"other", signed=True), secret_key=b"other", signed=True
        ),
        "own": lambda: token_of(get(app_server, "/studies")[1]),
    }[kind]()

    message = first_message(app_server, token)
    assert (message is not None) == (kind == "own")


def test_a_connection_whose_page_cannot_be_built_is_closed(app_server, monkeypatch, caplog):
    """As while there are too few descriptors: its browser would wait for ever."""

    def refuse(*_):
        raise OSError("too many open files")

    monkeypatch.setattr("panel.io.application.Application.initialize_document", refuse)
    key = app_server._tornado.secret_key
    session = generate_session_id(secret_key=key, signed=True)
    token = generate_jwt_token(session, secret_key=key, signed=True)
    assert first_message(app_server, token) is None
    assert "a page could not be opened" in caplog.text


@pytest.mark.parametrize("query", ["x=%C2%B2", "preset=[1]&seed={&snr=%F0%9F%98%80&wind=[]"])
@pytest.mark.parametrize("route", [page.route for page in PAGES.values()])
def test_no_query_breaks_a_page(app_server, caplog, route, query):
    """Panel 1.9 cannot read a digit that is none of ours: that is told."""
    status, text = get(app_server, f"{route}?{query}")
    assert (status == 200 and token_of(text)) or (status == 400 and "query" in text)
    assert [record for record in caplog.records if record.exc_info] == []


def is_watched_by(page):
    """Whether the server's state holds a page."""
    watchers = pn.state.param.watchers["busy"]["value"]
    return page in [getattr(getattr(one.fn, "__self__", None), "self", None) for one in watchers]


def test_the_busy_state_holds_no_page():
    page = pmu.Page()
    with edit_readonly(page):
        page.busy = False
    assert is_watched_by(page)
    leave_busy_state(page)
    assert not is_watched_by(page)
    assert page.busy is False
