"""Teaching in a headless browser: the flow of an experiment, help, files, axe, keyboard, phone."""

import json
import re
import time

import pytest
from axe_playwright_python.sync_playwright import Axe

from tests.app.test_browser import (  # noqa: F401
    CHROMIUM,
    PATIENCE_MS,
    Dashboard,
    app_url,
    at_rest,
    browser_context_args,
    browser_type_launch_args,
    dashboard,
    open_page,
    page_of_several_tests,
    quiet_server,
    watched,
)

pytestmark = [
    pytest.mark.ui,
    pytest.mark.skipif(CHROMIUM is None, reason="no chromium found on the PATH"),
]
PAGES = ["?speed=30", "compare?speed=30&max_iterations=3", "separability", "recording", "studies"]
# Of the libraries, not ours, told by what stands in the element: progress bars have no name, the
# mark that shows a tooltip has a label but no role, plus and minus of a number field have no name.
UPSTREAM = {
    "aria-progressbar-name": "MuiLinearProgress",
    "aria-prohibited-attr": 'sx="[object',
    "button-name": "MuiIconButton-sizeSmall",
}
# What a control is called, and the one that has the focus, inside of all shadow roots.
NAME = """(element) => {
  const label = element.getAttribute("aria-label") || element.labels?.[0]?.textContent
  return (label || element.textContent || element.tagName).trim()
}"""
FOCUSED = f"""() => {{
  let element = document.activeElement
  while (element && element.shadowRoot && element.shadowRoot.activeElement) {{
    element = element.shadowRoot.activeElement
  }}
  return ({NAME})(element)
}}"""
PHONE = {"width": 390, "height": 844}
WIDE = "[document.documentElement.scrollWidth, document.documentElement.clientWidth]"
CUT_OFF = """() => {
  const found = []
  const walk = (root) => {
    for (const element of root.querySelectorAll("*")) {
      if (element.shadowRoot) { walk(element.shadowRoot) }
      if (!element.matches("button, a, input, [role=combobox]")) { continue }
      const box = element.getBoundingClientRect()
      if (box.width > 1 && (box.left < -1 || box.right > window.innerWidth + 1)) {
        found.push([element.outerHTML.slice(0, 120), box.left, box.right])
      }
    }
  }
  walk(document)
  return found
}"""


def drawn(page, url, query):
    """Open a page and wait until it shows something and is at rest."""
    page.goto(url + query)
    page.wait_for_selector("canvas", timeout=3 * PATIENCE_MS)
    page.wait_for_function(
        "() => !document.querySelector('.pn-loading, .bk-loading')", timeout=PATIENCE_MS
    )
    status = page.locator("[role=status]").first
    status.wait_for(timeout=PATIENCE_MS)
    # The trials of the laboratory go on for minutes; its map stands from the beginning. A recording
    # is shown at once and waits.
    also = {"separability": "running", "recording": "ready"}
    words = ["finished", "converged", "stopped"] + [
        word for page_name, word in also.items() if query.startswith(page_name)
    ]
    page.wait_for_function(
        """(words) => {
          const all = (root) => [...root.querySelectorAll("*")].flatMap(
            (e) => e.shadowRoot ? [e, ...all(e.shadowRoot)] : [e])
          const status = all(document).find((e) => e.getAttribute("role") === "status")
          return words.some((w) => status.textContent.startsWith(w))
        }""",
        arg=words,
        timeout=3 * PATIENCE_MS,
    )


def serious_violations(page):
    """What axe-core finds on the page that is serious or critical, and ours."""
    return [
        (rule["id"], node["html"][:200])
        for rule in Axe().run(page).response["violations"]
        if rule["impact"] in ("serious", "critical")
        for node in rule["nodes"]
        if UPSTREAM.get(rule["id"], "nothing") not in node["html"]
    ]


def choose(page, title):
    page.get_by_role("combobox", name=re.compile("^Experiment")).click()
    page.get_by_role("menuitem", name=title).click()


def test_an_experiment_from_choice_to_answer(dashboard):  # noqa: F811
    dashboard.open("?speed=30").until_status("converged")
    page = dashboard.page
    choose(page, "Two cars with the same slope")
    page.get_by_text("Which one is the car in front of you").wait_for(timeout=PATIENCE_MS)
    for part in ("experiment=same-slope", "slope=10", "model=convolution"):
        dashboard.until(lambda part=part: part in page.url, f"the address has {part}")
    dashboard.until(
        lambda: page.locator("table.components tbody tr").count() == 2, "two objects are found"
    )
    dashboard.until_status("converged")
    answer = page.get_by_text("No method can tell from this frame")
    assert answer.count() == 0
    # By the keyboard.
    dashboard.button("Show the answer").focus()
    page.keyboard.press("Enter")
    answer.wait_for(timeout=PATIENCE_MS)
    dashboard.press("Interferer slope", "ArrowLeft")
    dashboard.until(lambda: "slope=9.99" in page.url, "the slider is taken")
    dashboard.button("Start again").click()
    dashboard.until(lambda: "slope=10" in page.url, "the slope is set again")
    page.goto(page.url)
    dashboard.open(page.url.removeprefix(dashboard.url)).until_status("converged")
    page.get_by_text("Which one is the car in front of you").wait_for(timeout=PATIENCE_MS)
    assert answer.count() == 0


def test_an_experiment_of_the_compare_page_is_opened_there(dashboard):  # noqa: F811
    dashboard.open("?speed=30").until_status("converged")
    choose(dashboard.page, "Why zeroing leaves ghosts")
    dashboard.page.get_by_role("link", name="Open this experiment on its own page").click()
    dashboard.page.wait_for_selector("table.methods", timeout=3 * PATIENCE_MS)
    dashboard.page.get_by_text("Where do dozens of false objects").wait_for(timeout=PATIENCE_MS)
    dashboard.until(
        lambda: "methods=zeroing%2Cmasked%2Cfactorised" in dashboard.page.url, "it is set"
    )


def test_help_opens_and_closes_by_the_keyboard(at_rest):  # noqa: F811
    page = at_rest.page
    page.get_by_role("button", name=re.compile("^Help")).focus()
    page.keyboard.press("Enter")
    page.get_by_text("What came in during one ramp").wait_for(timeout=PATIENCE_MS)
    for tab, words in (("Glossary", "no unbiased estimator"), ("Controls", "Less: stronger")):
        page.get_by_role("tab", name=tab).click()
        page.get_by_text(words).first.wait_for(timeout=PATIENCE_MS)
    page.keyboard.press("Escape")
    page.get_by_role("dialog").wait_for(state="hidden", timeout=PATIENCE_MS)


def test_table_and_events_are_downloaded(at_rest):  # noqa: F811
    page = at_rest.page
    for name, place in (("CSV", 0), ("JSON", 1), ("CSV", 0)):
        with page.expect_download(timeout=PATIENCE_MS) as waiting:
            page.get_by_role("button", name=name).nth(place).click()
        text = waiting.value.path().read_text(encoding="utf-8")
        if name == "CSV":
            assert text.splitlines()[0].startswith("component_id,range_m,range_std_m")
            assert len(text.splitlines()) == 2
        else:
            assert waiting.value.suggested_filename == "vsep-events.json"
            assert any(
                "object added at 12.0 m" in one["text"] for one in json.loads(text)["events"]
            )


def open_experiment(page, query):
    """Where a page has experiments, begin one and look at its answer."""
    if query.startswith("?"):
        choose(page, "The dip and its cause")
        page.get_by_role("button", name=re.compile("Show the answer")).click()
        page.get_by_text("belongs to the order").wait_for(timeout=PATIENCE_MS)


@pytest.mark.parametrize("query", PAGES)
def test_a_phone_held_upright_shows_all(watched, app_url, query):  # noqa: F811
    watched.set_viewport_size(PHONE)
    drawn(watched, app_url, f"{query}{'&' if '?' in query else '?'}theme=dark")
    assert watched.locator(".mui-dark").count() > 0
    watched.get_by_role("button", name="Open drawer").wait_for(timeout=PATIENCE_MS)
    wide, shown = watched.evaluate(WIDE)
    assert wide == shown == PHONE["width"]
    # The drawer takes its time to leave.
    watched.wait_for_function(f"() => ({CUT_OFF})().length === 0", timeout=PATIENCE_MS)
    for name in ("^Help", "Toggle theme"):
        assert watched.get_by_role("button", name=re.compile(name)).is_visible()
    assert watched.get_by_role("navigation", name="Pages").get_by_role("link").count() >= 2
    watched.get_by_role("button", name="Open drawer").click()
    control = watched.get_by_role("combobox").first
    control.wait_for(timeout=PATIENCE_MS)
    # The drawer takes its time to leave.
    watched.wait_for_function(f"() => ({CUT_OFF})().length === 0", timeout=PATIENCE_MS)
    watched.keyboard.press("Escape")
    watched.get_by_role("button", name="Open drawer").wait_for(timeout=PATIENCE_MS)


@pytest.fixture(scope="module", params=PAGES)
def projector(request, browser, browser_context_args, app_url):  # noqa: F811
    """Every page on a projector of 1024 by 768, and how it was asked for."""
    size = {"width": 1024, "height": 768}
    with page_of_several_tests(browser, browser_context_args, viewport=size) as page:
        drawn(page, app_url, request.param)
        yield page, request.param


@pytest.fixture
def projected(projector, caplog):
    """The same, for one of the tests that look at it one after the other."""
    with quiet_server(caplog):
        yield projector


def test_a_projector_of_1024_shows_all(projected):
    page, _ = projected
    assert page.get_by_role("button", name="Close drawer").is_visible()
    wide, shown = page.evaluate(WIDE)
    assert wide == shown == 1024
    # The drawer takes its time to leave.
    page.wait_for_function(f"() => ({CUT_OFF})().length === 0", timeout=PATIENCE_MS)


def test_the_tab_key_reaches_every_control(projected):
    page, _ = projected
    wanted = []
    for role in ("button", "combobox", "slider", "textbox", "checkbox", "link"):
        for element in page.get_by_role(role).all():
            if element.is_enabled() and element.is_visible():
                wanted.append(element.evaluate(NAME))
    reached = set()
    page.locator("body").press("Tab")
    for _ in range(3 * len(wanted)):
        reached.add(page.evaluate(FOCUSED))
        page.keyboard.press("Tab")
    assert wanted
    assert set(wanted) - reached == set()


def test_axe_finds_nothing_serious_in_either_theme_and_in_the_help(projected):
    page, query = projected
    assert page.locator(".mui-dark").count() == 0
    open_experiment(page, query)
    assert serious_violations(page) == []
    page.get_by_role("button", name="Toggle theme").click()
    page.locator(".mui-dark").first.wait_for(state="attached", timeout=PATIENCE_MS)
    # The colours of a page change one part after the other.
    deadline = time.monotonic() + PATIENCE_MS / 1000
    found = ["not looked yet"]
    while found and time.monotonic() < deadline:
        page.wait_for_timeout(2000)
        found = serious_violations(page)
    assert found == []
    if query.startswith("?"):  # the other pages' help is made of the same parts
        page.get_by_role("button", name=re.compile("^Help")).click()
        page.get_by_text("What came in during one ramp").wait_for(timeout=PATIENCE_MS)
        assert serious_violations(page) == []
