"""What a browser gets before the page itself is built, and how scripts come to it."""

import gzip
import http.client
import re
import time
from typing import Any
from urllib.parse import urlsplit

import pytest
from vsep_app.pages.live_address import plan_of_query, with_start
from vsep_app.server.opening import Opening

SCRIPT = re.compile(r'src="([^"]*bokeh\.min\.js[^"]*)"')


def fetch(server: Any, place: str, **headers: str) -> tuple[int, dict[str, str], bytes]:
    connection = http.client.HTTPConnection("127.0.0.1", server.port, timeout=60)
    connection.request("GET", place, headers=headers)
    answer = connection.getresponse()
    content = answer.read()
    connection.close()
    return answer.status, {key.lower(): value for key, value in answer.getheaders()}, content


@pytest.fixture(scope="module")
def live_html(app_server: Any) -> str:
    """The live page as its second visitor gets it."""
    deadline = time.monotonic() + 60.0
    while True:
        _, _, content = fetch(app_server, "/")
        text = content.decode()
        if "<polyline" in text or time.monotonic() > deadline:
            return text
        time.sleep(0.3)


def test_the_first_picture_stands_before_all_scripts(live_html: str) -> None:
    first = live_html.index('id="opening"')
    assert first < live_html.index("<polyline") < live_html.index("<script")
    assert "10 objects and bursts of another radar in 4 ramps" in live_html
    assert "data:image/png;base64," in live_html


def test_beginning_and_rest_are_one_page(live_html: str) -> None:
    for tag in ("<!DOCTYPE html>", "<html", "<head>", "<body>", "</body>", "</html>", "<title>"):
        assert live_html.count(tag) == 1, tag
    assert live_html.rstrip().endswith("</body></html>")
    # The scripts are named before the document that needs them is built.
    source = SCRIPT.search(live_html)
    assert source is not None
    assert live_html.index(f'<link rel="preload" as="script" href="{source[1]}">') < source.start()


@pytest.mark.parametrize("place", ["/compare", "/?seed=3&theme=dark", "/?snr=loud"])
def test_every_page_begins_with_its_name(app_server: Any, place: str) -> None:
    status, headers, content = fetch(app_server, place)
    assert status == 200
    assert headers["cache-control"] == "no-store"
    text = content.decode()
    name = "Compare" if place == "/compare" else "Live view"
    assert f"vsep · {name}" in text
    assert ('data-theme="dark"' in text) == ("dark" in place)


def test_an_address_cannot_bring_markup() -> None:
    text = Opening().beginning("/<script>", '"><script>', "")
    assert text.count("<script>") == 1
    assert 'data-theme=""' in text


@pytest.mark.parametrize(
    ("query", "preset"),
    [
        ({}, "simulation-2-b"),
        ({"theme": "dark"}, "simulation-2-b"),
        ({"seed": "9"}, "simulation-1"),
        ({"experiment": "dip"}, None),
        ({"snr": "loud"}, None),
    ],
)
def test_only_settings_have_a_first_picture(query: dict[str, str], preset: str | None) -> None:
    plan = plan_of_query(query)
    assert (None if plan is None else plan.preset) == preset
    assert with_start({"seed": "9"}) == {"seed": "9"}


def test_scripts_are_packed_and_kept(app_server: Any, live_html: str) -> None:
    source = SCRIPT.search(live_html)
    assert source is not None
    place = "/" + urlsplit(source[1]).path.lstrip("./") + "?" + urlsplit(source[1]).query
    status, headers, packed = fetch(app_server, place, **{"Accept-Encoding": "gzip"})
    assert (status, headers["content-encoding"]) == (200, "gzip")
    assert int(headers["content-length"]) == len(packed)
    assert "max-age=315360000" in headers["cache-control"]
    _, plain_headers, plain = fetch(app_server, place)
    assert "content-encoding" not in plain_headers
    assert gzip.decompress(packed) == plain
    assert len(packed) < 0.4 * len(plain)
    again = {"Accept-Encoding": "gzip", "If-None-Match": headers["etag"]}
    assert fetch(app_server, place, **again)[0] == 304
    part = {"Accept-Encoding": "gzip", "Range": "bytes=0-9"}
    assert fetch(app_server, place, **part)[2] == plain[:10]
    assert fetch(app_server, "/static/../../etc/passwd.js", **again)[0] in (403, 404)
