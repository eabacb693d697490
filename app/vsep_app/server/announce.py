"""Announcement of a server to whoever starts it: addresses, token, code of the room."""

import atexit
import os
import socket
import tempfile
import webbrowser
from pathlib import Path
from typing import Any

from vsep_app.server.access import CODE_LETTERS, Access

_EVERYWHERE = ("0.0.0.0", "::")
# No packet is sent: the system only says from which address it would go there (RFC 5737).
_ELSEWHERE = ("192.0.2.1", 9)
# Each letter of a code in five rows of five places, a byte a row.
_GLYPHS = dict(
    zip(
        CODE_LETTERS,
        (
            *("0f1010100f", "1e1111111e", "1f101e1010", "11111f1111", "1f0202120c", "11121c1211"),
            *("111b151111", "1119151311", "1e111e1010", "1e111e1211", "1f04040404", "1111151b11"),
            *("110a040a11", "110a040404", "1e010e011e", "11111f0101", "1f02040808", "0e110f010e"),
        ),
        strict=True,
    )
)
# A browser has read the page that leads it to the server within this time.
_READ_S = 30.0
_PAGE = '<!doctype html><meta http-equiv="refresh" content="0; url={}"><title>vsep</title>'


def announcement(access: Access, *, address: str, prefix: str, leads: bool = False) -> str:
    """Return what is printed once the server listens; whether its owner `leads` a room."""
    place = base_address(address, access.port, prefix)
    lines = []
    if access.rules.open_to_all:
        lines += [
            "vsep: WARNING: whoever reaches this address gets in, without any token:",
            f"  {place}",
        ]
    if access.rules.token is None:
        lines += ["vsep: for you, who may name folders of this machine:"]
        lines += [f"  {place}?token={access.token}"]
        if leads:
            lines += ["vsep: to lead the room:", f"  {place}lead?token={access.token}"]
    else:
        lines += [f"vsep: {place} with the token of VSEP_TOKEN"]
    if access.code is not None:
        lines += [f"vsep: for the room, {place} and the code {access.code}", ""]
        lines += [*large_letters(access.code), ""]
    return "\n".join(lines) + "\n"


def base_address(address: str, port: int, prefix: str) -> str:
    """Return where a browser finds the server that listens on an address."""
    host = _own_address() if address in _EVERYWHERE else address
    return f"http://{f'[{host}]' if ':' in host else host}:{port}{prefix}/"


def large_letters(code: str) -> list[str]:
    """Return the rows of a code in letters that can be read from afar."""
    rows = zip(*(bytes.fromhex(_GLYPHS[letter]) for letter in code), strict=True)
    return ["  " + "   ".join(_row(bits) for bits in row) for row in rows]


def _row(bits: int) -> str:
    return "".join("██" if bits >> place & 1 else "  " for place in reversed(range(5)))


def open_browser(place: str, loop: Any) -> None:
    """Open an address that holds a token in the browser.

    All users of a machine can see how programs were called, so the browser is called with a file
    that only its owner can read. Browsers in containers read the visible files of the home folder,
    and no temporary ones.
    """
    home = Path.home()
    folder = home if os.access(home, os.W_OK) else None
    number, name = tempfile.mkstemp(".html", "vsep-", folder)
    with os.fdopen(number, "w", encoding="utf-8") as file:
        file.write(_PAGE.format(place))
    atexit.register(Path(name).unlink, missing_ok=True)
    loop.call_later(_READ_S, Path(name).unlink, missing_ok=True)
    webbrowser.open(Path(name).as_uri())


def _own_address() -> str:
    """Return the address by which others reach this machine."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.connect(_ELSEWHERE)
        except OSError:
            return socket.gethostname()
        return str(probe.getsockname()[0])
