"""The server as people reach it: its routes, and proxies that keep or drop name and folder."""

import asyncio
import contextlib
import re
import threading
from dataclasses import dataclass
from pathlib import Path
from urllib.parse import urljoin

import pytest
from tornado.httpclient import AsyncHTTPClient, HTTPRequest
from tornado.httpserver import HTTPServer
from tornado.ioloop import IOLoop
from tornado.netutil import bind_sockets
from tornado.web import Application, RequestHandler
from tornado.websocket import WebSocketHandler, websocket_connect
from vsep_app.pages import APART, LEAD, PAGES
from vsep_app.server.access import EntryRules

from tests.app.conftest import served
from tests.app.raw_client import ask, connected, receive

TOKEN = "a-token-of-the-test"
SECURITY = Path(__file__).parents[2] / ".github" / "SECURITY.md"
NAME = "lab.example.org"


def routes(server):
    """The patterns of a server, as a person writes them."""
    for rule in server._tornado.wildcard_router.rules:
        text = rule.matcher.regex.pattern.rstrip("$").replace("(?!extensions/)", "")
        text = text.removesuffix("/?") or "/"
        first = f"/{text.split('/')[1]}"
        if first in {page.route for page in (PAGES | APART).values()} and text.count("/") > 1:
            text = text.replace(first, "PAGE", 1)
        yield "PAGE/ws" if text == "/ws" else text.replace("(.*)", "…")


def test_every_route_is_in_the_table_of_the_security_document(app_server):
    table = SECURITY.read_text(encoding="utf-8").partition("| route |")[2].partition("\n\n")[0]
    cells = [row.split("|")[1] for row in table.splitlines()[2:]]
    # That of the lecturer is there with a class alone.
    assert {*routes(app_server), LEAD.route} == {
        name for cell in cells for name in re.findall("`(.*?)`", cell)
    }


def test_a_port_that_is_drawn_is_the_one_that_is_known(app_server):
    assert app_server.access.port == app_server.port != 0
    assert ask(app_server.port, "/health").status == 200


@dataclass(frozen=True, kw_only=True)
class Upstream:
    """What a proxy stands in front of, and what it keeps of a request."""

    port: int
    folder: str = ""
    keeps_folder: bool = True
    keeps_name: bool = True

    def place(self, request):
        path = request.uri if self.keeps_folder else request.uri.removeprefix(self.folder)
        return f"127.0.0.1:{self.port}{path}"

    def headers(self, request):
        name = {} if self.keeps_name else {"Host": f"127.0.0.1:{self.port}"}
        return {**request.headers, **name}


class Pass(RequestHandler):
    """Passes requests on, and answers back."""

    def initialize(self, upstream):
        self._upstream = upstream

    async def get(self):
        asked = HTTPRequest(
            f"http://{self._upstream.place(self.request)}",
            self.request.method,
            self._upstream.headers(self.request),
            self.request.body or None,
            follow_redirects=False,
            decompress_response=False,
        )
        answer = await AsyncHTTPClient().fetch(asked, raise_error=False)
        self.set_status(answer.code)
        for name, value in answer.headers.get_all():
            if name not in ("Content-Length", "Transfer-Encoding", "Connection"):
                self.add_header(name, value)
        self.write(answer.body)

    post = get


class PassConnection(WebSocketHandler):
    """Passes the messages of a connection on and back."""

    def initialize(self, upstream):
        self._upstream = upstream

    def check_origin(self, origin):
        return bool(origin)

    def select_subprotocol(self, subprotocols):
        self.offered = subprotocols
        return subprotocols[0]

    async def open(self):
        headers = self._upstream.headers(self.request)
        kept = {key: headers[key] for key in ("Host", "Origin", "Cookie") if key in headers}
        asked = HTTPRequest(f"ws://{self._upstream.place(self.request)}", headers=kept)
        self.there = await websocket_connect(
            asked, subprotocols=self.offered, on_message_callback=self.pass_back
        )

    def pass_back(self, message):
        if message is None:
            self.close()
        else:
            self.write_message(message, binary=isinstance(message, bytes))

    def on_close(self):
        self.there.close()


@contextlib.contextmanager
def proxied(upstream):
    """Run a proxy in a thread, as nginx does it; yield its port."""
    ready, box = threading.Event(), {}

    def run():
        asyncio.set_event_loop(asyncio.new_event_loop())
        (listening,) = bind_sockets(0, "127.0.0.1")
        told = {"upstream": upstream}
        handlers = Application([(".*/ws", PassConnection, told), (".*", Pass, told)])
        box.update(loop=IOLoop.current(), port=listening.getsockname()[1])
        box["server"] = HTTPServer(handlers)
        box["server"].add_socket(listening)
        box["loop"].add_callback(ready.set)
        box["loop"].start()
        box["loop"].close()

    thread = threading.Thread(target=run, daemon=True)
    thread.start()
    assert ready.wait(20)
    yield box["port"]

    async def leave():
        box["server"].stop()
        await box["server"].close_all_connections()
        await asyncio.sleep(0.1)
        box["loop"].stop()

    box["loop"].add_callback(leave)
    thread.join(10)


@pytest.fixture(scope="module")
def server():
    with served(entry=EntryRules(token=TOKEN, origins=(NAME,)), prefix="tools/vsep") as server:
        yield server


@pytest.fixture(scope="module")
def at_the_root():
    with served(entry=EntryRules(token=TOKEN, origins=(NAME,))) as server:
        yield server


@pytest.mark.parametrize(
    ("which", "options"),
    [
        ("server", {}),
        ("server", {"keeps_name": False}),
        ("at_the_root", {"keeps_folder": False}),
        ("at_the_root", {"keeps_folder": False, "keeps_name": False}),
    ],
)
def test_a_proxy_may_keep_or_drop_name_and_folder(request, which, options):
    """Enter by the form, follow the redirection, load a script, connect: as a browser does it."""
    behind = request.getfixturevalue(which)
    place, own = "/tools/vsep/studies", {"Host": NAME, "Origin": f"https://{NAME}"}
    with proxied(Upstream(port=behind.port, folder="/tools/vsep", **options)) as port:
        assert ask(port, place, Host=NAME).status == 401
        entered = ask(port, f"{place}?seed=2", form={"token": TOKEN}, **own)
        assert urljoin(place, entered.headers["Location"]) == f"{place}?seed=2"
        page = ask(port, place, Host=NAME, Cookie=entered.cookie)
        assert page.status == 200
        script = re.search(r'src="([^"]*bokeh.min.js[^"]*)"', page.text).group(1)
        script = urljoin(place, script)
        assert ask(port, script, Host=NAME, Cookie=entered.cookie).status == 200
        foreign = ask(port, place, Host=NAME, Cookie=entered.cookie, Origin="https://evil.example")
        assert foreign.status == 403

        async def greeting():
            headers = {**own, "Cookie": entered.cookie}
            async with connected(port, page.token, f"{place}/ws", **headers) as connection:
                return (await receive(connection))[0]["msgtype"]

        assert asyncio.run(greeting()) == "ACK"


def test_a_tunnel_has_a_port_of_its_own(at_the_root):
    own = {"Host": "localhost:9000", "Origin": "http://localhost:9000"}
    entered = ask(at_the_root.port, form={"token": TOKEN}, **own)
    assert entered.status == 303
    assert ask(at_the_root.port, "/studies", Cookie=entered.cookie, **own).status == 200


def test_a_cookie_of_a_server_that_has_ended_leads_to_the_question(at_the_root):
    cookie = at_the_root.access.cookie_name(f"127.0.0.1:{at_the_root.port}")
    answer = ask(at_the_root.port, "/studies?seed=4", Cookie=f"{cookie}=of-another-start")
    assert answer.status == 401
    assert "Open the address that the server has printed" in answer.text
