"""The laboratory in a headless browser: it draws, follows the controls, and opens a cell."""

import re
from urllib.parse import parse_qs, urlsplit

import pytest

from tests.app.browser.tab import PATIENCE_MS

pytestmark = pytest.mark.ui
QUERY = "separability?x=sir_db%3D-40:40:5&y=snr_db%3D20:60:5&method=object-only&trials=1"
MAP = """() => {
  const m = [...Bokeh.documents[0].all_models]
    .find((m) => m.name === "separability-map" && m.type === "Figure")
  const view = Bokeh.index.find_one_by_id(m.id), r = view.el.getBoundingClientRect()
  const x = view.frame.x_scale.compute(20), y = view.frame.y_scale.compute(30)
  return {place: [r.left + x, r.top + y], title: m.title.text, tags: m.tags.length}
}"""
DRAWN = """(title) => {
  const m = [...(window.Bokeh?.documents?.[0]?.all_models ?? [])]
    .find((m) => m.name === "separability-map" && m.type === "Figure")
  return m != null && m.title.text === title && m.tags.length > 0
}"""


@pytest.fixture
def separability(tab, app_url):
    """The page with a small map, drawn."""
    address = app_url + QUERY
    page = tab.page
    asked, shown = (parse_qs(urlsplit(url).query) for url in (address, page.url))
    if not tab.shows(address) or any(shown.get(key) != asked[key] for key in asked):
        page.goto(address)
    page.wait_for_function(DRAWN, arg="condition (27), all objects [dB]", timeout=PATIENCE_MS)
    return page


def test_trials_fill_the_map_and_a_click_opens_a_cell(separability):
    run = separability.get_by_role("button", name=re.compile("^Run trials"))
    if run.is_enabled():
        run.click()
    separability.locator("span.status", has_text="25 of 25 cells").wait_for(timeout=PATIENCE_MS)
    left, top = separability.evaluate(MAP)["place"]
    separability.mouse.click(left, top)
    converged = separability.locator("[role=status] >> visible=true", has_text="converged")
    converged.wait_for(timeout=PATIENCE_MS)
    assert "sir_db%3D20.0" in separability.url
    assert "snr_db%3D30.0" in separability.url
    separability.go_back()
    separability.locator("span.status", has_text="25 of 25 cells").wait_for(timeout=PATIENCE_MS)


def test_a_range_of_nonsense_is_told(separability):
    field = separability.get_by_role("textbox", name="To", exact=True).first
    field.fill("-90")
    field.press("Tab")
    notice = separability.get_by_text("sir_db goes from -40 to -90")
    notice.first.wait_for(timeout=PATIENCE_MS)
    field.fill("40")
    field.press("Tab")


def test_the_map_follows_layer_and_axis_and_the_address_keeps_them(separability):
    page = separability

    def choose(label, option, number=0):
        page.get_by_role("combobox", name=re.compile(f"^{label}")).nth(number).click()
        page.get_by_role("menuitem", name=option, exact=True).click()

    choose("Layer", "coherence of the bases")
    page.wait_for_function(DRAWN, arg="coherence of the bases", timeout=PATIENCE_MS)
    choose("Parameter", "Filter bandwidth")
    page.wait_for_url(re.compile("x=filter_cutoff_hz"), timeout=PATIENCE_MS)
    page.reload()
    page.wait_for_function(DRAWN, arg="coherence of the bases", timeout=PATIENCE_MS)
    assert "layer=coherence" in page.url
