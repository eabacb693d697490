"""Recorded runs, snapshots and shared links in a headless browser."""

import re
import subprocess
import sys

import pytest
from vsep_app.report.metadata import read_provenance

from tests.app.browser.tab import PATIENCE_MS, Dashboard, Tab

pytestmark = pytest.mark.ui
DRAWN = """() => {
  const read = (name) => [...Bokeh.documents[0].all_models]
    .find((m) => m.name === name && Bokeh.index.find_one_by_id(m.id))
  const map = read("range-doppler-after").renderers[0].data_source.data.image[0]
  const lines = read("fast-time").renderers[0].data_source.data
  return {
    map: [...map].reduce((sum, value, n) => (sum * 31 + value * (n + 1)) % 1000003, 7),
    curve: [...lines.cleaned].slice(0, 40),
    // Map, extended objects, cells, lines and rings of the misses, estimates.
    objects: read("range-doppler-after").renderers[5].data_source.data.range.length,
    title: read("fast-time").title.text,
  }
}"""


def test_reports_open_and_a_recorded_run_plays_from_disk_without_a_request(tab, tmp_path):
    report, out = tmp_path / "report.html", tmp_path / "run.html"
    # A process of its own, as for a user.
    command = f"report --preset simulation-2-b --out {report} --record {out}"
    code = f"from vsep_app.cli.main import main; raise SystemExit(main({command.split()!r}))"
    subprocess.run([sys.executable, "-c", code], check=True, timeout=120)
    page, requests = tab.context.new_page(), []
    page.on("request", lambda request: requests.append(request.url))
    page.goto(report.as_uri())
    page.wait_for_selector("canvas", timeout=PATIENCE_MS)
    assert page.locator("table.components tr.found").count() == 10
    page.goto(out.as_uri())
    page.wait_for_selector("canvas", timeout=PATIENCE_MS)
    page.wait_for_selector("body[data-iteration]", timeout=PATIENCE_MS)
    last = page.evaluate(DRAWN)
    assert last["objects"] == page.locator("table.components tr.found").count() == 10
    slider = page.get_by_role("slider", name="Iteration")
    slider.focus()
    page.keyboard.press("Home")
    first = page.evaluate(DRAWN)
    assert first["objects"] == 0
    assert first["map"] != last["map"]
    assert first["curve"] != last["curve"]
    assert page.locator("ol.log li:visible").count() == 0
    page.locator("#ramp").select_option("6")
    assert page.evaluate(DRAWN)["title"] == "Fast time, ramp 6"
    page.get_by_role("button", name="Play").click()
    page.wait_for_function("document.body.dataset.iteration >= 2", timeout=PATIENCE_MS)
    page.get_by_role("button", name="Pause").click()
    page.locator("#ramp").select_option("0")
    slider.focus()
    page.keyboard.press("End")
    assert page.evaluate(DRAWN) == last
    assert page.locator("ol.log li:visible").count() == page.locator("ol.log li").count()
    assert requests == [report.as_uri(), out.as_uri()]


def scrub(dashboard, iteration):
    """Look at an early iteration of the run that is shown."""
    dashboard.press("Iteration", "Home")
    for number in range(iteration + 1):
        dashboard.until(lambda n=number: dashboard.iteration == n, f"iteration {number} is shown")
        if number < iteration:
            dashboard.page.keyboard.press("ArrowRight")
    dashboard.until_status("paused")


@pytest.fixture
def elsewhere(browser, app_server):
    """The live view in another browser, not yet opened."""
    tab = Tab(browser)
    yield Dashboard(tab, app_server)
    faults = tab.take_faults()
    tab.close()
    assert faults == ([], [])


def test_a_shared_link_shows_the_same_picture_elsewhere(dashboard, elsewhere):
    dashboard.show("?preset=simulation-2-b&speed=30").until_status("converged")
    for _ in range(4):
        dashboard.page.locator("body").press(".")
    dashboard.until(lambda: "ramp=4" in dashboard.page.url, "ramp 4 is chosen")
    scrub(dashboard, 3)
    dashboard.until(lambda: "iteration=3" in dashboard.page.url, "the address has it")
    dashboard.button("Step").click()
    dashboard.until(lambda: "iteration=4" in dashboard.page.url, "the address follows")
    elsewhere.open(dashboard.page.url.removeprefix(dashboard.url)).until_status("paused")
    elsewhere.until(lambda: elsewhere.iteration == 4, "iteration 4 is shown there")
    here, there = dashboard.page, elsewhere.page
    elsewhere.until(lambda: there.evaluate(DRAWN) == here.evaluate(DRAWN), "it is equal")
    assert there.evaluate(DRAWN)["title"] == "Fast time, ramp 4"
    dashboard.button("Run").click()
    dashboard.until_status("converged")
    dashboard.until(lambda: "&iteration=" not in dashboard.page.url, "a run that ended needs none")


def test_a_snapshot_is_downloaded_and_says_what_was_shown(dashboard, tmp_path):
    dashboard.show("?preset=simulation-2-b&speed=30").until_status("converged")
    scrub(dashboard, 2)
    names = []
    for item in ("Page", "Results"):
        dashboard.page.get_by_role("button", name=re.compile("Snapshot")).click()
        with dashboard.page.expect_download(timeout=PATIENCE_MS) as download:
            dashboard.page.get_by_role("menuitem", name=item).click()
        names.append(download.value.suggested_filename)
        download.value.save_as(tmp_path / names[-1])
    assert names == [f"vsep-simulation-2-b-7-iteration-2.{suffix}" for suffix in ("html", "json")]
    told = [read_provenance(tmp_path / name) for name in names]
    assert told[0] == told[1]
    assert (told[0]["spec"]["iteration"], told[0]["result"]["iterations"]) == (2, 2)


def test_the_link_is_copied(dashboard):
    dashboard.tab.context.grant_permissions(["clipboard-read", "clipboard-write"])
    dashboard.show("?seed=11").until_status("converged")
    dashboard.page.get_by_role("button", name="Copy link").click()
    dashboard.page.get_by_text("Link copied").wait_for(timeout=PATIENCE_MS)
    copied = dashboard.page.evaluate("navigator.clipboard.readText()")
    assert copied == dashboard.page.url
    assert "seed=11" in copied
