"""Pages as tabs of one document in a headless browser."""

import re

import pytest
from vsep_app.pages import PAGES

from tests.app.browser.tab import FIGURES, PATIENCE_MS

pytestmark = pytest.mark.ui
TITLE = "(title) => document.title === title"
IS_SEEN = f"(name) => ({FIGURES})().some((each) => each[0] === name)"


def test_a_tab_opens_in_this_document_and_the_history_leads_back(tab, app_url):
    page, sockets = tab.page, []
    page.on("websocket", lambda socket: sockets.append(socket))  # noqa: PLW0108
    page.goto(f"{app_url}?preset=simulation-1&seed=3")
    page.locator("[role=status]", has_text="converged").wait_for(timeout=PATIENCE_MS)
    page.evaluate("window.same_document = true")

    def shows(address, *marks):
        page.wait_for_function(TITLE, arg=PAGES[address].title, timeout=PATIENCE_MS)
        for mark in marks:
            page.wait_for_url(re.compile(mark), timeout=PATIENCE_MS)
        here = page.locator("nav a[aria-current]")
        here.wait_for(timeout=PATIENCE_MS)
        assert here.inner_text() == PAGES[address].name

    page.get_by_role("link", name="Compare").click()
    shows("compare", r"/compare\?", "seed=3", "methods=")
    page.locator("[role=status] >> visible=true", has_text="finished").wait_for(timeout=PATIENCE_MS)
    page.wait_for_function(IS_SEEN, arg="compare-profile-0", timeout=PATIENCE_MS)
    assert not page.evaluate(IS_SEEN, "fast-time")
    page.go_back()
    shows("./", r"/\?", "seed=3")
    page.wait_for_function(IS_SEEN, arg="fast-time", timeout=PATIENCE_MS)
    assert not page.evaluate(IS_SEEN, "compare-profile-0")
    page.go_forward()
    shows("compare", r"/compare\?", "methods=")
    assert page.evaluate("window.same_document")
    assert len(sockets) == 1
    page.reload()
    shows("compare", r"/compare\?", "seed=3")
