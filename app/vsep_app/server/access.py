"""Rules of entry: the owner's token, the room's code, and the names by which a server is asked."""

import hmac
import ipaddress
import re
import secrets
import socket
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from enum import Enum
from urllib.parse import urlsplit

from tornado.httputil import HTTPServerRequest

from vsep.errors import InputError

# Without vowels, which make words, and without what looks alike: 0 O Q, 1 I L, 2 Z, 5 S, 6 G, 8 B,
# U V.
CODE_LETTERS = "CDFHJKMNPRTWXY3479"
CODE_LENGTH = 6
# Wrong codes of one address: so many at once, and one more whenever this time has passed. A class
# behind one proxy has one address.
MOST_WRONG = 30
FORGIVEN_EVERY_S = 30.0
_LEAST_TOKEN = 16
_TOKEN = rf"[\w.~-]{{{_LEAST_TOKEN},}}"
# An address of a server with a name of its own is one of these, or the machine's.
_LOOPBACK_NAMES = ("localhost",)


class Role(Enum):
    """What a visitor may do."""

    OWNER = "owner"  #: Started the server: may name folders on its disk.
    VISITOR = "visitor"


@dataclass(frozen=True, kw_only=True)
class EntryRules:
    """Who gets into a server.

    Parameters
    ----------
    token : str or None
        Makes its bearer the owner; None draws one.
    with_code : bool
        Whether a short code lets visitors in.
    open_to_all : bool
        Whether visitors need nothing.
    origins : sequence of str
        Further names of the server as they stand in a browser, ``HOST`` or ``HOST:PORT``.
    frame_ancestors : sequence of str
        Origins whose pages may show those of the server in a frame.

    Raises
    ------
    InputError
        If a token is too short, or a name is none.
    """

    token: str | None = field(default=None, repr=False)
    with_code: bool = False
    open_to_all: bool = False
    origins: Sequence[str] = ()
    frame_ancestors: Sequence[str] = ()

    def __post_init__(self) -> None:
        if self.token is not None and not re.fullmatch(_TOKEN, self.token):
            raise InputError(
                f"The token has {len(self.token)} characters; it must have {_LEAST_TOKEN} or more: "
                "letters, digits, '-', '.', '_' and '~'."
            )
        for origin in self.origins:
            if not re.fullmatch(r"(\[[0-9A-Fa-f:]+\]|[\w.-]+)(:\d{1,5})?", origin):
                raise InputError(f"The origin is {origin!r}; it must be HOST or HOST:PORT.")
        for origin in self.frame_ancestors:
            if not re.fullmatch(r"https?://(\[[0-9A-Fa-f:]+\]|[\w.*-]+)(:\d{1,5})?", origin):
                raise InputError(
                    f"The page around a frame is {origin!r}; it must be http://HOST[:PORT] or "
                    "https://HOST[:PORT]."
                )


class Access:
    """What a running server knows of who may enter.

    Parameters
    ----------
    rules : EntryRules
        Who gets in.
    port : int
        Where the server listens.
    clock : callable
        Seconds that never go back.
    """

    def __init__(
        self, rules: EntryRules, *, port: int, clock: Callable[[], float] = time.monotonic
    ) -> None:
        self.rules, self.port = rules, port
        self.token = rules.token or secrets.token_urlsafe(32)
        self.code = draw_code() if rules.with_code else None
        self._wrong = WrongCodes(clock)
        self._cookies = {role: secrets.token_urlsafe(32) for role in Role}
        host = socket.gethostname().lower()
        self._names = {*_LOOPBACK_NAMES, host, f"{host}.local", socket.getfqdn().lower()}
        self._origins = {origin.lower() for origin in rules.origins}

    def is_known(self, host: str) -> bool:
        """Whether the server may be asked by a name, that of the header ``Host``.

        A page of a stranger reaches this machine by a name that its author made point here; a bare
        address cannot be made to. The port is that of a tunnel, if there is one.
        """
        host = host.lower()
        name = _place(f"//{host}")[1]
        return host in self._origins or name in self._names or _is_address(name)

    def is_own(self, origin: str, host: str) -> bool:
        """Whether a page of an origin is one of this server, which it asked by the name `host`."""
        place = _place(origin.lower())[0]
        return bool(place) and (place == host.lower() or place in self._origins)

    def role(self, request: HTTPServerRequest) -> Role | None:
        """Return the role of who sends a request by its cookie; None without any."""
        held = request.cookies.get(self.cookie_name(request.host))
        for role, secret in self._cookies.items():
            if held is not None and _is_same(held.value, secret):
                return role
        return Role.VISITOR if self.rules.open_to_all else None

    def role_of_token(self, token: str, address: str) -> Role | None:
        """Return the role of who brings a token or a code, from a network address.

        Raises `InputError` once too many wrong codes have come from there.
        """
        if _is_same(token.strip(), self.token):
            return Role.OWNER
        if self.code is not None:
            self._wrong.require_some_left(address)
            if _is_same(re.sub(r"[\s-]", "", token).upper(), self.code):
                return Role.VISITOR
            self._wrong.count(address)
        return None

    def cookie_name(self, host: str) -> str:
        """Return the name of the cookie, one for each server that a browser calls by a name.

        Cookies know no ports; two tunnels lead to two servers of one port.
        """
        return re.sub(r"[^0-9A-Za-z]", "-", f"vsep-{self.port}-{host.lower()}")

    def cookie(self, role: Role, host: str) -> str:
        """Return the header that lets a browser keep its role until it is closed.

        It holds for the folder of the page, which only the browser knows behind a proxy.
        """
        return f"{self.cookie_name(host)}={self._cookies[role]}; HttpOnly; {self._scope}"

    def person_cookie_name(self, host: str) -> str:
        """Return the name of the cookie that says who sits at a browser; it opens nothing."""
        return f"{self.cookie_name(host)}-person"

    def person_cookie(self, value: str, host: str) -> str:
        """Return the header that lets a browser keep that until it is closed."""
        return f"{self.person_cookie_name(host)}={value}; HttpOnly; {self._scope}"

    @property
    def _scope(self) -> str:
        crosses = any(each.startswith("https://") for each in self.rules.frame_ancestors)
        return "SameSite=None; Secure; Partitioned" if crosses else "SameSite=Lax"

    @property
    def frame_policy(self) -> str:
        """Which pages may show those of the server in a frame."""
        return " ".join(["frame-ancestors", "'self'", *self.rules.frame_ancestors])


class WrongCodes:
    """Counts wrong codes by network address, and forgives one every `FORGIVEN_EVERY_S`."""

    def __init__(self, clock: Callable[[], float]) -> None:
        self._clock = clock
        # When the last wrong code of an address is forgiven.
        self._until: dict[str, float] = {}

    def require_some_left(self, address: str) -> None:
        """Raise `InputError` if an address has to wait."""
        wait_s = self._until.get(_network(address), 0.0) - self._clock()
        wait_s -= (MOST_WRONG - 1) * FORGIVEN_EVERY_S
        if wait_s > 0.0:
            raise InputError(
                f"Too many wrong codes came from your address; try again in {wait_s:.0f} seconds."
            )

    def count(self, address: str) -> None:
        """Take note of a wrong code."""
        now, network = self._clock(), _network(address)
        self._until = {each: until for each, until in self._until.items() if until > now}
        self._until[network] = max(now, self._until.get(network, now)) + FORGIVEN_EVERY_S


def draw_code() -> str:
    """Return a code that can be read from a wall."""
    return "".join(secrets.choice(CODE_LETTERS) for _ in range(CODE_LENGTH))


def _network(address: str) -> str:
    """Return who has an address: of the sixth version of the protocol, whoever has its half."""
    try:
        parsed = ipaddress.ip_address(address)
    except ValueError:
        return address
    if parsed.version == 6:
        return str(ipaddress.ip_network((parsed, 64), strict=False))
    return address


def _place(address: str) -> tuple[str, str]:
    """Return the host of an address with its port, and without; of what is no address, nothing."""
    try:
        parts = urlsplit(address)
        return parts.netloc, parts.hostname or ""
    except ValueError:
        return "", ""


def _is_address(name: str) -> bool:
    try:
        ipaddress.ip_address(name)
    except ValueError:
        return False
    return True


def _is_same(given: str, secret: str) -> bool:
    """Whether two texts are equal, told in a time that does not depend on where they differ."""
    return hmac.compare_digest(given.encode(errors="replace"), secret.encode())
