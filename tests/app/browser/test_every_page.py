"""Every page in a headless browser: on a phone, on a projector, by the keyboard, and by axe."""

import re
import time

import pytest
from axe_playwright_python.sync_playwright import Axe

from tests.app.browser.tab import PATIENCE_MS, Tab

pytestmark = pytest.mark.ui
PAGES = ["?speed=30", "street", "compare?speed=30&max_iterations=3"]
PAGES += ["separability", "recording", "studies"]
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
PROJECTOR = {"width": 1024, "height": 768}
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
    page.wait_for_selector("canvas", timeout=PATIENCE_MS)
    page.wait_for_function(
        "() => !document.querySelector('.pn-loading, .bk-loading')", timeout=PATIENCE_MS
    )
    status = page.locator("[role=status]").first
    status.wait_for(timeout=PATIENCE_MS)
    # A map and a recording are shown at once and wait, the street is never at rest.
    also = {"separability": "ready", "recording": "ready", "street": "playing"}
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
        timeout=PATIENCE_MS,
    )


class Received:
    """Bytes of an opening as they come over the wire; nothing but files is packed."""

    def __init__(self, tab):
        self.files, self.document = 0, 0
        network = tab.context.new_cdp_session(tab.page)
        network.send("Network.enable")
        network.on("Network.loadingFinished", self._loaded)
        network.on("Network.webSocketFrameReceived", self._told)

    def _loaded(self, event):
        self.files += event["encodedDataLength"]

    def _told(self, event):
        """Note the largest message, which is the document; others are those of the run."""
        self.document = max(self.document, len(event["response"]["payloadData"]))


def serious_violations(page):
    """What axe-core finds on the page that is serious or critical, and ours."""
    return [
        (rule["id"], node["html"][:200])
        for rule in Axe().run(page).response["violations"]
        if rule["impact"] in ("serious", "critical")
        for node in rule["nodes"]
        if UPSTREAM.get(rule["id"], "nothing") not in node["html"]
    ]


def open_experiment(page, query):
    """Where a page has experiments, begin one and look at its answer."""
    if query.startswith("?"):
        page.get_by_role("combobox", name=re.compile("^Experiment")).click()
        page.get_by_role("menuitem", name="The last line of the algorithm").click()
        page.get_by_role("button", name=re.compile("^Some are lost")).click()
        page.get_by_role("button", name=re.compile("Show the answer")).click()
        page.get_by_text("does not belong together").wait_for(timeout=PATIENCE_MS)


def is_dark(page):
    return page.locator(".mui-dark").count() > 0


def change_theme(page):
    """Change to the other theme; the colours of a page change one part after the other."""
    wanted = "detached" if is_dark(page) else "attached"
    page.get_by_role("button", name="Toggle theme").click()
    page.locator(".mui-dark").first.wait_for(state=wanted, timeout=PATIENCE_MS)


def serious_violations_at_rest(page):
    """What is found once the colours have changed."""
    deadline = time.monotonic() + PATIENCE_MS / 1000
    found = ["not looked yet"]
    while found and time.monotonic() < deadline:
        page.wait_for_timeout(1000)
        found = serious_violations(page)
    return found


@pytest.fixture(scope="module", params=PAGES)
def opened(request, browser, app_url):
    """Every page, opened on a phone in its dark theme, and how it was asked for."""
    tab = Tab(browser)
    tab.resize(PHONE)
    query = request.param
    tab.received = Received(tab)
    drawn(tab.page, app_url, f"{query}{'&' if '?' in query else '?'}theme=dark")
    yield tab, query
    tab.close()


@pytest.fixture
def shown(opened, caplog):
    """The same, for one of the tests that look at it one after the other."""
    tab, query = opened
    yield tab, query
    server = [r.getMessage() for r in caplog.records if r.levelname in ("ERROR", "CRITICAL")]
    assert (*tab.take_faults(), server) == ([], [], [])


@pytest.fixture
def phone(shown):
    """The page on a phone, in its dark theme and with the side bar closed, as it was opened."""
    tab, _ = shown
    tab.resize(PHONE)
    return tab.page


@pytest.fixture
def projector(shown):
    """The page on a projector in its light theme with the side bar open; it is left like that."""
    tab, query = shown
    tab.resize(PROJECTOR)
    page = tab.page
    if page.get_by_role("button", name="Open drawer").is_visible():
        page.get_by_role("button", name="Open drawer").click()
    page.get_by_role("button", name="Close drawer").wait_for(timeout=PATIENCE_MS)
    if is_dark(page):
        change_theme(page)
    yield page, query
    if page.get_by_role("dialog").is_visible():
        page.keyboard.press("Escape")
        page.get_by_role("dialog").wait_for(state="hidden", timeout=PATIENCE_MS)
    if is_dark(page):
        change_theme(page)


def test_a_page_is_little_over_the_wire(shown):
    """Measured 0.97 to 1.25 MB, 0.77 of them two scripts; 2.0 with what no page uses."""
    received = shown[0].received
    assert received.document > 100_000
    assert received.files > 800_000
    assert received.files + received.document < 1_300_000


def test_a_phone_held_upright_shows_all(phone):
    assert is_dark(phone)
    phone.get_by_role("button", name="Open drawer").wait_for(timeout=PATIENCE_MS)
    wide, shown = phone.evaluate(WIDE)
    assert wide == shown == PHONE["width"]
    # The drawer takes its time to leave.
    phone.wait_for_function(f"() => ({CUT_OFF})().length === 0", timeout=PATIENCE_MS)
    for name in ("^Help", "Toggle theme"):
        assert phone.get_by_role("button", name=re.compile(name)).is_visible()
    assert phone.get_by_role("navigation", name="Pages").get_by_role("link").count() >= 2
    phone.get_by_role("button", name="Open drawer").click()
    control = phone.get_by_role("combobox").first
    control.wait_for(timeout=PATIENCE_MS)
    # The drawer takes its time to leave.
    phone.wait_for_function(f"() => ({CUT_OFF})().length === 0", timeout=PATIENCE_MS)
    phone.keyboard.press("Escape")
    phone.get_by_role("button", name="Open drawer").wait_for(timeout=PATIENCE_MS)


def test_a_projector_of_1024_shows_all(projector):
    page, _ = projector
    assert page.get_by_role("button", name="Close drawer").is_visible()
    page.wait_for_function(f"() => {WIDE}.every((width) => width === 1024)", timeout=PATIENCE_MS)
    # The drawer takes its time to leave.
    page.wait_for_function(f"() => ({CUT_OFF})().length === 0", timeout=PATIENCE_MS)


def test_the_tab_key_reaches_every_control(projector):
    page, _ = projector
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


def test_axe_finds_nothing_serious_in_either_theme_and_in_the_help(projector):
    page, query = projector
    open_experiment(page, query)
    assert serious_violations_at_rest(page) == []
    change_theme(page)
    assert serious_violations_at_rest(page) == []
    if query.startswith("?"):  # the other pages' help is made of the same parts
        page.get_by_role("button", name=re.compile("^Help")).click()
        page.get_by_text("What came in during one ramp").wait_for(timeout=PATIENCE_MS)
        assert serious_violations(page) == []
