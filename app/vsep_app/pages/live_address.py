"""Addresses of the live page: what opens where they say nothing, and the run that they name."""

from collections.abc import Mapping
from typing import Any

from vsep_app.jobs.frame_store import FRAME_KEY
from vsep_app.model.settings import Plan, Settings
from vsep_app.model.trial_link import TRIAL_KEY
from vsep_app.model.url import ITERATION_KEY, QUERY_NAMES, parse_query
from vsep_app.teaching.experiment import EXPERIMENT_KEY

START_QUERY = {"preset": "simulation-2-b", ITERATION_KEY: "0"}
"""Of an address that names nothing."""
_OF_PLANS = {*QUERY_NAMES.values(), ITERATION_KEY, "theme"}


def with_start(query: Mapping[str, Any]) -> dict[str, Any]:
    """Return the query of an address; of one that says nothing, that of the start scene.

    Examples
    --------
    >>> with_start({"theme": "dark"})["preset"], with_start({"seed": "3"})
    ('simulation-2-b', {'seed': '3'})
    """
    named = {*QUERY_NAMES.values(), ITERATION_KEY, TRIAL_KEY, FRAME_KEY, EXPERIMENT_KEY}
    return dict(query) if named & query.keys() else {**START_QUERY, **query}


def plan_of_query(query: Mapping[str, Any]) -> Plan | None:
    """Return the plan that an address opens by its settings alone, None for any other."""
    asked = with_start(query)
    if asked.keys() - _OF_PLANS:
        return None
    values, errors = parse_query(asked)
    return None if errors else Settings(**values).plan()
