"""Who gets into the served dashboard, over the loopback interface."""

import asyncio
import base64
import json
import logging
import re
import socket
import time
import zlib

import pytest
from tornado.httpclient import HTTPClientError
from vsep_app.pages import PAGES
from vsep_app.server import connections
from vsep_app.server.access import EntryRules
from vsep_app.server.sessions import ServerLimits

from tests.app.conftest import served
from tests.app.raw_client import ask, connected, receive

TOKEN = "a-token-of-the-test"
FILES = ("/static/js/bokeh.min.js", "/favicon.ico", "/components/panel.config/a/_css/b")


@pytest.fixture(scope="module")
def server():
    """A classroom's server, of three places, in a folder of a proxy's."""
    rules = EntryRules(token=TOKEN, with_code=True, origins=("lab.example.org",))
    with pytest.MonkeyPatch.context() as patch:
        patch.setitem(connections.HTTP_BOUNDS, "idle_connection_timeout", 1.0)
        patch.setitem(connections.HTTP_BOUNDS, "body_timeout", 1.0)
        with served(entry=rules, rules=ServerLimits(most_pages=3)) as server:
            yield server


@pytest.fixture(scope="module")
def owner(server):
    return ask(server.port, f"/?token={TOKEN}").cookie


@pytest.fixture(scope="module")
def visitor(server):
    return ask(server.port, form={"token": server.access.code.lower()}).cookie


def pages_opened(server):
    return server.registry.num_opened + server.registry.num_refused


def open_page(server, cookie):
    """Ask for a page until there is a place for it."""
    before, begun = server.registry.num_opened, time.monotonic()
    while server.registry.num_opened == before:
        assert time.monotonic() - begun < 15.0
        assert ask(server.port, "/studies", Cookie=cookie).status == 200


@pytest.mark.parametrize("path", [*(page.route for page in PAGES.values()), *FILES, "/nothing"])
def test_whoever_has_no_token_gets_no_page_and_no_file(server, path):
    before = pages_opened(server)
    answer = ask(server.port, path)
    assert answer.status == 401
    assert "Type the code of the room" in answer.text
    assert re.findall(r'(?:src|href|action)="(?!data:,")', answer.text) == []
    assert "default-src 'none'" in answer.headers["Content-Security-Policy"]
    assert pages_opened(server) == before


def test_health_is_for_all_and_tells_no_secrets(server):
    answer = ask(server.port, "/health")
    assert answer.status == 200
    told = json.loads(answer.text)
    assert told.pop("status") == "ok"
    assert all(isinstance(each, int | float | list | None) for each in told.values())
    assert TOKEN not in answer.text
    assert server.access.code not in answer.text


def test_a_token_leaves_the_address_and_the_log(server, caplog):
    with caplog.at_level(logging.DEBUG):
        answer = ask(server.port, f"/studies?snr=3&token={TOKEN}")
        ask(server.port, "/studies?token=wrong-one-of-the-test")
    assert (answer.status, answer.headers["Location"]) == (303, "./studies?snr=3")
    assert "HttpOnly" in answer.headers["Set-Cookie"]
    assert TOKEN not in caplog.text
    assert "wrong-one" not in caplog.text


def test_with_the_cookie_pages_files_and_connections_need_no_token(server, owner):
    page = ask(server.port, "/studies", Cookie=owner)
    assert page.status == 200
    assert ask(server.port, FILES[0], Cookie=owner).status == 200

    async def greeting(**headers):
        async with connected(server.port, page.token, **headers) as connection:
            return (await receive(connection))[0]["msgtype"]

    assert asyncio.run(greeting(Cookie=owner)) == "ACK"
    for headers in (
        {},
        {"Cookie": f"{owner}x"},
        {"Cookie": owner, "Origin": "http://evil.example"},
        {"Cookie": owner, "Host": "evil.example"},
    ):
        with pytest.raises(HTTPClientError) as refused:
            asyncio.run(greeting(**headers))
        assert refused.value.code in (401, 403)


def test_a_page_holds_neither_token_nor_cookie(server, owner):
    page = ask(server.port, "/studies", Cookie=owner)
    packed = page.token.partition(".")[0]
    told = json.loads(base64.urlsafe_b64decode(packed + "=" * (-len(packed) % 4)))
    held = zlib.decompress(base64.urlsafe_b64decode(told["__bk__zlib_"] + "===")).decode()
    for text in (page.text, held):
        assert TOKEN not in text
        assert owner.partition("=")[2] not in text
    assert page.headers["Content-Security-Policy"] == "frame-ancestors 'self'"


@pytest.mark.parametrize("who", ["owner", "visitor"])
def test_only_who_has_the_token_owns_folders(server, who, request):
    """By the loopback interface both come, as all visitors do behind a proxy."""
    cookie = request.getfixturevalue(who)
    open_page(server, cookie)
    newest = max(server.registry.open_sessions.values(), key=lambda session: session.since)
    assert newest.page.current.form.owns_folders == (who == "owner")


@pytest.mark.parametrize("headers", [{"Host": "evil.example"}, {"Origin": "http://evil.example"}])
@pytest.mark.parametrize("path", ["/", f"/?token={TOKEN}", FILES[0]])
def test_strangers_pages_are_refused_whatever_they_bring(server, owner, path, headers):
    answer = ask(server.port, path, Cookie=owner, **headers)
    assert answer.status == 403
    assert "--allow-websocket-origin evil.example" in answer.text
    assert "Set-Cookie" not in answer.headers


def test_names_are_shown_as_text(server):
    answer = ask(server.port, "/", Origin="http://<script>alert(1)</script>")
    assert answer.status == 403
    assert "<script>" not in answer.text


@pytest.mark.parametrize("form", [{"token": "CDFHJK"}, {"token": ""}, {}, {"token": "\x00²"}])
def test_a_wrong_code_is_told(server, form):
    answer = ask(server.port, "/studies", form=form)
    assert answer.status == 401
    assert ("That is not it." in answer.text) == bool(form.get("token"))


def test_a_form_of_a_strangers_page_is_refused(server):
    form = {"token": server.access.code}
    assert ask(server.port, form=form, Origin="http://evil.example").status == 403


@pytest.mark.parametrize(
    "sent", [b"", b"GET / HTTP/1.1\r\nHost: localhost\r\nX: ", b"POST / HTTP/1.1\r\n"]
)
def test_a_request_that_does_not_end_is_ended(server, sent):
    """Here within a second; the program gives it `REQUEST_S`."""
    with socket.create_connection(("127.0.0.1", server.port), 20) as half_open:
        half_open.sendall(sent)
        assert half_open.recv(1) == b""


def test_a_body_that_does_not_come_is_not_waited_for(server):
    with socket.create_connection(("127.0.0.1", server.port), 20) as half_open:
        half_open.sendall(b"POST / HTTP/1.1\r\nHost: localhost\r\nContent-Length: 100\r\n\r\n")
        assert half_open.recv(1) == b""


@pytest.mark.parametrize(
    ("name", "size"), [("max_header_size", "X: " + "x" * 40_000), ("max_body_size", "")]
)
def test_requests_have_a_largest_size(server, name, size):
    assert connections.HTTP_BOUNDS[name] < 40_000
    header = size or "Content-Length: 40000"
    request = f"POST / HTTP/1.1\r\nHost: localhost\r\n{header}\r\n\r\n"
    with socket.create_connection(("127.0.0.1", server.port), 20) as connection:
        connection.sendall(request.encode())
        assert connection.makefile("rb").readline()[9:12] in (b"", b"400", b"431", b"413")


def test_a_server_without_descriptors_takes_a_breath(server, monkeypatch, caplog):
    """Tornado would be told of the waiting connection again at once, for ever."""
    calls = []

    def starved(_):
        calls.append(time.monotonic())
        raise OSError(24, "Too many open files")

    with monkeypatch.context() as patch:
        patch.setattr(socket.socket, "accept", starved)
        with socket.create_connection(("127.0.0.1", server.port), 20) as waiting:
            waiting.sendall(b"GET /health HTTP/1.0\r\n\r\n")
            time.sleep(0.5)
            assert len(calls) == 1
            patch.undo()
            assert waiting.makefile("rb").readline().split()[1] == b"200"
    assert [record for record in caplog.records if record.levelno >= logging.ERROR] == []


def test_connections_leave_descriptors_to_others(server, monkeypatch):
    monkeypatch.setattr(connections, "MOST_DESCRIPTORS", 3)
    with socket.create_connection(("127.0.0.1", server.port), 20) as refused:
        assert refused.recv(1) == b""


def test_pages_without_a_browser_hold_no_places(server, visitor):
    """More than there are places come, none is shown, and each is made within 15 s."""
    for _ in range(4):
        open_page(server, visitor)
