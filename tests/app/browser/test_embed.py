"""A view in a page of another origin: with the token it is there and speaks, without it is not."""

import threading
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from urllib.parse import quote

import pytest
from vsep_app.server.access import EntryRules

from tests.app.browser.tab import PATIENCE_MS
from tests.app.conftest import served

pytestmark = pytest.mark.ui
TOKEN = "a-token-of-the-test"
LAST = "heard.findLast((m) => m.kind === 'iteration')"
EXAMPLES = Path(__file__).parents[3] / "assets" / "docs" / "examples"


class Quiet(SimpleHTTPRequestHandler):
    def log_message(self, *_):
        pass


@pytest.fixture(scope="module")
def around():
    """A web server of another origin: the one of the example page."""
    with ThreadingHTTPServer(("127.0.0.1", 0), partial(Quiet, directory=EXAMPLES)) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        yield f"http://localhost:{server.server_address[1]}"
        server.shutdown()


@pytest.fixture(scope="module")
def embedded(around):
    with served(entry=EntryRules(token=TOKEN, frame_ancestors=(around,))) as server:
        yield f"http://localhost:{server.port}/embed"


def opened(browser, around, view):
    page = browser.new_context().new_page()
    page.set_default_timeout(PATIENCE_MS)
    page.goto(f"{around}/embed.html?view={quote(view, safe='')}")
    return page


def test_with_the_token_a_view_speaks_with_the_page_around_it(browser, around, embedded):
    page = opened(browser, around, f"{embedded}?preset=simulation-2-b&iteration=0&token={TOKEN}")
    page.wait_for_function("heard.some((m) => m.kind === 'iteration')")
    frame = page.frames[1]
    assert TOKEN not in frame.url
    assert frame.locator("canvas").count() >= 1
    assert frame.get_by_role("button").count() == 1
    page.wait_for_function(
        "heard.some((m) => m.kind === 'settings' && Number(m.settings.sir) === -20)"
    )
    page.get_by_role("button", name="First iteration").click()
    page.wait_for_function(f"{LAST}.iteration === 1")
    assert page.evaluate(f"{LAST}.events.length") > 0
    page.get_by_label("SIR").fill("-10")
    page.wait_for_function(
        "heard.some((m) => m.kind === 'settings' && Number(m.settings.sir) === -10)"
    )
    page.context.close()


def test_without_the_token_a_view_asks_for_it(browser, around, embedded):
    page = opened(browser, around, embedded)
    page.frame_locator("iframe").get_by_text("type the token at its end").wait_for()
    assert page.evaluate("heard") == []
    page.context.close()


def test_a_page_that_is_not_named_shows_no_view(browser, around):
    with served(entry=EntryRules(token=TOKEN)) as server:
        page = opened(browser, around, f"http://localhost:{server.port}/embed?token={TOKEN}")
        page.wait_for_timeout(500)
        assert page.frames[1].locator("canvas").count() == 0
        assert page.evaluate("heard") == []
        page.context.close()
