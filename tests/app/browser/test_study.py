"""The page of studies in a headless browser: it grows, stops, goes on and opens a trial."""

import multiprocessing
import re
import time

import pytest

from tests.app.browser.tab import PATIENCE_MS, Dashboard

pytestmark = pytest.mark.ui
# The server forgets a page 4 s after its tab is closed and looks every 2 s; then the workers end
# within a fifth of a second. The rest is room for a busy machine.
GONE_S = 20.0
DOT = """() => {
  const m = [...Bokeh.documents[0].all_models]
    .find((m) => m.name === "study-trials" && Bokeh.index.find_one_by_id(m.id))
  const view = Bokeh.index.find_one_by_id(m.id), r = view.el.getBoundingClientRect()
  const source = m.renderers[0].data_source
  const x = view.frame.x_scale.compute(source.data.x[0])
  const y = view.frame.y_scale.compute(source.data.y[0])
  return [r.left + x, r.top + y, source.data.link[0]]
}"""
INTERVALS = """() => {
  // Of the method that has most: without mitigation there is seldom exactly one object.
  const sources = [...Bokeh.documents[0].all_models]
    .filter((m) => m.name === "study-RMSE / root CRLB" && Bokeh.index.find_one_by_id(m.id))
    .flatMap((m) => m.renderers.map((r) => r.data_source))
  return Math.max(0, ...sources.filter((s) => s.data.low).map(
    (s) => [...s.data.low].filter((low, i) => low < s.data.high[i]).length))
}"""


LONG = 400  # realisations that take longer than a test


class Studies(Dashboard):
    """What the tests do with the page."""

    ROUTE = "studies"

    def loaded(self):
        self.page.wait_for_selector("[role=status]", timeout=PATIENCE_MS)
        self.page.wait_for_timeout(500)
        return self

    def click(self, name):
        self.button(name).click()

    def until_status(self, word):
        self.page.locator("[role=status]", has_text=word).wait_for(timeout=PATIENCE_MS)

    def until(self, condition, what, patience_ms=PATIENCE_MS):
        super().until(condition, what, patience_ms)

    def quick(self, realizations):
        """Choose two methods that take little time."""
        self.choose("Study", "fig-3")
        for method in ("factorised", "joint", "masked"):
            self.page.get_by_role("checkbox", name=method).uncheck()
        self.type("Realizations", str(realizations))
        self.type("Seed", "2")  # of the first one rows are shipped

    @property
    def header(self):
        return self.progress

    @property
    def progress(self):
        return self.page.locator("span.status").inner_text()

    @property
    def rows(self):
        return int(self.progress.split(" ")[0])


@pytest.fixture
def studies(tab, app_url, app_server):
    """The page of studies, with whatever the test before it has left there."""
    page = Studies(tab, app_server)
    return page if tab.shows(f"{app_url}studies") else page.open()


def test_a_small_study_runs_to_its_end_and_opens_its_outlier(studies):
    page = studies.page
    studies.quick(2)
    studies.choose("Value", "iterations")
    studies.click("Run")
    studies.until_status("running")
    studies.until_status("finished")
    studies.until(lambda: studies.progress == "52 of 52 rows", "all rows are there")
    # A bootstrap of two realisations has an interval wherever both detected the object.
    studies.until(lambda: page.evaluate(INTERVALS) > 5, "the curves have intervals")
    studies.assert_figures_are_on_the_screen(number=4, least_size=100)
    first = page.locator("table.trials tbody tr").first
    iterations = int(first.locator("td").last.inner_text())
    first.locator("a").click()
    page.locator("[role=status] >> visible=true", has_text="converged").wait_for(
        timeout=PATIENCE_MS
    )
    told = page.get_by_text(f"iteration {iterations} of {iterations}")
    assert told.count() == 1
    assert "trial=fig-3%2F" in page.url


def test_a_study_stops_and_goes_on_where_it_was(studies):
    studies.quick(LONG)
    studies.click("Run")
    studies.until_status("running")
    studies.until(lambda: "left" in studies.progress, "the time left is told")
    studies.page.locator("table.trials a").first.wait_for(timeout=PATIENCE_MS)
    studies.click("Stop")
    studies.until_status("stopped")
    held = studies.rows
    studies.page.wait_for_timeout(1500)
    assert studies.rows == held > 0
    studies.click("Run")
    studies.until_status("running")
    studies.until(lambda: studies.rows > held, "there are more rows")
    studies.click("Stop")
    studies.until_status("stopped")


def test_a_click_on_a_dot_opens_its_trial_in_the_live_view(studies):
    studies.quick(LONG)
    studies.click("Run")
    studies.page.locator("table.trials a").first.wait_for(timeout=PATIENCE_MS)
    studies.click("Stop")
    studies.until_status("stopped")
    studies.page.wait_for_timeout(2500)
    left, top, link = studies.page.evaluate(DOT)
    page = studies.page
    page.mouse.click(left, top)
    page.locator("[role=status] >> visible=true", has_text="converged").wait_for(
        timeout=PATIENCE_MS
    )
    # Dots of several realizations may lie on each other: the study and the point are certain.
    assert "/".join(link.split("/")[:2]).replace("/", "%2F") in page.url


def test_a_bad_file_is_told_and_the_page_goes_on(studies):
    studies.upload("notes.jsonl", b"these are notes\n")
    notice = studies.page.get_by_text("Line 1 of notes.jsonl is no row of a study")
    notice.first.wait_for(timeout=PATIENCE_MS)
    studies.quick(LONG)
    studies.click("Run")
    studies.until_status("running")
    studies.click("Stop")
    studies.until_status("stopped")


def test_an_example_is_shown_as_pictures(studies):
    studies.choose("Study", "fig-2")
    studies.click("Run")
    studies.until_status("finished")
    key = studies.page.locator("div.key")
    key.get_by_text("received").wait_for(timeout=PATIENCE_MS)
    assert key.get_by_text("channel component").count() == 1
    assert len(studies.figures()) == 3


def test_the_pages_lead_to_each_other_by_keyboard(studies):
    page = studies.page
    page.get_by_role("link", name="Live view").focus()
    page.keyboard.press("Enter")
    page.wait_for_url(re.compile(r"/\?preset="), timeout=PATIENCE_MS)
    page.get_by_role("button", name="Pause").wait_for(timeout=PATIENCE_MS)
    page.get_by_role("link", name="Studies").focus()
    page.keyboard.press("Enter")
    page.wait_for_url(re.compile("/studies"), timeout=PATIENCE_MS)
    page.get_by_role("button", name=re.compile("^Run")).wait_for(timeout=PATIENCE_MS)


def test_closing_the_tab_ends_the_workers(studies):
    before = set(multiprocessing.active_children())

    def workers():
        return set(multiprocessing.active_children()) - before

    # All methods on sixteen ramps: a trial takes seconds.
    studies.choose("Study", "fig-5")
    studies.click("Run")
    studies.until(workers, "a worker is there")
    studies.page.close()
    deadline = time.monotonic() + GONE_S
    while workers():
        assert time.monotonic() < deadline, "the workers outlive their page"
        time.sleep(0.05)
