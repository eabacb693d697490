"""The pages of the dashboard.

A page is added by its module and one entry. Classes are loaded when the server starts, so that
links and titles cost nothing.
"""

from importlib import import_module
from typing import Any, Final, NamedTuple


class PageEntry(NamedTuple):
    """A page."""

    address: str  #: Relative to the program's own; "./" is the first page.
    name: str  #: In the links of the header.
    title: str  #: Of the browser's window and for those who hear it.
    source: str  #: Module below this package and class, which makes it for a `PageContext`.

    @property
    def route(self) -> str:
        """Path that the server answers."""
        return "/" + self.address.removeprefix("./")

    def load(self) -> Any:
        """Return the class that makes the page."""
        module, name = self.source.split(":")
        return getattr(import_module(f"{__name__}.{module}"), name)


PAGES: Final[dict[str, PageEntry]] = {
    page.address: page
    for page in (
        PageEntry("./", "Live view", "vsep: objects out of interference", "live:Dashboard"),
        PageEntry(
            "street", "Street", "vsep: a street, frame after frame", "street.page:StreetPage"
        ),
        PageEntry("compare", "Compare", "vsep: compare methods", "compare.page:ComparePage"),
        PageEntry(
            "separability",
            "Separability",
            "vsep: separability",
            "separability.page:SeparabilityPage",
        ),
        PageEntry("recording", "Recording", "vsep: recorded data", "recording.page:RecordingPage"),
        PageEntry("studies", "Studies", "vsep: studies", "studies.page:StudyPage"),
    )
}
"""All pages by address, in the order of the header."""

APART: Final[dict[str, PageEntry]] = {
    page.address: page
    for page in (
        PageEntry("lead", "Lead", "vsep: the lesson", "lead:LeadPage"),
        PageEntry("embed", "Embedded view", "vsep: one view", "embed:EmbedPage"),
    )
}
"""Pages that no header links to: the lecturer's, and the one that stands in other pages."""

LEAD = APART["lead"]
EMBED = APART["embed"]
