"""Settings in the address of the page: reading a link, and saying what of it cannot be used.

A link names only what it changes. What it does not name keeps the value of its preset.
"""

import json
import math
from collections.abc import Mapping
from typing import Any

import param

from vsep.errors import shown
from vsep.presets.registry import DEFAULT_PRESET, PRESETS
from vsep_app.model.settings import LOADED_FRAME, SETTINGS, Settings, preset_values

ITERATION_KEY = "iteration"
"""Where a paused run was; not a setting, so that only `parse_iteration` reads it."""
QUERY_NAMES = {name: record.key for name, record in SETTINGS.items()}


def parse_query(query: Mapping[str, Any]) -> tuple[dict[str, Any], list[str]]:
    """Return the usable settings of a link and one sentence for each value that is not.

    Parameters
    ----------
    query : mapping
        Decoded query of the address: names to text or JSON values.

    Examples
    --------
    >>> parse_query({"snr": "12", "sir": "loud"})
    ({'snr_db': 12.0}, ['sir is loud; it must be a number between -50 and 40.'])
    """
    values: dict[str, Any] = {}
    errors: list[str] = []
    preset = str(query.get("preset", DEFAULT_PRESET))
    if preset == LOADED_FRAME:
        errors.append("A link cannot carry a loaded frame; load its file again.")
        query = {key: value for key, value in query.items() if key != "preset"}
    elif preset in PRESETS and "preset" in query:
        values.update(preset_values(preset))
    for name, key in QUERY_NAMES.items():
        if key not in query:
            continue
        parameter = Settings.param[name]
        try:
            values[name] = _parse(parameter, query[key])
        except ValueError:
            errors.append(f"{key} is {as_given(query[key])}; it must be {_allowed(parameter)}.")
    ranges = PRESETS[values.get("preset", DEFAULT_PRESET)].ranges()
    for name, (lowest, highest) in ranges.items():
        if name in values and not lowest <= values[name] <= highest:
            errors.append(
                f"{QUERY_NAMES[name]} is {values.pop(name):g}; "
                f"it must be a number between {lowest:g} and {highest:g}."
            )
            if "preset" in values:
                values[name] = preset_values(values["preset"])[name]
    return values, errors


def parse_iteration(query: Mapping[str, Any]) -> tuple[int | None, list[str]]:
    """Return the iteration that a link names, None where it names none, and what is wrong with it.

    Examples
    --------
    >>> parse_iteration({"iteration": "4"}), parse_iteration({})
    ((4, []), (None, []))
    """
    if ITERATION_KEY not in query:
        return None, []
    value, highest = as_given(query[ITERATION_KEY]), Settings.param.max_iterations.bounds[1]
    if value.isdecimal() and len(value) <= len(str(highest)) and int(value) <= highest:
        return int(value), []
    wrong = f"{ITERATION_KEY} is {value}; it must be a whole number between 0 and {highest}."
    return None, [wrong]


def as_given(value: Any) -> str:
    """Return a value as an address has it, without quotes; a long one is shortened."""
    return shown(value).strip("'\"") if isinstance(value, str) else shown(value)


def _parse(parameter: Any, value: Any) -> Any:
    """Return a value the parameter accepts; everything else is a ValueError."""
    try:
        if isinstance(value, str) and not isinstance(parameter, param.Selector | param.String):
            value = json.loads(value.lower() if isinstance(parameter, param.Boolean) else value)
        if value is None and parameter.allow_None:
            return None
        if isinstance(parameter, param.Number):
            value = _number(value, whole=isinstance(parameter, param.Integer))
        elif isinstance(parameter, param.Boolean) and value in (0, 1):
            value = bool(value)
        Settings(**{parameter.name: value})
    except (TypeError, OverflowError, RecursionError) as error:
        raise ValueError(str(error)) from error
    return value


def _number(value: Any, *, whole: bool) -> float | int:
    number = float(value)
    if isinstance(value, bool) or not math.isfinite(number):
        raise ValueError(f"{value} is no number")
    if not whole:
        return number
    if not number.is_integer():
        raise ValueError(f"{value} is no whole number")
    return int(number)


def _allowed(parameter: Any) -> str:
    if isinstance(parameter, param.Selector):
        return "one of " + ", ".join(str(choice) for choice in parameter.objects)
    if isinstance(parameter, param.Boolean):
        return "true or false"
    if isinstance(parameter, param.String):
        return "a text as 12,1.5,0; 20,0,-6"
    lowest, highest = parameter.bounds
    kind = "a whole number" if isinstance(parameter, param.Integer) else "a number"
    empty = ", or null" if parameter.allow_None else ""
    return f"{kind} between {lowest:g} and {highest:g}{empty}"
