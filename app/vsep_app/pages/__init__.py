"""The pages of the program: address, name, title, and the class that makes each.

A page is added by its module and one entry. Classes are loaded when the server starts, so that
links and titles cost nothing.
"""

from dataclasses import dataclass
from importlib import import_module
from typing import Any, Final


@dataclass(frozen=True, kw_only=True, slots=True)
class PageEntry:
    """A page.

    Parameters
    ----------
    address : str
        Relative to the program's own; "./" is the first page.
    name : str
        In the links of the header.
    title : str
        Of the browser's window and for those who hear it.
    module, class_name : str
        What makes it for a `vsep_app.pages.base.PageContext`.
    """

    address: str
    name: str
    title: str
    module: str
    class_name: str

    @property
    def route(self) -> str:
        """Path that the server answers."""
        return "/" + self.address.removeprefix("./")

    def load(self) -> Any:
        """Return the class that makes the page."""
        return getattr(import_module(self.module), self.class_name)


PAGES: Final[dict[str, PageEntry]] = {
    page.address: page
    for page in (
        PageEntry(
            address="./",
            name="Live view",
            title="vsep: objects out of interference",
            module="vsep_app.pages.live",
            class_name="Dashboard",
        ),
        PageEntry(
            address="compare",
            name="Compare",
            title="vsep: compare methods",
            module="vsep_app.pages.compare.page",
            class_name="ComparePage",
        ),
        PageEntry(
            address="separability",
            name="Separability",
            title="vsep: separability",
            module="vsep_app.pages.separability.page",
            class_name="SeparabilityPage",
        ),
        PageEntry(
            address="recording",
            name="Recording",
            title="vsep: recorded data",
            module="vsep_app.pages.recording.page",
            class_name="RecordingPage",
        ),
        PageEntry(
            address="studies",
            name="Studies",
            title="vsep: studies",
            module="vsep_app.pages.studies.page",
            class_name="StudyPage",
        ),
    )
}
"""All pages by address, in the order of the header."""
