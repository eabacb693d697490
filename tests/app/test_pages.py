"""The registry of pages: what it says is what the server answers and the header links to."""

import asyncio
import re
import sys
from types import ModuleType

import pytest
from vsep_app import pages
from vsep_app.pages import PAGES, PageEntry
from vsep_app.pages.base import links_html
from vsep_app.server.main import make_server


def test_addresses_are_keys_and_routes():
    assert all(address == page.address for address, page in PAGES.items())
    assert [page.route for page in PAGES.values()] == [
        "/",
        "/street",
        "/compare",
        "/separability",
        "/recording",
        "/studies",
    ]


@pytest.mark.parametrize("address", PAGES)
def test_every_page_can_be_made_started_and_closed(address):
    made = PAGES[address].load()
    assert all(callable(getattr(made, name)) for name in ("page", "start", "close"))
    assert made.address == address


@pytest.mark.parametrize("address", PAGES)
def test_the_header_links_to_all_pages_and_marks_the_open_one(address):
    html = links_html(address)
    assert all(f'href="{page.address}"' in html for page in PAGES.values())
    (marked,) = re.findall(r'aria-current="page">([^<]+)<', html)
    assert marked == PAGES[address].name


def test_one_entry_adds_a_page(monkeypatch):
    module = ModuleType("vsep_app.pages.mine")
    module.MyPage = type("MyPage", (), {"has_scene": False})
    monkeypatch.setitem(sys.modules, module.__name__, module)
    entry = PageEntry(address="mine", name="My page", title="Mine", source="mine:MyPage")
    monkeypatch.setitem(pages.PAGES, "mine", entry)
    assert '<a href="mine"' in links_html("./")
    loop = asyncio.new_event_loop()
    asyncio.set_event_loop(loop)
    server = make_server(port=0, address="127.0.0.1")
    try:
        assert "/mine" in server._tornado._applications
    finally:
        server.stop()
        asyncio.set_event_loop(None)
        loop.close()
