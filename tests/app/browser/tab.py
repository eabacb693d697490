"""What the tests of all pages do with the browser."""

import json
import re
import shutil
import threading
import time
from urllib.parse import parse_qsl, urlencode, urlsplit

import panel as pn
from vsep_app.model.settings import Settings
from vsep_app.model.url import QUERY_NAMES, parse_query

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser")
LAUNCH = ["--no-sandbox", "--disable-gpu", "--disable-background-networking", "--no-first-run"]
# Room for a machine that does other things at the same time; nothing waits for its end.
PATIENCE_MS = 90_000
SIMULATION_1 = "?preset=simulation-1"
SCREEN = {"width": 1400, "height": 900}

COUNT_DRAWN = """
() => {
  if (!window.drawn_at) {
    window.drawn_at = []
    for (const model of Bokeh.documents[0].all_models) {
      if (model.name === "drawn") {
        model.properties.data.change.connect(() => window.drawn_at.push(performance.now()))
      }
    }
  }
  return window.drawn_at
}
"""
FIGURES = """() => [...Bokeh.documents[0].all_models]
    .filter((m) => m.type === "Figure" && Bokeh.index.find_one_by_id(m.id))
    .map((m) => [m.name, Bokeh.index.find_one_by_id(m.id).el.getBoundingClientRect()])
    .filter(([name, r]) => r.width > 0)
    .map(([name, r]) => [name, r.left, r.top, r.right, r.bottom])"""


class Tab:
    """A page that stays open from test to test, and all that goes wrong on it.

    Parameters
    ----------
    browser : Browser
        Of Playwright.
    """

    def __init__(self, browser):
        self._browser, self._context, self._page = browser, None, None
        self.outside, self.errors = [], []

    @property
    def context(self):
        if self._context is None:
            self._context = self._browser.new_context(viewport=SCREEN)
            self._context.set_default_timeout(PATIENCE_MS)
            self._context.on("request", self._requested)
            self._context.on("weberror", lambda error: self.errors.append(str(error.error)))
            self._context.on("console", self._logged)
        return self._context

    @property
    def page(self):
        if self._page is None or self._page.is_closed():
            self._page = self.context.new_page()
        return self._page

    def _requested(self, request):
        if not request.url.startswith(("http://127.0.0.1", "data:", "blob:", "file:")):
            self.outside.append(request.url)

    def _logged(self, message):
        if message.type == "error":
            self.errors.append(message.text)

    def shows(self, url):
        """Whether the page is that of an address, with any query."""
        here, there = urlsplit(self.page.url), urlsplit(url)
        return (here.netloc, here.path) == (there.netloc, there.path)

    def resize(self, size):
        if self.page.viewport_size != size:
            self.page.set_viewport_size(size)

    def take_faults(self):
        """Return outside requests and console errors since the last time."""
        faults = self.outside, self.errors
        self.outside, self.errors = [], []
        return faults

    def close_other_pages(self):
        for page in self.context.pages if self._context is not None else []:
            if page is not self._page:
                page.close()

    def close(self):
        if self._context is not None:
            self._context.close()
        self._context = self._page = None


def whole_address(query):
    """Return the query that states all settings of a shorter one, as the page itself writes it."""
    values, errors = parse_query(dict(parse_qsl(query.removeprefix("?"))))
    assert errors == []
    settings = Settings(**values)
    stated = {key: getattr(settings, name) for name, key in QUERY_NAMES.items()}
    texts = {key: v if isinstance(v, str) else json.dumps(v) for key, v in stated.items()}
    # What is not set has no word in an address.
    return "?" + urlencode({key: text for key, text in texts.items() if text != "null"})


class Dashboard:
    """What the tests do with the live view, and with pages that are driven like it."""

    ROUTE = ""

    def __init__(self, tab, server):
        self.tab, self.server = tab, server
        self.url = f"http://127.0.0.1:{server.port}/"

    @property
    def page(self):
        return self.tab.page

    def open(self, query=""):
        """Open the page anew; `show` takes less."""
        self.page.goto(self.url + self.ROUTE + query)
        return self.loaded()

    def loaded(self):
        self.page.wait_for_selector("canvas >> visible=true", timeout=PATIENCE_MS)
        self.page.wait_for_selector("[role=status]", timeout=PATIENCE_MS)
        return self

    def show(self, query=SIMULATION_1):
        """Begin what a link describes: on the page that is open, as by its controls."""
        if not self.tab.shows(self.url + self.ROUTE):
            return self.open(query)
        if not self.settles(lambda: self.button("Reset").is_enabled()):
            # Panel's components miss what changes while they mount (seen once in five suites).
            return self.open(query)
        self.button("Reset").click()
        if not self.settles(lambda: (self.status, self.iteration) == ("ready", 0)):
            return self.open(query)  # likewise
        self.set_address(whole_address(query))
        # Where these were the settings already, no run has begun.
        self.button("Run").dispatch_event("click")
        self.until(lambda: self.status != "ready", "it runs")
        return self

    def set_address(self, query):
        """Let the page's own session take settings, as if its controls had set them."""
        taken = threading.Event()

        def take():
            pn.state.location.search = query
            taken.set()

        root = self.page.evaluate("Bokeh.documents[0].roots()[0].id")
        documents = [each.document for each in self.server.get_sessions(f"/{self.ROUTE}")]
        (document,) = [each for each in documents if each.get_model_by_id(root) is not None]
        document.add_next_tick_callback(take)
        self.until(taken.is_set, "the session has taken the settings")

    def rests_at(self, query):
        """Whether this is what the page shows, run to its end."""
        is_here = self.tab.shows(self.url + self.ROUTE) and self.status == "converged"
        return is_here and urlsplit(self.page.url).query == whole_address(query)[1:]

    @property
    def status(self):
        return self.page.locator("[role=status] >> visible=true").first.inner_text()

    @property
    def header(self):
        return self.page.locator("span:has(> [role=status]) >> visible=true").first.inner_text()

    @property
    def iteration(self):
        number = re.search(r"iteration (\d+) of", self.header)
        return int(number[1]) if number else 0

    def until(self, condition, what, patience_ms=PATIENCE_MS):
        deadline = time.monotonic() + patience_ms / 1000.0
        while not condition():
            assert time.monotonic() < deadline, f"waited in vain until {what}; {self.header}"
            self.page.wait_for_timeout(30)

    def settles(self, condition, patience_s=5.0):
        """Whether a condition comes true soon."""
        deadline = time.monotonic() + patience_s
        while not condition() and time.monotonic() < deadline:
            self.page.wait_for_timeout(30)
        return condition()

    def until_status(self, *words):
        self.until(lambda: self.status in words, f"it says {words}")
        return self

    def until_told(self, words):
        self.page.get_by_text(words).last.wait_for(timeout=PATIENCE_MS)

    def button(self, name):
        return self.page.get_by_role("button", name=re.compile(f"^{name}"))

    def choose(self, label, option, *, exact=True):
        self.page.get_by_role("combobox", name=re.compile(f"^{label}")).click()
        self.page.get_by_role("menuitem", name=option, exact=exact).click()

    def slider(self, label):
        """The range input of the slider whose label starts so."""
        return self.page.get_by_role("slider", name=re.compile(f"^{label}"))

    def press(self, label, key):
        """Move a slider by the keyboard; the release commits it."""
        self.slider(label).focus()
        self.page.keyboard.press(key)

    def type(self, label, text):
        """Write into a field and leave it."""
        field = self.page.get_by_role("textbox", name=re.compile(f"^{label}"))
        field.fill(text)
        field.press("Tab")

    def figures(self):
        """Names of all figures that are shown."""
        return [name for name, *_ in self.page.evaluate(FIGURES)]

    def assert_figures_are_on_the_screen(self, *, number, least_size):
        """All inside of it; they are laid out after the status is written."""
        self.until(lambda: len(self.figures()) == number, f"{number} figures are laid out")
        for name, left, top, right, bottom in self.page.evaluate(FIGURES):
            assert (left >= 0, top >= 0, right <= 1400, bottom <= 900) == (True,) * 4, name
            assert min(right - left, bottom - top) > least_size, name

    def drawn(self):
        return self.page.evaluate(COUNT_DRAWN)

    def settle(self):
        """Wait until no picture is on its way any more."""
        count = -1
        while count != len(self.drawn()):
            count = len(self.drawn())
            self.page.wait_for_timeout(500)

    def unfold(self):
        """Show the controls that are seldom needed."""
        if not self.page.get_by_role("textbox", name="Object threshold").is_visible():
            self.button("More controls").click()
            self.page.get_by_role("textbox", name="Object threshold").wait_for(timeout=PATIENCE_MS)
        return self

    def upload(self, name, content, place=0):
        file = {"name": name, "mimeType": "application/octet-stream", "buffer": content}
        self.page.locator("input[type=file]").nth(place).set_input_files(file)
