"""Words of an address that lock and hide parts of the live page, as an experiment's file does.

`?lock=sir,seed&hide=delay,estimator` locks two controls and hides a view and a control. What is
hidden is locked, too: the server refuses what a browser says of it.
"""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from vsep_app.model.url import QUERY_NAMES, as_given
from vsep_app.teaching.staging import HIDDEN_PARTS, Staging

LOCK_KEY, HIDE_KEY = "lock", "hide"
STAGE_KEYS = (LOCK_KEY, HIDE_KEY)
_NAMES = {key: name for name, key in QUERY_NAMES.items()}


def with_words(staging: Staging, query: Mapping[str, Any]) -> tuple[Staging, list[str]]:
    """Return a staging with what an address locks and hides, and a sentence for each bad word.

    Examples
    --------
    >>> staging, errors = with_words(Staging(), {"lock": "sir", "hide": "delay,seed,sea"})
    >>> staging.lock, staging.hide
    (('sir_db',), ('delay', 'seed'))
    >>> errors
    ['hide has sea; it may have settings of the address, and chirps, fast_time, delay, maps, \
tables, toolbar.']
    """
    locked, wrong = _read(query, LOCK_KEY, ())
    hidden, more = _read(query, HIDE_KEY, HIDDEN_PARTS)
    both = replace(staging, lock=(*staging.lock, *locked), hide=(*staging.hide, *hidden))
    return both, wrong + more


def words_of(query: Mapping[str, Any]) -> dict[str, str]:
    """Return the part of a query that locks and hides."""
    return {key: str(query[key]) for key in STAGE_KEYS if key in query}


def _read(
    query: Mapping[str, Any], key: str, parts: tuple[str, ...]
) -> tuple[tuple[str, ...], list[str]]:
    """Return the settings and parts that a list in an address names, and what of it is wrong."""
    names, errors = [], []
    for word in str(query.get(key, "")).split(","):
        if word in parts:
            names.append(word)
        elif word in _NAMES:
            names.append(_NAMES[word])
        elif word:
            allowed = f", and {', '.join(parts)}" if parts else ""
            errors.append(
                f"{key} has {as_given(word)}; it may have settings of the address{allowed}."
            )
    return tuple(dict.fromkeys(names)), errors
