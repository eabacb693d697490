"""Who gets in, without a server: names, origins, roles, and how often a code may be guessed."""

import pytest
from tornado.httputil import HTTPHeaders, HTTPServerRequest, RequestStartLine
from vsep_app.server.access import (
    CODE_LENGTH,
    CODE_LETTERS,
    FORGIVEN_EVERY_S,
    MOST_WRONG,
    Access,
    EntryRules,
    Role,
    draw_code,
)
from vsep_app.server.announce import announcement, base_address, large_letters
from vsep_app.server.entry import place_without_token, require_own

from vsep.errors import InputError

TOKEN = "a-token-of-the-test"


class Clock:
    """A clock that stands until it is set forward."""

    now_s = 1000.0

    def __call__(self):
        return self.now_s


def access(**rules):
    return Access(EntryRules(token=TOKEN, **rules), port=5006, clock=Clock())


def request(uri="/", host="localhost:5006", **headers):
    named = {name.replace("_", "-"): value for name, value in headers.items()}
    return HTTPServerRequest(
        start_line=RequestStartLine("GET", uri, "HTTP/1.1"),
        headers=HTTPHeaders({"Host": host, **named}),
    )


@pytest.mark.parametrize(
    ("host", "known"),
    [
        ("localhost:5006", True),
        ("LOCALHOST:9000", True),  # of a tunnel, whose port is another one
        ("127.0.0.1:5006", True),
        ("[::1]:5006", True),
        ("192.168.1.7:8080", True),  # no foreign name leads to a bare address
        ("lab.example.org", True),
        ("lab.example.org:81", False),  # another server of that machine
        ("evil.example", False),
        ("localhost.evil.example", False),
        ("127.0.0.1.evil.example:5006", False),
        ("evil.example@localhost", True),  # the name is what follows
        ("[::1", False),
        ("", False),
    ],
)
def test_a_server_is_asked_by_names_that_no_stranger_can_make(host, known):
    assert access(origins=("lab.example.org",)).is_known(host) == known


@pytest.mark.parametrize(
    ("origin", "host", "own"),
    [
        ("http://localhost:5006", "localhost:5006", True),
        ("http://localhost:9000", "localhost:9000", True),  # through a tunnel
        ("http://localhost:3000", "localhost:5006", False),  # what else runs on this machine
        ("http://127.0.0.1:5006", "localhost:5006", False),
        ("https://lab.example.org", "127.0.0.1:5006", True),  # a proxy that keeps no name
        ("https://evil.example", "127.0.0.1:5006", False),
        ("null", "127.0.0.1:5006", False),
        ("", "", False),
    ],
)
def test_a_page_is_own_if_it_was_asked_by_the_same_name(origin, host, own):
    assert access(origins=("lab.example.org",)).is_own(origin, host) == own


@pytest.mark.parametrize(
    ("headers", "word"),
    [
        ({"host": "evil.example"}, "--allow-websocket-origin evil.example"),
        ({"Origin": "http://evil.example"}, "--allow-websocket-origin evil.example"),
        ({"Origin": "null"}, "HOST"),
        ({"Sec_Fetch_Site": "cross-site", "Sec_Fetch_Mode": "no-cors"}, "other sites"),
        ({"Sec_Fetch_Site": "same-site", "Sec_Fetch_Mode": "no-cors"}, "other sites"),
    ],
)
def test_what_pages_of_strangers_send_is_refused_in_a_sentence(headers, word):
    with pytest.raises(InputError, match=word):
        require_own(access(), request(**headers))


def test_links_of_other_sites_can_be_followed():
    require_own(access(), request(Sec_Fetch_Site="cross-site", Sec_Fetch_Mode="navigate"))


def test_a_token_makes_an_owner_and_a_code_a_visitor():
    door = access(with_code=True)
    assert door.role_of_token(f" {TOKEN}\n", "10.0.0.1") is Role.OWNER
    spoken = f"{door.code[:3].lower()} {door.code[3:]}"
    assert door.role_of_token(spoken, "10.0.0.1") is Role.VISITOR
    assert door.role_of_token(TOKEN[:-1], "10.0.0.1") is None
    assert access().role_of_token("CDFHJK", "10.0.0.1") is None


def test_a_cookie_holds_the_role_for_one_name_of_one_server():
    door, other = access(), access()
    cookie = door.cookie(Role.OWNER, "localhost:5006").partition(";")[0]
    assert door.role(request(Cookie=cookie)) is Role.OWNER
    assert door.role(request(host="localhost:9000", Cookie=cookie)) is None
    assert other.role(request(Cookie=cookie)) is None
    assert TOKEN not in cookie


def test_nobody_is_owner_without_the_token():
    door = access(open_to_all=True)
    assert door.role(request(Host="127.0.0.1:5006")) is Role.VISITOR


def test_cookies_cross_sites_only_for_a_frame_of_a_secure_one():
    assert access().cookie(Role.OWNER, "h").endswith("; HttpOnly; SameSite=Lax")
    framed = access(frame_ancestors=("https://lms.example.org",))
    assert framed.cookie(Role.OWNER, "h").endswith("; SameSite=None; Secure; Partitioned")
    assert framed.frame_policy == "frame-ancestors 'self' https://lms.example.org"


def test_wrong_codes_are_bounded_by_the_address_they_come_from():
    clock = Clock()
    door = Access(EntryRules(with_code=True), port=1, clock=clock)
    for _ in range(MOST_WRONG):
        assert door.role_of_token("CDFHJ", "10.0.0.1") is None
    with pytest.raises(InputError, match="try again in 30 seconds"):
        door.role_of_token(door.code, "10.0.0.1")
    assert door.role_of_token(door.token, "10.0.0.1") is Role.OWNER
    assert door.role_of_token(door.code, "10.0.0.2") is Role.VISITOR
    clock.now_s += FORGIVEN_EVERY_S
    assert door.role_of_token(door.code, "10.0.0.1") is Role.VISITOR


def test_all_addresses_of_one_network_of_the_sixth_version_count_as_one():
    door = access(with_code=True)
    for number in range(MOST_WRONG):
        door.role_of_token("CDFHJ", f"2001:db8::{number:x}")
    with pytest.raises(InputError, match="wrong codes"):
        door.role_of_token("CDFHJ", "2001:db8::ffff")
    assert door.role_of_token("CDFHJ", "2001:db8:0:1::1") is None


def test_a_code_holds_against_guesses_through_a_lecture():
    """The figures of the document: two hours, one address."""
    guesses = MOST_WRONG + 2 * 3600 / FORGIVEN_EVERY_S
    assert guesses == 270
    assert guesses / len(CODE_LETTERS) ** CODE_LENGTH < 1e-5


def test_codes_are_read_from_afar():
    assert not set("0OQ1IL2Z5S6G8BUVAE") & set(CODE_LETTERS)
    assert len({draw_code() for _ in range(20)}) == 20
    pictures = {letter: tuple(large_letters(letter)) for letter in CODE_LETTERS}
    assert len(set(pictures.values())) == len(CODE_LETTERS)
    assert all(len(rows) == 5 for rows in pictures.values())


@pytest.mark.parametrize(
    ("uri", "place"),
    [
        ("/?token=x", "./"),
        ("/studies?token=x&snr=3", "./studies?snr=3"),
        ("/tools/vsep/?a=%26&token=x&b=", "./?a=%26&b="),
        ("//evil.example/?token=x", "./"),
    ],
)
def test_the_address_without_its_token_stays_in_its_folder(uri, place):
    assert place_without_token(request(uri)) == place


@pytest.mark.parametrize(
    "rules",
    [
        {"token": "short"},
        {"token": "no blanks between these words"},
        {"origins": ("http://lab.example.org",)},
        {"origins": ("*",)},
        {"frame_ancestors": ("lms.example.org",)},
        {"frame_ancestors": ("https://a; script-src *",)},
    ],
)
def test_rules_that_are_none_are_one_sentence(rules):
    with pytest.raises(InputError, match="must"):
        EntryRules(**rules)


def test_a_token_of_the_user_is_not_printed():
    own, drawn = access(), Access(EntryRules(with_code=True), port=5006)
    place = {"address": "127.0.0.1", "prefix": "/vsep"}
    assert TOKEN not in announcement(own, **place)
    assert f"http://127.0.0.1:5006/vsep/?token={drawn.token}" in announcement(drawn, **place)
    assert f"code {drawn.code}" in announcement(drawn, **place)
    assert "WARNING" in announcement(access(open_to_all=True), **place)
    assert TOKEN not in repr(EntryRules(token=TOKEN))


def test_addresses_are_as_a_browser_takes_them():
    assert base_address("::1", 5006, "") == "http://[::1]:5006/"
    assert "0.0.0.0" not in base_address("0.0.0.0", 5006, "")
