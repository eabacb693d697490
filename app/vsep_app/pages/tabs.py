"""All pages as tabs of one document.

A tab is made when it is opened for the first time, and keeps its state from then on. What is not
seen stands still: its page is told that nobody watches. Tabs of runs share the settings of their
scenes. The address in the browser is that of the tab that is seen, so that links, reloading and the
buttons *back* and *forward* lead where they say.
"""

import logging
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from html import escape
from typing import Any
from urllib.parse import parse_qsl

import panel as pn
from panel.io.location import Location

from vsep_app.model.settings import LOADED_FRAME
from vsep_app.model.url import ITERATION_KEY, QUERY_NAMES
from vsep_app.pages import PAGES
from vsep_app.pages.base import PageBase, PageContext, PageParts, framed, links, links_html
from vsep_app.server.lesson import Glance, View
from vsep_app.teaching.help import Help
from vsep_app.widgets.keys import PAGE_PREFIX, Keys
from vsep_app.widgets.layout import at_once, html_pane, stylesheet, unseen_title
from vsep_app.widgets.lesson_notice import LessonNotice
from vsep_app.widgets.location import read_query, search_of

_LOG = logging.getLogger(__name__)

_SETTINGS = frozenset(QUERY_NAMES.values())


@dataclass(kw_only=True)
class Tab:
    """A tab: its places in the document, and the page in them once it is made."""

    header: Any
    sidebar: Any
    main: Any
    location: Location
    asked: Mapping[str, Any]  #: What its page is to show once it is made.
    page: PageBase | None = None
    parts: PageParts | None = None

    def show(self, wanted: bool) -> None:
        """Show its places or hide them."""
        for place in (self.header, self.sidebar, self.main):
            place.visible = wanted
        # On narrow screens the style sheet has a word on that, too.
        self.main.css_classes = [] if wanted else ["unseen"]


class Tabs(PageBase):
    """One user's dashboard, which opens with the tab of an address."""

    def __init__(self, context: PageContext, address: str) -> None:
        super().__init__(context)
        self.address = address
        self._tabs: dict[str, Tab] = {}
        self._location = context.location
        self._has_begun = self._is_held = False
        self._header = pn.Row(margin=0, align="center")
        self._sidebar = pn.Column(margin=0, sizing_mode="stretch_width")
        self._main = pn.Column(
            margin=0, sizing_mode="stretch_width", stylesheets=[stylesheet("main")]
        )
        self._links, self._help = links(address), Help(self._explained)
        self.keys = Keys(self.press)
        #: Settings of the scene that was seen last.
        self._scene: dict[str, str] = {}
        self._page: Any = None
        self._watcher: Any = None

    def page(self) -> Any:
        """Return the whole page."""
        seat = self.seat
        if seat is not None and not seat.leads:
            notice = LessonNotice({one.name: one for one in self._context.experiments})
            self._main.append(notice.pane)
            seat.tell = notice.tell
        self._place(self.address, self._context.query)
        self._make(self.address)
        self.keys.join(self._help.button)
        self._tell()
        parts = self._tabs[self.address].parts
        self._page = framed(
            self.address,
            "" if parts is None else parts.description,
            self._help,
            header=[self._links, self._help.button, pn.HSpacer(), self._header],
            sidebar=[self._sidebar],
            main=self._main,
        )
        return self._page

    def start(self) -> None:
        """Begin with the first tab; called when the page has been drawn."""
        self._has_begun = True
        self._watcher = self._location.param.watch(self._take_search, "search")
        self._start(self.address)

    def close(self) -> None:
        """Close all tabs."""
        self.keys.close()
        if self._watcher is not None:
            # Panel keeps the address of a document for as long as that is held.
            self._location.param.unwatch(self._watcher)
        for tab in self._tabs.values():
            if tab.page is not None:
                tab.page.close()

    @property
    def current(self) -> PageBase | None:
        """Page of the tab that is seen, None while there is none."""
        return self._tabs[self.address].page

    @property
    def seen(self) -> View:
        """What is seen, as an address."""
        query = read_query(self._tabs[self.address].location)
        return View(page=self.address, query=tuple(query.items()))

    def show_view(self, view: View) -> None:
        """Show a tab with the settings of an address; called with the document locked."""
        if view.page in PAGES:
            self._show(view.page, dict(view.query))

    def prepare(self) -> Sequence[str]:
        """Make the tabs that experiments lead to, out of sight; return their addresses."""
        asked = _settings_of(read_query(self._tabs[self.address].location))
        led_to = dict.fromkeys(one.page for one in self._context.experiments)
        made = [each for each in led_to if each in PAGES and each not in self._tabs]
        for address in made:
            self._place(address, asked).show(False)
            self._context.post(partial(self._open, address))
        return made

    def hold(self, held: bool) -> None:
        """Let no run go on until it is let go."""
        self._is_held = held
        for tab in self._tabs.values():
            if tab.page is not None:
                tab.page.hold(held)

    def glance(self) -> Glance | None:
        """Return the tab that is seen in small."""
        return None if self.current is None else self.current.glance()

    def press(self, name: str) -> None:
        """Do what a key or a click stands for: another tab, or something of the one that is seen.

        A link names a tab alone, the browser's history a query, too.
        """
        if name.startswith(PAGE_PREFIX):
            address, has_query, query = name.removeprefix(PAGE_PREFIX).partition("?")
            if address in PAGES:
                self._show(address, dict(parse_qsl(query)) if has_query else None)
        elif self.current is not None:
            self.current.press(name)

    def _show(self, address: str, query: Mapping[str, str] | None) -> None:
        """Show a tab; without a query with its own, and the settings of the tab before it."""
        before = self._tabs[self.address]
        shared = read_query(before.location)
        if before.page is not None and before.page.has_scene:
            self._scene = _settings_of(shared)
        shared |= self._scene
        with pn.io.hold():
            if address != self.address:
                before.show(False)
                self.address = address
                self._links.object = links_html(address)
                self._page.title = PAGES[address].title
            tab = self._tabs.get(address)
            if tab is None:
                self._place(address, shared if query is None else query)
                self._context.post(partial(self._open, address))
            else:
                tab.show(True)
                self._return_to(tab, query)
            self._tell()

    def _return_to(self, tab: Tab, query: Mapping[str, str] | None) -> None:
        """Go on with a tab that has been opened before; without a query in the shared scene."""
        page, own = tab.page, read_query(tab.location)
        if page is None:
            tab.asked = tab.asked if query is None else query
            return
        if query is None:
            query = self._in_scene(own) if page.has_scene else own
        if query != own and not page.take_view(query):
            page.close()
            tab.asked = query
            self._context.post(partial(self._open, page.address))
            return
        page.show_again()
        self._write_address()

    def _in_scene(self, query: dict[str, str]) -> Mapping[str, str]:
        """Return the address of a tab in the scene that was seen last.

        A frame that was loaded stays, and is shown to no other tab.
        """
        presets = {each.get("preset") for each in (query, self._scene)}
        if LOADED_FRAME in presets or _settings_of(query) == self._scene:
            return query
        others = {key: value for key, value in query.items() if key != ITERATION_KEY}
        return others | self._scene

    def _place(self, address: str, asked: Mapping[str, Any]) -> Tab:
        """Make the places of a tab, whose page is to show what is asked for."""
        tab = Tab(
            header=pn.Row(margin=0, align="center"),
            sidebar=pn.Column(margin=0, sizing_mode="stretch_width"),
            main=pn.Column(margin=0, sizing_mode="stretch_both", stylesheets=[stylesheet("tab")]),
            location=Location(),
            asked=asked,
        )
        self._tabs[address] = tab
        self._header.append(tab.header)
        self._sidebar.append(tab.sidebar)
        self._main.append(tab.main)
        return tab

    def _open(self, address: str) -> None:
        """Make the page of a tab and begin with it; called with the document locked."""
        with at_once():
            self._make(address)
        self._context.post(partial(self._start, address))

    def _make(self, address: str) -> None:
        """Make the page of a tab; one that fails leaves the others alone."""
        tab, entry = self._tabs[address], PAGES[address]
        query = dict(tab.asked)
        tab.location = Location(search=search_of(query))
        context = replace(
            self._context,
            query=query,
            watched=partial(self._is_watched, address),
            background=self._context.background.another(),
            location=tab.location,
        )
        try:
            tab.page = entry.load()(context)
            tab.parts = parts = tab.page.page()
            header, main = parts.header, parts.main
            tab.header[:], tab.sidebar[:] = header, [*parts.sidebar]
        except Exception as error:
            _LOG.error("a tab could not be opened", exc_info=error)
            sentence = f"{entry.name} cannot be opened ({type(error).__name__}: {error})."
            html = f'<p class="fault" role="alert">{escape(sentence)}</p>'
            main = [html_pane("fault", html, margin=0, sizing_mode="stretch_width")]
        tab.main[:] = [
            pn.Column(
                unseen_title(entry.title),
                *main,
                margin=0,
                sizing_mode="stretch_both",
                stylesheets=[stylesheet("page")],
            )
        ]

    def _start(self, address: str) -> None:
        """Let the page of a tab begin; called when it has been drawn."""
        tab = self._tabs[address]
        if tab.page is not None:
            tab.page.hold(self._is_held)
            try:
                tab.page.start()
            except Exception as error:
                _LOG.error("a tab could not begin", exc_info=error)
                self.notify_error(f"{PAGES[address].name} cannot begin: {error}")
        tab.location.param.watch(lambda _: self._write_address(), "search")
        self._tell()
        self._write_address()

    def _is_watched(self, address: str) -> bool:
        return address == self.address and self._context.watched()

    def _tell(self) -> None:
        entry = PAGES[self.address]
        self.keys.tell(entry.title, has_scene=entry.load().has_scene)

    def _explained(self) -> list[Any]:
        """Return what the help lists the controls of."""
        parts = self._tabs[self.address].parts
        return [] if parts is None else parts.explained

    def _take_search(self, event: Any) -> None:
        """Take an address that is not of this program's making."""
        self._tabs[self.address].location.search = event.new

    def _write_address(self) -> None:
        """Let the browser show the address of the tab that is seen."""
        location, search = self._location, self._tabs[self.address].location.search
        if not self._has_begun:
            return
        folder = location.pathname.rpartition("/")[0]
        document = pn.state.curdoc
        # Panel would look for its files elsewhere; but all pages lie in one folder.
        kept = {} if document is None else dict(document.template_variables)
        sheets = pn.state._stylesheets.get(document)
        location.param.update(pathname=f"{folder}/{self.address.removeprefix('./')}", search=search)
        if document is not None:
            document.template_variables.update(kept)
        if sheets is not None:
            pn.state._stylesheets[document] = sheets
        if self.seat is not None:
            self.seat.lead()


def _settings_of(query: Mapping[str, str]) -> dict[str, str]:
    return {key: value for key, value in query.items() if key in _SETTINGS}
