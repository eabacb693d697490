import asyncio
import socket

import pytest
from tornado.websocket import WebSocketClosedError
from vsep_app.server.main import _closed_pages_are_no_error, make_server

from vsep.errors import InputError


@pytest.mark.parametrize("port", [-1, 65536])
def test_a_port_that_is_none_is_one_sentence(port):
    with pytest.raises(InputError, match="between 0 and 65535"):
        make_server(port=port, address="127.0.0.1")


def test_a_port_in_use_is_one_sentence():
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = taken.getsockname()[1]
        with pytest.raises(InputError, match=f"Port {port} on 127.0.0.1 cannot be used"):
            make_server(port=port, address="127.0.0.1")


def test_an_address_that_is_none_is_one_sentence():
    with pytest.raises(InputError, match="cannot be used"):
        make_server(port=0, address="999.1.2.3")


def test_only_a_closed_page_is_kept_from_the_log(caplog):
    loop = asyncio.new_event_loop()
    try:
        _closed_pages_are_no_error(loop, {"message": "m", "exception": WebSocketClosedError()})
        assert caplog.records == []
        _closed_pages_are_no_error(loop, {"message": "m", "exception": ValueError("odd")})
        assert "odd" in caplog.text
    finally:
        loop.close()
