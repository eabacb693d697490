"""The entry of the server: every request passes it before any page, file or connection."""

import html
import logging
from collections.abc import Sequence
from string import Template
from typing import Any
from urllib.parse import parse_qsl, urlencode

from tornado.httputil import HTTPServerRequest
from tornado.routing import Matcher, Rule
from tornado.web import Application, RequestHandler

from vsep.errors import InputError
from vsep_app.assets import path
from vsep_app.server.access import CODE_LENGTH, CODE_LETTERS, Access, Role
from vsep_app.server.lesson import MOST_NAME, new_person, person_of

_TOKEN, _NAME, _JOIN = "token", "name", "join"
_FOR_THE_OWNER = "This page is for whoever started the server: open its address with the token."
_log = logging.getLogger(__name__)


class _NotAdmitted(Matcher):
    """Matches requests that get no further; notes the role of all others.

    The state of the server is for anybody who asks: it holds no secrets.
    """

    def __init__(self, access: Access, health: str, owned: Sequence[str]) -> None:
        self._access, self._health, self._owned = access, health, owned

    def match(self, request: HTTPServerRequest) -> dict[str, Any] | None:
        """Return what the answer is made of; None lets the request in."""
        if request.path == self._health:
            return None
        try:
            require_own(self._access, request)
        except InputError as refusal:
            return {"target_kwargs": {"access": self._access, "refusal": str(refusal)}}
        role = self._access.role(request)
        if role is None or request.method == "POST" or _TOKEN in request.query_arguments:
            return {"target_kwargs": {"access": self._access}}
        if role is not Role.OWNER and self._is_owned(request.path):
            return {"target_kwargs": {"access": self._access, "refusal": _FOR_THE_OWNER}}
        held = request.cookies.get(self._access.person_cookie_name(request.host))
        request.role = role  # type: ignore[attr-defined]
        request.person = None if held is None else person_of(held.value)  # type: ignore[attr-defined]
        return None

    def _is_owned(self, path: str) -> bool:
        return any(path == owned or path.startswith(f"{owned}/") for owned in self._owned)


class EntryHandler(RequestHandler):
    """Asks for the token, or says why the request gets no further."""

    def initialize(self, access: Access, refusal: str = "") -> None:
        """Take what is known of the request."""
        self._access, self._refusal = access, refusal

    def set_default_headers(self) -> None:
        """Let nothing be kept, and nothing be fetched."""
        self.set_header("Cache-Control", "no-store")
        self.set_header("X-Content-Type-Options", "nosniff")
        self.set_header("Referrer-Policy", "same-origin")

    def get(self) -> None:
        """Answer a request without a role, or whose address holds a token."""
        self._answer(self.request.query_arguments)

    head = get

    def post(self) -> None:
        """Take what was typed."""
        self._answer(self.request.body_arguments)

    def _answer(self, arguments: dict[str, list[bytes]]) -> None:
        token = arguments.get(_TOKEN, [b""])[-1].decode(errors="replace")
        if self._refusal:
            self._write(403, self._refusal)
            return
        try:
            role = (
                self._access.role_of_token(token, self.request.remote_ip or "") if token else None
            )
        except InputError as error:
            self._write(429, str(error))
            return
        if role is not None:
            self.add_header("Set-Cookie", self._access.cookie(role, self.request.host))
            self._name_person(arguments)
        elif token or self._access.role(self.request) is None:
            told = "That is not it. " if token else ""
            self._write(401, f"{told}{self._question()}", asks=True)
            return
        # Neither the history of the browser nor a copied link holds what was in the address.
        self.set_status(303)
        self.set_header("Location", place_without_token(self.request))

    def _name_person(self, arguments: dict[str, list[bytes]]) -> None:
        """Let the browser keep who sits there; with a name, if one was typed."""
        if self._access.code is not None:
            person = new_person(arguments.get(_NAME, [b""])[-1].decode(errors="replace"))
            told = self._access.person_cookie(person.cookie, self.request.host)
            self.add_header("Set-Cookie", told)

    def _code(self) -> str:
        """Return the code that a link of the room brings; it is typed into the form."""
        code = self.get_query_argument(_JOIN, "").upper()
        is_one = len(code) == CODE_LENGTH and set(code) <= set(CODE_LETTERS)
        return code if is_one and self._access.code is not None else ""

    def _question(self) -> str:
        if self._access.code is not None:
            return "Type the code of the room, or open the address that the server has printed."
        return "Open the address that the server has printed, or type the token at its end."

    def _write(self, status: int, sentence: str, *, asks: bool = False) -> None:
        self.set_status(status)
        self.set_header(
            "Content-Security-Policy",
            "default-src 'none'; img-src data:; style-src 'unsafe-inline'; form-action 'self'; "
            + self._access.frame_policy,
        )
        label = "Code or token" if self._access.code is not None else "Token"
        page = Template(path("entry/entry.html").read_text(encoding="utf-8"))
        form = Template(path("entry/form.html").read_text(encoding="utf-8"))
        name = Template(path("entry/name.html").read_text(encoding="utf-8"))
        more = "" if self._access.code is None else name.substitute(most=MOST_NAME)
        self.finish(
            page.substitute(
                sentence=html.escape(sentence),
                form=form.substitute(label=label, code=self._code(), more=more) if asks else "",
            )
        )


def require_own(access: Access, request: HTTPServerRequest) -> None:
    """Raise `InputError` unless the server is asked by its own name, and by no page of a stranger.

    Whatever a browser sends because a page of a stranger says so, but for links that its user
    follows, has the origin of that page or says that it comes from another site.
    """
    headers = request.headers
    if not access.is_known(request.host):
        raise InputError(
            f"This server does not know the name {request.host!r}; whoever runs it can allow it by "
            f"--allow-websocket-origin {request.host}."
        )
    origin = headers.get("Origin")
    if origin is not None and not access.is_own(origin, request.host):
        raise InputError(
            f"This server does not answer pages of {origin!r}; whoever runs it can allow them by "
            f"--allow-websocket-origin {origin.partition('://')[2] or 'HOST'}."
        )
    is_foreign = headers.get("Sec-Fetch-Site", "none") in ("cross-site", "same-site")
    if origin is None and is_foreign and headers.get("Sec-Fetch-Mode") != "navigate":
        raise InputError("This server does not answer what pages of other sites fetch.")


def place_without_token(request: HTTPServerRequest) -> str:
    """Return the address of a request without its token, as seen from its own folder.

    Behind a proxy only the browser knows the whole path.
    """
    pairs = parse_qsl(request.query, keep_blank_values=True)
    query = urlencode([(key, value) for key, value in pairs if key not in (_TOKEN, _JOIN)])
    name = request.path.rpartition("/")[2]
    return f"./{name}{'?' if query else ''}{query}"


def guard_entry(
    application: Application, access: Access, health: str, owned: Sequence[str] = ()
) -> None:
    """Let no request reach an application but those that are admitted, and `health`.

    The paths `owned`, and all below them, are for the owner.
    """
    application.settings["access"] = access
    rules = application.default_router.rules
    rules.insert(0, Rule(_NotAdmitted(access, health, owned), EntryHandler))


def log_request(handler: RequestHandler) -> None:
    """Write what was answered to the log: without the query, which may hold a token."""
    level = logging.WARNING if handler.get_status() >= 500 else logging.INFO
    request = handler.request
    _log.log(level, "%d %s %s", handler.get_status(), request.method, request.path)
