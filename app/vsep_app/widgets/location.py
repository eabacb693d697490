"""The address of a page: it follows the settings, so that it can be shared at any time."""

from collections.abc import Callable, Mapping
from typing import Any
from urllib.parse import parse_qsl, urlencode

from panel.io.location import Location

from vsep_app.jobs.run_session import Phase
from vsep_app.model.settings import Settings
from vsep_app.model.url import ITERATION_KEY, QUERY_NAMES, parse_query


def search_of(query: Mapping[str, str]) -> str:
    """Return a query as it stands in an address.

    Examples
    --------
    >>> search_of({"seed": "3"}), search_of({})
    ('?seed=3', '')
    """
    return f"?{urlencode(query)}" if query else ""


def read_query(location: Location | None) -> dict[str, str]:
    """Return the query of an address, as it stands there; without one it is empty."""
    return {} if location is None else dict(parse_qsl(location.search[1:]))


def set_query(location: Location, key: str, value: str | None) -> None:
    """Set one value in an address, None takes it out."""
    query = {name: held for name, held in read_query(location).items() if name != key}
    location.search = search_of(query if value is None else {**query, key: value}) or "?"


def synchronise(
    location: Location, settings: Settings, notify_error: Callable[[str], None]
) -> None:
    """Keep an address in step with the settings, from now on.

    The browser's own address wins while a page is loading, so this comes after.
    """

    def refuse(values: dict[str, Any]) -> None:
        query = {QUERY_NAMES[name]: value for name, value in values.items()}
        for error in parse_query(query)[1]:
            notify_error(error)

    location.search = ""
    location.sync(settings, dict(QUERY_NAMES), on_error=refuse)


class SharedIteration:
    """Keeps the iteration of a halted run in an address.

    A run that goes on, or has ended, has none: for whoever opens the address it goes to its end.
    """

    def __init__(self, location: Location) -> None:
        self._location = location
        self._written: str | None = None

    def write(self, phase: Phase, iteration: int) -> None:
        """Take note of what is drawn."""
        halted = phase in (Phase.PAUSED, Phase.IDLE)
        value = str(iteration) if halted else None
        if value != self._written:
            self._written = value
            set_query(self._location, ITERATION_KEY, value)
