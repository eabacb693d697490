"""The address of the open page: it follows the settings, so that it can be shared at any time."""

from collections.abc import Callable
from typing import Any
from urllib.parse import parse_qsl, urlencode

import panel as pn

from vsep_app.jobs.run_session import Phase
from vsep_app.model.settings import Settings
from vsep_app.model.url import ITERATION_KEY, QUERY_NAMES, parse_query


def read_query() -> dict[str, str]:
    """Return the query of the address of this session's page, as it stands there."""
    location = pn.state.location
    return {} if location is None else dict(parse_qsl(location.search[1:]))


def set_query(key: str, value: str | None) -> None:
    """Set one value in the address of this session's page, None takes it out."""
    location = pn.state.location
    if location is not None:
        query = {name: held for name, held in read_query().items() if name != key}
        added = {} if value is None else {key: value}
        location.search = "?" + urlencode({**query, **added})


def synchronise(settings: Settings, notify_error: Callable[[str], None]) -> None:
    """Keep the address of the page in step with the settings, from now on.

    The browser's own address wins while a page is loading, so this comes after.
    """
    location = pn.state.location
    if location is None:
        return

    def refuse(values: dict[str, Any]) -> None:
        query = {QUERY_NAMES[name]: value for name, value in values.items()}
        for error in parse_query(query)[1]:
            notify_error(error)

    location.search = ""
    location.sync(settings, dict(QUERY_NAMES), on_error=refuse)


class SharedIteration:
    """Keeps the iteration of a halted run in the address.

    A run that goes on, or has ended, has none: for whoever opens the address it goes to its end.
    """

    def __init__(self) -> None:
        self._written: str | None = None

    def write(self, phase: Phase, iteration: int) -> None:
        """Take note of what is drawn."""
        halted = phase in (Phase.PAUSED, Phase.IDLE)
        value = str(iteration) if halted else None
        if value != self._written:
            self._written = value
            set_query(ITERATION_KEY, value)
