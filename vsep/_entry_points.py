"""Entry points: what other installed distributions add to a group such as ``vsep.mitigations``."""

from collections import Counter
from functools import cache
from importlib.metadata import EntryPoint, entry_points
from typing import Any, NamedTuple

from vsep.errors import InputError


class _Group(NamedTuple):
    """Objects of a group by name, and one sentence for each that cannot be used."""

    objects: dict[str, Any]
    errors: dict[str, str]


def load_entries(group: str) -> dict[str, Any]:
    """Return the objects of a group of entry points by name; those that fail to load are left out.

    They are loaded at the first call and kept.

    Parameters
    ----------
    group : str
        For example ``"vsep.estimators"``.

    Examples
    --------
    >>> load_entries("vsep.no_such_group")
    {}
    """
    return dict(_load(group).objects)


def require_loadable(group: str, name: str) -> None:
    """Raise `InputError` where an entry point of this name exists but cannot be loaded."""
    error = _load(group).errors.get(name)
    if error is not None:
        raise InputError(error)


@cache
def _load(group: str) -> _Group:
    found = sorted(entry_points(group=group), key=lambda point: point.name)
    counts = Counter(point.name for point in found)
    objects: dict[str, Any] = {}
    errors: dict[str, str] = {}
    for point in found:
        if counts[point.name] > 1:
            errors[point.name] = f"{counts[point.name]} entry points of {group} are named "
            errors[point.name] += f"{point.name}; a name must be given once."
            continue
        try:
            objects[point.name] = point.load()
        except Exception as error:  # whatever another distribution runs into when it is imported
            errors[point.name] = (
                f"{point.name} of {_distribution(point)} ({group}: {point.value}) cannot be "
                f"loaded: {type(error).__name__}: {error}."
            )
    return _Group(objects, errors)


def _distribution(point: EntryPoint) -> str:
    return "an unnamed distribution" if point.dist is None else point.dist.name
