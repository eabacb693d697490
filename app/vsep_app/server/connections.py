"""Bounds of connections: how many there are, how large a request is, how long it may take."""

import errno
import socket
from functools import partial
from typing import Any

from tornado.ioloop import IOLoop

# A request is a line, its headers and, when a token is typed, a few bytes: all of it has arrived
# within this time, and so long a connection may be idle.
REQUEST_S = 20.0
HTTP_BOUNDS = {
    "idle_connection_timeout": REQUEST_S,
    "body_timeout": REQUEST_S,
    "max_header_size": 32 * 2**10,
    "max_body_size": 8 * 2**10,
}
# The system gives the lowest descriptor that is free. Of the usual 1024 these are for connections,
# the others for workers and files.
MOST_DESCRIPTORS = 700
# Nothing is accepted for so long after the system had no descriptor or memory for it.
BREATH_S = 1.0
_STARVED = (errno.EMFILE, errno.ENFILE, errno.ENOBUFS, errno.ENOMEM)


def bound_connections(server: Any) -> None:
    """Let a server accept connections only while there are descriptors for them.

    Tornado is told of a connection that it cannot accept again at once, for ever.
    """
    http, loop = server._http, server.io_loop
    for fileno, listening in http._sockets.items():
        http._handlers.pop(fileno)()
        _listen(loop, listening, http._handle_connection)
        http._handlers[fileno] = partial(loop.remove_handler, listening)


def _listen(loop: IOLoop, listening: socket.socket, take: Any) -> None:
    if listening.fileno() >= 0:
        loop.add_handler(listening, partial(_accept, loop, take), IOLoop.READ)


def _accept(loop: IOLoop, take: Any, listening: socket.socket, _: int) -> None:
    try:
        connection, address = listening.accept()
    except (BlockingIOError, ConnectionAbortedError):
        return
    except OSError as error:
        if error.errno not in _STARVED:
            raise
        loop.remove_handler(listening)
        loop.call_later(BREATH_S, _listen, loop, listening, take)
        return
    if connection.fileno() < MOST_DESCRIPTORS:
        take(connection, address)
    else:
        connection.close()
