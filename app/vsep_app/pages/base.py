"""Page context, navigation and frame that all pages share."""

from collections.abc import Callable, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, field
from typing import Any, Protocol

import panel as pn
import panel_material_ui as pmu
from bokeh.models import CustomJS
from panel.util.parameters import edit_readonly

from vsep_app.jobs.background import BackgroundTasks
from vsep_app.jobs.run_session import MAX_KEPT
from vsep_app.jobs.shared_runs import SharedResources
from vsep_app.pages import PAGES
from vsep_app.server.patches import write_styles_once
from vsep_app.teaching.experiment import Experiment, shipped_experiments
from vsep_app.teaching.help import Help
from vsep_app.widgets.layout import stylesheet, theme

# As wide as the theme's smallest break point: below it the side bar covers the page, so it starts
# closed there.
_CLOSE_SIDE_BAR = """
if (window.innerWidth < 600) {
  for (const model of Bokeh.documents[0].all_models) {
    if (model.class_name === "Page") { model.data.sidebar_open = false }
  }
}
"""


@dataclass(frozen=True, kw_only=True)
class PageContext:
    """What a page knows of the browser that opened it.

    Parameters
    ----------
    pool : Executor
        Does the work: functions of modules, in other processes.
    query : dict
        Decoded query of the page's address.
    post : callable
        Runs a function on the event loop with the document locked; may be called from any thread.
    watched : callable
        Whether the browser is still connected.
    own_folder : bool
        Whether the visitor sits at this machine and may name folders on its disk.
    experiments : sequence of Experiment
        Guided experiments to choose from.
    commons : SharedResources
        What all sessions share.
    background : BackgroundTasks
        Coroutines of the page; they end when it closes.
    most_kept : int
        So many iterations of a run can be shown.
    most_studies : int or None
        So many studies run at once on this server; None sets no limit.
    """

    pool: Executor
    query: dict[str, Any]
    post: Callable[[Callable[[], None]], Any]
    watched: Callable[[], bool]
    own_folder: bool = True
    experiments: Sequence[Experiment] = field(default_factory=shipped_experiments)
    commons: SharedResources = field(default_factory=SharedResources)
    background: BackgroundTasks = field(default_factory=BackgroundTasks)
    most_kept: int = MAX_KEPT
    most_studies: int | None = None


class PageBase(Protocol):
    """A page of the program; the server makes one for every visit."""

    def page(self) -> Any:
        """Return the whole page."""

    def start(self) -> None:
        """Begin; called when the page has been drawn."""

    def close(self) -> None:
        """Stop for good: the browser has left."""


def links(here: str) -> Any:
    """Return the links of the header to the other pages.

    They take the settings along: what a page does not understand plays no part there.
    """
    anchors = "".join(
        f'<a href="{page.address}" onclick="this.search=location.search">{page.name}</a>'
        for page in PAGES.values()
        if page.address != here
    )
    return pn.pane.HTML(
        f'<nav aria-label="Pages">{anchors}</nav>',
        margin=(0, 6, 0, 12),
        align="center",
        stylesheets=[stylesheet("header")],
    )


def page_frame(
    *,
    here: str,
    title: str,
    description: str,
    status: Any,
    sidebar: Any,
    main: Any,
    tools: Sequence[Any] = (),
) -> Any:
    """Return a page with header, side bar and main part.

    Parameters
    ----------
    here : str
        Address of the page itself, a key of `vsep_app.pages.PAGES`.
    title, description : str
        For the header and for search engines.
    status : Viewable
        Stands at the right of the header.
    sidebar : list
        Controls.
    main : Viewable
        Everything else.
    tools : sequence of Viewable
        Buttons of the header, left of the status.
    """
    guidance = Help([*sidebar, main])
    status.param.update(align="center", stylesheets=[stylesheet("header")])
    document = pn.state.curdoc
    if document is not None:
        document.js_on_event("document_ready", CustomJS(code=_CLOSE_SIDE_BAR))
        write_styles_once(document)
    page = pmu.Page(
        title=title,
        sidebar_width=292,
        sidebar_resizable=False,
        sidebar_variant="auto",
        busy_indicator=None,
        header=[links(here), guidance.button, pn.HSpacer(), *tools, status],
        sidebar=sidebar,
        main=[main, guidance.dialog],
        theme_config=theme(),
        meta_description=description,
    )
    # Every page is told whenever anybody's event is at work, and looks through all its models each
    # time: tens of milliseconds a page. Nothing here shows it.
    with edit_readonly(page):
        page.busy = False
    return page
