"""The page of studies in a headless browser: it grows, stops, goes on and opens a trial."""

import re

import pytest

from tests.app.test_browser import (  # noqa: F401
    CHROMIUM,
    PATIENCE_MS,
    app_url,
    browser_context_args,
    browser_type_launch_args,
    watched,
)

pytestmark = [
    pytest.mark.ui,
    pytest.mark.skipif(CHROMIUM is None, reason="no chromium found on the PATH"),
]
DOT = """() => {
  const m = [...Bokeh.documents[0].all_models].find((m) => m.name === "study-trials")
  const view = Bokeh.index.find_one_by_id(m.id), r = view.el.getBoundingClientRect()
  const source = m.renderers[0].data_source
  const x = view.frame.x_scale.compute(source.data.x[0])
  const y = view.frame.y_scale.compute(source.data.y[0])
  return [r.left + x, r.top + y, source.data.link[0]]
}"""


@pytest.fixture
def studies(watched, app_url):  # noqa: F811
    """The page of studies, opened."""
    watched.goto(f"{app_url}studies")
    watched.wait_for_selector("[role=status]", timeout=PATIENCE_MS)
    watched.wait_for_timeout(500)
    return watched


def press(page, name):
    page.get_by_role("button", name=re.compile(f"^{name}")).click()


def until(page, word):
    page.locator("[role=status]", has_text=word).wait_for(timeout=2 * PATIENCE_MS)


def rows(page):
    return int(page.locator("span.status").inner_text().split(" ")[0])


def test_a_study_grows_stops_and_goes_on(studies):
    press(studies, "Run")
    until(studies, "running")
    studies.locator("table.trials a").first.wait_for(timeout=2 * PATIENCE_MS)
    press(studies, "Stop")
    until(studies, "stopped")
    held = rows(studies)
    press(studies, "Run")
    until(studies, "running")
    for _ in range(200):
        if rows(studies) > held:
            break
        studies.wait_for_timeout(100)
    assert rows(studies) > held > 0
    press(studies, "Stop")
    until(studies, "stopped")


def test_a_click_on_a_dot_opens_its_trial_in_the_live_view(studies):
    press(studies, "Run")
    studies.locator("table.trials a").first.wait_for(timeout=2 * PATIENCE_MS)
    press(studies, "Stop")
    until(studies, "stopped")
    studies.wait_for_timeout(2500)
    left, top, link = studies.evaluate(DOT)
    with studies.context.expect_page() as opened:
        studies.mouse.click(left, top)
    live = opened.value
    live.locator("[role=status]", has_text="converged").wait_for(timeout=2 * PATIENCE_MS)
    # Dots of several realizations may lie on each other: the study and the point are certain.
    assert "/".join(link.split("/")[:2]).replace("/", "%2F") in live.url
