"""Options of simulated scenes: one for every setting of the registry `vsep.parameters`."""

import argparse
from collections.abc import Mapping
from typing import Any, Final

from vsep._validation import require_range
from vsep.parameters import FILTER_PARAMETERS, FILTER_PARTS, PARAMETERS, SCENE_PARAMETERS
from vsep.parameters.record import Parameter
from vsep_app.cli.shared_options import (
    given,
    integer,
    option_of,
    refuse_unused,
    refuse_without_interference,
)

_SWITCHED_OFF = "interference"
_IMPLIED = "assume_true_filter"  # off where a filter that is assumed is given
ASSUMED: Final = tuple(each.name for each in FILTER_PARAMETERS if each.name.startswith("assumed_"))
"""Options of the filter that the estimator assumes."""
SCENE_OPTIONS: Final = tuple(
    each.name
    for each in (*SCENE_PARAMETERS, *FILTER_PARAMETERS)
    if each.name not in (_SWITCHED_OFF, _IMPLIED)
)
"""Options that are settings of a scene; None or False where they are not given."""


def add_scene_options(parser: Any, of_what: str) -> None:
    """Add the options; what is not given stays as the preset or the link has it."""
    groups = (
        ("the scene", f"Of {of_what}.", SCENE_PARAMETERS),
        (
            "the anti-aliasing filter",
            "The true one, and the one that is assumed: by default the true one.",
            FILTER_PARAMETERS,
        ),
    )
    for title, about, records in groups:
        group = parser.add_argument_group(title, about)
        for record in records:
            if record.name == _SWITCHED_OFF:
                text = "leave the interferer out; objects and noise stay the same"
                group.add_argument("--no-interference", action="store_true", help=text)
            elif record.name != _IMPLIED:
                group.add_argument(option_of(record.name), **_kind_of(record))


def _kind_of(record: Parameter) -> dict[str, Any]:
    """Return what `add_argument` takes for a setting."""
    text = record.help.replace("%", "%%")
    if record.unit not in text:
        text += f" In {record.unit}."
    if isinstance(record.default, bool):
        return {"action": "store_true", "help": text}
    if record.choices is not None:
        choices = [name for name in record.choices if name != "measured"]  # which a file brings
        return {"choices": choices, "help": text}
    if record.whole:
        lowest, highest = map(int, record.bounds)
        return {"type": integer(lowest, highest), "metavar": "N", "help": text}
    return {"type": float, "metavar": "X", "help": text}


def scene_values(options: argparse.Namespace, current: Mapping[str, Any]) -> dict[str, Any]:
    """Return the settings of the scene that were given, by their names in the registry.

    Parameters
    ----------
    options : argparse.Namespace
        With all options of `add_scene_options`.
    current : mapping
        What the settings are otherwise: interference, filter_kind and assumed_kind.

    Raises
    ------
    InputError
        If a number is out of its range, or a setting means nothing beside the others.
    """
    values = given(options, SCENE_OPTIONS)
    if options.no_interference or not current[_SWITCHED_OFF]:
        silent = [record.name for record in SCENE_PARAMETERS if record.of_bursts]
        refuse_without_interference(given(options, silent))
    for name, value in values.items():
        record = PARAMETERS[name]
        if isinstance(value, float):
            require_range(record.title, value, *record.bounds, record.unit)
    for which in ("filter", "assumed"):
        kind = f"{which}_kind"
        parts = {name: value for name, value in values.items() if name.startswith(f"{which}_")}
        parts.pop(kind, None)
        takers = {
            option_of(kind) + " " + each: frozenset(f"{which}_{part}" for part in names)
            for each, names in FILTER_PARTS.items()
            if each != "measured"
        }
        refuse_unused(parts, (f"{option_of(kind)} {values.get(kind, current[kind])}",), takers)
    if options.no_interference:
        values[_SWITCHED_OFF] = False
    if given(options, ASSUMED):
        values[_IMPLIED] = False
    return values
