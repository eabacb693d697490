"""Pages as tabs of one document: what they share, what stands still, and what fails alone."""

from dataclasses import replace

import pytest
from bokeh.document import Document
from panel.io.state import set_curdoc
from vsep_app.model.settings import LOADED_FRAME
from vsep_app.pages import PAGES
from vsep_app.pages.base import PageContext
from vsep_app.pages.tabs import Tabs
from vsep_app.server.lesson import View

LIVE, COMPARE = "./", "compare"


@pytest.fixture
def opened(pool):
    """Open the dashboard at a tab; what is posted is done at once, and no run begins."""
    made = []

    def make(address=LIVE, **query):
        context = PageContext(
            pool=pool, query=query, post=lambda call: call(), watched=lambda: True
        )
        tabs = Tabs(context, address)
        tabs.page()
        made.append(tabs)
        return tabs

    with set_curdoc(Document()):
        yield make
    for tabs in made:
        tabs.close()


@pytest.fixture(autouse=True)
def without_runs(monkeypatch):
    """Let no page compute anything."""
    monkeypatch.setattr("vsep_app.jobs.run_loop.FrameLoop.start", lambda _: None)
    monkeypatch.setattr(
        "vsep_app.jobs.background.BackgroundTasks.begin", lambda _, work: work.close()
    )


def page_of(tabs, address):
    return tabs._tabs[address].page


def seen(tabs):
    """Which tabs have visible places, by header, side bar and main part."""
    return [
        {address for address, tab in tabs._tabs.items() if getattr(tab, place).visible}
        for place in ("header", "sidebar", "main")
    ]


def test_a_tab_is_made_once_and_alone_is_seen(opened):
    tabs = opened(seed="3")
    tabs.start()
    assert [*tabs._tabs] == [LIVE]
    tabs.press("page compare")
    first = page_of(tabs, COMPARE)
    assert seen(tabs) == [{COMPARE}] * 3
    tabs.press("page ./")
    tabs.press("page compare")
    assert page_of(tabs, COMPARE) is first


def test_tabs_of_runs_share_their_settings_and_the_address_follows(opened):
    tabs = opened(seed="3")
    tabs.start()
    tabs.press("page compare")
    compare, live = page_of(tabs, COMPARE), page_of(tabs, LIVE)
    assert compare.settings.seed == 3
    assert "methods=" in tabs._location.search
    compare.settings.seed = 9
    tabs.press("page recording")
    tabs.press("page ./")
    assert live.settings.seed == 9
    assert "seed=9" in tabs._location.search
    assert "methods=" not in tabs._location.search
    assert tabs._location.pathname == "/"


def test_the_history_of_the_browser_leads_to_the_settings_of_its_entry(opened):
    tabs = opened(seed="3")
    tabs.start()
    before = tabs._location.search
    tabs.press("page compare")
    page_of(tabs, COMPARE).settings.seed = 9
    tabs.press(f"page ./{before}")
    assert page_of(tabs, LIVE).settings.seed == 3


def test_a_frame_that_was_loaded_is_left_alone(opened):
    tabs = opened(preset="real-frame")
    tabs.start()
    live = page_of(tabs, LIVE)
    live.settings.preset = LOADED_FRAME
    tabs.press("page compare")
    page_of(tabs, COMPARE).settings.seed = 9
    tabs.press("page ./")
    assert (page_of(tabs, LIVE), live.settings.preset) == (live, LOADED_FRAME)


def test_nobody_watches_what_is_hidden(opened):
    tabs = opened()
    tabs.start()
    tabs.press("page compare")
    watched = {address: page_of(tabs, address)._context.watched() for address in tabs._tabs}
    assert watched == {LIVE: False, COMPARE: True}


def test_a_tab_that_fails_says_so_and_leaves_the_others_alone(opened, monkeypatch):
    tabs = opened()
    tabs.start()
    monkeypatch.setattr(
        "vsep_app.pages.compare.page.ComparePage.page", lambda _: 1 / 0, raising=True
    )
    tabs.press("page compare")
    told = tabs._tabs[COMPARE].main[0][1].object
    assert "Compare cannot be opened (ZeroDivisionError" in told
    tabs.press("page ./")
    assert seen(tabs) == [{LIVE}] * 3


def test_a_view_of_the_lecturer_is_shown_in_place(opened):
    tabs = opened()
    tabs.start()
    tabs.show_view(View(page=COMPARE, query=(("seed", "5"), ("methods", "iht,masked"))))
    assert tabs.seen.page == COMPARE
    assert page_of(tabs, COMPARE).choice.methods == ["iht", "masked"]
    tabs.show_view(View(page=LIVE, query=(("seed", "6"),)))
    assert page_of(tabs, LIVE).settings.seed == 6
    tabs.show_view(View(page="lead"))
    assert tabs.seen.page == LIVE


def test_a_page_that_prepares_has_the_tabs_of_experiments_out_of_sight(opened):
    tabs = opened(seed="3")
    tabs.start()
    before = tabs._location.search
    assert tabs.prepare() == [COMPARE]
    assert seen(tabs) == [{LIVE}] * 3
    assert (tabs.seen.page, tabs._location.search) == (LIVE, before)
    prepared = page_of(tabs, COMPARE)
    assert not prepared._context.watched()
    tabs.show_view(View(page=COMPARE, query=(("experiment", "zeroing"),)))
    assert seen(tabs) == [{COMPARE}] * 3
    assert page_of(tabs, COMPARE) is prepared
    assert prepared.guide.experiment.name == "zeroing"
    assert "experiment=zeroing" in tabs._location.search
    assert tabs.prepare() == []


def test_a_tab_that_is_asked_for_again_before_it_is_made_shows_what_was_asked_last(opened):
    tabs, later = opened(seed="3"), []
    tabs.start()
    tabs._context = replace(tabs._context, post=later.append)
    tabs.press("page compare")
    tabs.press("page ./")
    tabs.show_view(View(page=COMPARE, query=(("seed", "5"), ("methods", "iht,masked"))))
    while later:
        later.pop(0)()
    assert page_of(tabs, COMPARE).choice.methods == ["iht", "masked"]
    assert page_of(tabs, COMPARE).settings.seed == 5


def test_another_page_can_be_the_first(opened):
    tabs = opened("studies")
    assert tabs._page.title == PAGES["studies"].title
    assert seen(tabs) == [{"studies"}] * 3
