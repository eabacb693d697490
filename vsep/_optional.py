"""Libraries that only some tasks need, loaded when they are used."""

from importlib import import_module
from typing import Any

from vsep.errors import InputError


def require_library(name: str, purpose: str, extra: str) -> Any:
    """Return an optional library; `InputError` says what to install where it is missing.

    Parameters
    ----------
    name : str
        Its import name.
    purpose : str
        What it is needed for, as the subject of a sentence.
    extra : str
        The extra of this project that installs it.

    Examples
    --------
    >>> require_library("json", "This example", "none").loads("[1]")
    [1]
    """
    try:
        return import_module(name)
    except ModuleNotFoundError as error:
        if error.name != name.split(".", maxsplit=1)[0]:
            raise
        sentence = f"{purpose} needs {name.split('.', maxsplit=1)[0]}: pip install 'vsep[{extra}]'."
        raise InputError(sentence) from None
