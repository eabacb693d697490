"""Errors that a caller can mend."""

from typing import Final

_MOST: Final = 80  # characters of a value in a sentence


class InputError(ValueError):
    """What the caller handed over cannot be used; the message names the value and the range."""


def shown(value: object) -> str:
    """Write a value as it was given, of any size and kind, on one short line; arrays by shape.

    Examples
    --------
    >>> shown("loud"), shown("a" * 1000)[-8:], shown(10**5000)
    ("'loud'", "aaaa...'", 'a number of thousands of digits')
    """
    if isinstance(value, str):
        return repr(value) if len(value) <= _MOST else repr(value[:_MOST] + "...")
    if getattr(value, "shape", ()):
        return f"an array of shape {getattr(value, 'shape', ())}"
    try:
        text = repr(value)
    except ValueError:  # Python writes no longer ones than 4,300 digits
        return "a number of thousands of digits"
    except RecursionError:
        return "a list within lists"
    return text if len(text) <= _MOST else text[:_MOST] + "..."
