"""Recorded runs, snapshots and shared links in a headless browser."""

import re
import subprocess
import sys

import pytest
from vsep_app.report.metadata import read_provenance

from tests.app.test_browser import (  # noqa: F401
    CHROMIUM,
    PATIENCE_MS,
    Dashboard,
    app_url,
    browser_context_args,
    browser_type_launch_args,
    dashboard,
    watched,
)

pytestmark = [
    pytest.mark.ui,
    pytest.mark.skipif(CHROMIUM is None, reason="no chromium found on the PATH"),
]
DRAWN = """() => {
  const read = (name) => [...Bokeh.documents[0].all_models]
    .find((m) => m.name === name && Bokeh.index.find_one_by_id(m.id))
  const map = read("range-doppler-after").renderers[0].data_source.data.image[0]
  const lines = read("fast-time").renderers[0].data_source.data
  return {
    map: [...map].reduce((sum, value, n) => (sum * 31 + value * (n + 1)) % 1000003, 7),
    curve: [...lines.cleaned].slice(0, 40),
    objects: read("range-doppler-after").renderers[1].data_source.data.range.length,
    title: read("fast-time").title.text,
  }
}"""


def test_reports_open_and_a_recorded_run_plays_from_disk_without_a_request(page, tmp_path):
    report, out = tmp_path / "report.html", tmp_path / "run.html"
    # A process of its own, as for a user.
    command = f"report --preset simulation-2-b --out {report} --record {out}"
    code = f"from vsep_app.cli.main import main; raise SystemExit(main({command.split()!r}))"
    subprocess.run([sys.executable, "-c", code], check=True, timeout=120)
    requests, errors = [], []
    page.on("request", lambda request: requests.append(request.url))
    page.on("pageerror", lambda error: errors.append(str(error)))
    page.on("console", lambda m: errors.append(m.text) if m.type == "error" else None)
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
    page.get_by_label("Ramp").select_option("6")
    assert page.evaluate(DRAWN)["title"] == "Fast time, ramp 6"
    page.get_by_role("button", name="Play").click()
    page.wait_for_function("document.body.dataset.iteration >= 2", timeout=PATIENCE_MS)
    page.get_by_role("button", name="Pause").click()
    page.get_by_label("Ramp").select_option("0")
    slider.focus()
    page.keyboard.press("End")
    assert page.evaluate(DRAWN) == last
    assert page.locator("ol.log li:visible").count() == page.locator("ol.log li").count()
    assert (requests, errors) == ([report.as_uri(), out.as_uri()], [])


def test_a_shared_link_shows_the_same_picture_elsewhere(dashboard, browser):  # noqa: F811
    dashboard.open("?preset=simulation-2-b&iteration=3&ramp=4&speed=30").until_status("paused")
    dashboard.until(lambda: dashboard.iteration == 3, "iteration 3 is shown")
    dashboard.until(lambda: "iteration=3" in dashboard.page.url, "the address has it")
    dashboard.button("Step").click()
    dashboard.until(lambda: "iteration=4" in dashboard.page.url, "the address follows")
    elsewhere = browser.new_page(viewport={"width": 1400, "height": 900})
    other = Dashboard(elsewhere, dashboard.page.url).open()
    other.until_status("paused")
    other.until(lambda: other.iteration == 4, "iteration 4 is shown there")
    other.until(lambda: elsewhere.evaluate(DRAWN) == dashboard.page.evaluate(DRAWN), "it is equal")
    elsewhere.close()
    dashboard.button("Run").click()
    dashboard.until_status("converged")
    dashboard.until(lambda: "&iteration=" not in dashboard.page.url, "a run that ended needs none")


def test_a_snapshot_is_downloaded_and_says_what_was_shown(dashboard, tmp_path):  # noqa: F811
    dashboard.open("?preset=simulation-2-b&iteration=2&speed=30").until_status("paused")
    dashboard.until(lambda: dashboard.iteration == 2, "iteration 2 is shown")
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


def test_the_link_is_copied(dashboard, context):  # noqa: F811
    context.grant_permissions(["clipboard-read", "clipboard-write"])
    dashboard.open("?seed=11").until_status("converged")
    dashboard.page.get_by_role("button", name="Copy link").click()
    dashboard.page.get_by_text("Link copied").wait_for(timeout=PATIENCE_MS)
    copied = dashboard.page.evaluate("navigator.clipboard.readText()")
    assert copied == dashboard.page.url
    assert "seed=11" in copied
