"""A client of the served dashboard that is no browser: plain requests, parts of messages."""

import asyncio
import http.client
import json
import re
from contextlib import asynccontextmanager
from urllib.parse import urlencode

from tornado.httpclient import HTTPRequest
from tornado.websocket import websocket_connect

PATIENCE_S = 15


class Answer:
    """What a server answers: `status`, `headers` and `text`."""

    def __init__(self, response):
        self.status, self.headers = response.status, response.headers
        self.text = response.read().decode(errors="replace")

    @property
    def cookie(self):
        return self.headers["Set-Cookie"].partition(";")[0]

    @property
    def token(self):
        """What a page connects with."""
        return re.search(r'"token":"([^"]+)"', self.text).group(1)


def ask(port, path="/", *, form=None, method=None, **headers):
    """Send one request, follow nothing."""
    connection = http.client.HTTPConnection("127.0.0.1", port, timeout=PATIENCE_S)
    named = {name.replace("_", "-"): value for name, value in headers.items()}
    body = None
    if form is not None:
        body, named["Content-Type"] = urlencode(form), "application/x-www-form-urlencoded"
    try:
        connection.request(method or ("GET" if form is None else "POST"), path, body, named)
        return Answer(connection.getresponse())
    finally:
        connection.close()


@asynccontextmanager
async def connected(port, token, path="/studies/ws", **headers):
    """Open a connection of a page; leave when both sides have closed it."""
    request = HTTPRequest(f"ws://127.0.0.1:{port}{path}", headers=headers)
    connection = await websocket_connect(
        request, subprotocols=["bokeh", token], max_message_size=2**26
    )
    try:
        yield connection
    finally:
        connection.close()
        await ended(connection)


async def send(connection, kind, content, *buffers):
    """Send a message; return the first answer to it, as its kind and its content."""
    header = {"msgid": "1", "msgtype": kind, **({"num_buffers": len(buffers)} if buffers else {})}
    for part in (header, {}, content):
        await connection.write_message(json.dumps(part))
    for number, buffer in enumerate(buffers):
        await connection.write_message(json.dumps({"id": str(number)}))
        await connection.write_message(buffer, binary=True)
    while True:
        header, content = await receive(connection)
        if header.get("reqid") == "1":
            return header["msgtype"], content


async def receive(connection):
    """Return the header and the content of the next message."""
    parts = [await _part(connection) for _ in range(3)]
    header, _, content = map(json.loads, parts)
    for _ in range(2 * header.get("num_buffers", 0)):
        await _part(connection)
    return header, content


async def ended(connection):
    """Wait until the server has ended a connection; it says so once."""
    while not getattr(connection, "has_ended", False):
        connection.has_ended = await connection.read_message() is None


async def _part(connection):
    part = await asyncio.wait_for(connection.read_message(), PATIENCE_S)
    if part is None:
        connection.has_ended = True
        raise ConnectionError(connection.close_reason or "closed")
    return part


def change(model, name, value):
    """Return a message that sets something of a model."""
    event = {"kind": "ModelChanged", "model": {"id": model}, "attr": name, "new": value}
    return {"events": [event]}
