"""The street in a headless browser: it plays, its controls act, it pauses."""

import re

import pytest

from tests.app.browser.tab import PATIENCE_MS, Dashboard

pytestmark = pytest.mark.ui


class Street(Dashboard):
    """What the tests do with the page."""

    ROUTE = "street"

    @property
    def frame(self):
        number = re.search(r"frame (\d+)", self.header)
        return int(number[1]) if number else 0

    def in_time(self):
        text = self.page.get_by_text("frames in time").first.inner_text()
        return int(re.search(r"of (\d+) frames", text)[1])


@pytest.fixture
def street(tab, app_server):
    """The page; it rests when the test is over."""
    page = Street(tab, app_server)
    page.page.set_default_timeout(PATIENCE_MS)
    yield page
    if page.button("Pause").count():
        page.button("Pause").click()
        page.until(lambda: page.button("Play").count() == 1, "it rests")


def test_the_street_plays_and_its_controls_act_on_the_next_frame(street):
    street.open("?theme=light")
    street.until(lambda: street.frame >= 12, "some frames have been played")
    assert street.status == "playing"
    street.until(lambda: street.in_time() > 0, "frames are counted")
    street.until_told("cyclist 1")
    street.assert_figures_are_on_the_screen(number=3, least_size=90)
    before = street.frame
    street.press("SIR", "ArrowRight")
    street.until(lambda: "street=sir" in street.page.url, "the address has the setting")
    street.until(lambda: street.frame > before + 4, "it plays on")
    street.button("Pause").click()
    street.until(lambda: street.button("Play").count() == 1, "it pauses")
    street.settle()
    at = street.frame
    street.page.wait_for_timeout(500)
    assert street.frame == at
    street.button("Play").click()
    street.until(lambda: street.frame > at + 4, "it goes on")
