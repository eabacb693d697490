"""What every page of the program has in common: the visit, the pages there are, and their frame."""

from collections.abc import Callable
from concurrent.futures import Executor
from dataclasses import dataclass
from typing import Any, Protocol

import panel as pn
import panel_material_ui as pmu

from app.layout import theme

# Address and name of each page, in the order of the header.
PLACES = {
    "./": "Live view",
    "compare": "Compare",
    "laboratory": "Laboratory",
    "studies": "Studies",
}


@dataclass(frozen=True, kw_only=True)
class Visit:
    """What a page knows of the browser that opened it.

    Parameters
    ----------
    pool : Executor
        Does the work of all sessions.
    query : dict
        Decoded query of the page's address.
    post : callable
        Runs a function on the event loop with the document locked.
    watched : callable
        Whether the browser is still connected.
    own_folder : bool
        Whether the visitor sits at this machine and may name folders on its disk.
    """

    pool: Executor
    query: dict[str, Any]
    post: Callable[[Callable[[], None]], Any]
    watched: Callable[[], bool]
    own_folder: bool = True


class VisitedPage(Protocol):
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
        f'<a href="{address}" onclick="this.search=location.search" '
        f'style="color:white;font-size:13px;margin-right:20px;white-space:nowrap">{name}</a>'
        for address, name in PLACES.items()
        if address != here
    )
    return pn.pane.HTML(f'<nav aria-label="Pages">{anchors}</nav>', margin=(0, 12))


def page_frame(
    *, here: str, title: str, description: str, status: Any, sidebar: Any, main: Any
) -> Any:
    """Return a page with header, side bar and main part.

    Parameters
    ----------
    here : str
        Address of the page itself, a key of `PLACES`.
    title, description : str
        For the header and for search engines.
    status : Viewable
        Stands at the right of the header.
    sidebar : list
        Controls.
    main : Viewable
        Everything else.
    """
    return pmu.Page(
        title=title,
        sidebar_width=292,
        sidebar_resizable=False,
        sidebar_variant="persistent",
        busy_indicator=None,
        header=[links(here), pn.HSpacer(), status],
        sidebar=sidebar,
        main=[main],
        theme_config=theme(),
        meta_description=description,
    )
