"""Page context, navigation and frame that all pages share."""

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, field
from typing import Any

import panel as pn
import panel_material_ui as pmu
from bokeh.models import CustomJS
from panel.io.location import Location

from vsep_app.jobs.background import BackgroundTasks
from vsep_app.jobs.run_session import MAX_KEPT
from vsep_app.jobs.shared_runs import SharedResources
from vsep_app.pages import APART, PAGES
from vsep_app.server.lesson import Glance, Seat, View
from vsep_app.server.patches import leave_busy_state
from vsep_app.teaching.experiment import Experiment, shipped_experiments
from vsep_app.teaching.help import Help
from vsep_app.widgets.keys import PAGE_PREFIX
from vsep_app.widgets.layout import html_pane, stylesheet, theme
from vsep_app.widgets.notifications import notify

# As wide as the theme's smallest break point: below it the side bar covers the page, so it starts
# closed there.
_CLOSE_SIDE_BAR = """
if (window.innerWidth < 600) {
  for (const model of Bokeh.documents[0].all_models) {
    if (model.class_name === "Page") { model.data.sidebar_open = false }
  }
}
"""

_CURRENT = ' aria-current="page"'


@dataclass(frozen=True, kw_only=True)
class PageContext:
    """What a page knows of the browser that opened it."""

    pool: Executor  #: Does the work: functions of modules, in other processes.
    query: dict[str, Any]  #: Decoded query of the page's address.
    #: Runs a function on the event loop with the document locked; may be called from any thread.
    post: Callable[[Callable[[], None]], Any]
    watched: Callable[[], bool]  #: Whether the browser is still connected.
    #: Whether the visitor sits at this machine and may name folders on its disk.
    own_folder: bool = True
    #: Guided experiments to choose from.
    experiments: Sequence[Experiment] = field(default_factory=shipped_experiments)
    shared_resources: SharedResources = field(
        default_factory=SharedResources
    )  #: What all sessions share.
    #: Coroutines of the page; they end when it closes.
    background: BackgroundTasks = field(default_factory=BackgroundTasks)
    most_kept: int = MAX_KEPT  #: So many iterations of a run can be shown.
    #: So many studies run at once on this server; None sets no limit.
    most_studies: int | None = None
    #: The place of the page in a lesson; None where nobody leads.
    seat: Seat | None = None
    #: Address that the page writes what it shows into; the browser's follows it.
    location: Location = field(default_factory=Location)


class PageBase(ABC):
    """A page of the program; the server makes one for every visit, with what it knows of it."""

    address: str  #: A key of `vsep_app.pages.PAGES` or `APART`.
    #: Whether it shows runs of a scene: such pages share their settings, and have keys.
    has_scene: bool = False

    def __init__(self, context: PageContext) -> None:
        self._context = context

    @abstractmethod
    def page(self) -> Any:
        """Return the page: its `PageParts`, or all of it where it stands alone."""

    @abstractmethod
    def start(self) -> None:
        """Begin; called when the page has been drawn."""

    @abstractmethod
    def close(self) -> None:
        """Stop for good: the browser has left."""

    @property
    def seat(self) -> Seat | None:
        """The place of the page in a lesson; None where nobody leads."""
        return self._context.seat

    def take_view(self, query: Mapping[str, str]) -> bool:
        """Show in place what an address of this page names; False if it has to be opened anew."""
        del query
        return False

    def show_again(self) -> object:
        """Go on: the page was hidden behind another tab, and nothing was drawn."""
        return None

    def press(self, name: str) -> object:
        """Do what a key or a click stands for; see `vsep_app.widgets.keys`."""
        del name
        return None

    @property
    def seen(self) -> View | None:
        """What the page shows, as an address; None where nobody can follow."""
        return None

    def show_view(self, view: View) -> None:
        """Show a view in place."""
        del view

    def prepare(self) -> Sequence[str]:
        """Make what the page may come to show, out of sight; return its addresses."""
        return ()

    def hold(self, held: bool) -> None:
        """Let nothing go on until it is let go: the lecturer speaks."""
        del held

    def glance(self) -> Glance | None:
        """Return the page in small for the lecturer, None while it shows nothing."""
        return None

    def notify_error(self, sentence: str) -> None:
        """Notify the user of what cannot be done."""
        notify(sentence)


@dataclass(frozen=True, kw_only=True)
class PageParts:
    """What a page consists of.

    Parameters
    ----------
    description : str
        For search engines.
    status : Viewable
        Stands at the right of the header.
    sidebar : sequence of Viewable
        Controls.
    main : sequence of Viewable
        Everything else, from top to bottom.
    tools : sequence of Viewable
        Buttons of the header, left of the status.
    folded : callable
        Returns the controls that are shown on demand, for the help; they are made on demand, too.
    """

    description: str
    status: Any
    sidebar: Sequence[Any]
    main: Sequence[Any]
    tools: Sequence[Any] = ()
    folded: Callable[[], Sequence[Any]] = tuple

    @property
    def header(self) -> list[Any]:
        """What stands at the right of the header."""
        self.status.param.update(align="center", stylesheets=[stylesheet("header")])
        return [*self.tools, self.status]

    @property
    def explained(self) -> list[Any]:
        """What the help lists the controls of."""
        return [*self.sidebar, *self.folded(), *self.main]


def links_html(here: str) -> str:
    """Return the links of the header to all pages; that of the open one is marked.

    A click shows the page in this document. Whoever opens one elsewhere takes the settings along:
    what a page does not understand plays no part there.
    """
    anchors = "".join(
        f'<a href="{page.address}" data-press="{PAGE_PREFIX}{page.address}" '
        f'onclick="this.search=location.search"'
        f"{_CURRENT if page.address == here else ''}>{page.name}</a>"
        for page in PAGES.values()
    )
    return f'<nav aria-label="Pages">{anchors}</nav>'


def links(here: str) -> Any:
    """Return the place of the links in the header."""
    look = {"margin": (0, 6, 0, 12), "align": "center", "sizing_mode": None}
    return html_pane("header", links_html(here), **look)


def framed(
    here: str, description: str, guidance: Help, *, header: list[Any], sidebar: Any, main: Any
) -> Any:
    """Return a whole page with header, side bar and main part; `here` is its address."""
    document = pn.state.curdoc
    if document is not None:
        document.js_on_event("document_ready", CustomJS(code=_CLOSE_SIDE_BAR))
    page = pmu.Page(
        title={**PAGES, **APART}[here].title,
        sidebar_width=292,
        sidebar_resizable=False,
        sidebar_variant="auto",
        busy_indicator=None,
        header=header,
        sidebar=sidebar,
        main=[main, guidance.dialog],
        theme_config=theme(),
        meta_description=description,
    )
    leave_busy_state(page)
    return page
