"""Settings as a text that a person edits: lines of name: value, as in a YAML file."""

import re
from collections.abc import Mapping
from typing import Any

from vsep.errors import InputError
from vsep.recordings.settings import settings_values

_NAME = "settings.yaml"


def settings_text(values: Mapping[Any, Any]) -> str:
    r"""Return names and values as lines; what has no value is left to be filled in.

    Examples
    --------
    >>> settings_text({"format": "npy", "slope_hz_per_s": 3e13, "num_ramps": None})
    'format: npy\nslope_hz_per_s: 3e+13\nnum_ramps:\n'
    """
    return "".join(f"{_line(name, value)}\n" for name, value in values.items())


def values_of(text: str) -> dict[Any, Any]:
    """Return what the lines say.

    Raises `InputError` if they are no lines of name: value.

    Examples
    --------
    >>> values_of("format: npy  # as exported")
    {'format': 'npy'}
    """
    try:
        return settings_values(_NAME, text)
    except InputError as error:
        raise InputError(f"The settings cannot be read: {error}") from error


def with_value(text: str, name: str, value: Any) -> str:
    r"""Return the text with one value set anew; everything else stays as it was written.

    Raises `InputError` if the text cannot be read.

    Examples
    --------
    >>> with_value("format: npy\nsign: positive\n", "sign", "negative")
    'format: npy\nsign: negative\n'
    """
    values = values_of(text) if text.strip() else {}
    line = re.compile(rf"^{re.escape(name)}[ \t]*:.*$", flags=re.MULTILINE)
    new = _line(name, value)
    changed = line.sub(lambda _: new, text) if line.search(text) else _appended(text, new)
    wanted = values | {name: value}
    try:
        if values_of(changed) == wanted:
            return changed
    except InputError:
        pass
    # Not in plain lines, for instance all in braces.
    return settings_text(wanted)


def _appended(text: str, line: str) -> str:
    lead = text if not text or text.endswith("\n") else f"{text}\n"
    return f"{lead}{line}\n"


def _line(name: Any, value: Any) -> str:
    if value is None:
        return f"{name}:"
    if isinstance(value, float):
        short = f"{value:g}"
        value = short if float(short) == value else repr(value)
    return f"{name}: {value}"
