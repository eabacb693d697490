"""Methods from outside: a name, or ``module:object`` of a module on Python's path."""

from collections.abc import Callable
from importlib import import_module
from inspect import signature
from typing import Any

from vsep.errors import InputError, shown
from vsep.mitigation.direct import DirectMitigation

_REPAIR = ("received", "mask")


def read_method(text: str) -> Any:
    """Return what a text names.

    Parameters
    ----------
    text : str
        A registered name, which is returned as it is, or ``module:object``. The object is a
        function of ``received`` and ``mask`` that returns the cleaned frame; a mitigation method or
        an estimator as a class, an entry or an instance; see `vsep.studies.methods.read_methods`.

    Raises
    ------
    InputError
        If the module cannot be imported or has no such object.

    Examples
    --------
    >>> read_method("zeroing"), read_method("vsep.mitigation.blanking:zeroed").name
    ('zeroing', 'zeroed')
    """
    module, colon, name = text.partition(":")
    if not colon:
        return text
    try:
        found: Any = import_module(module)
        for part in name.split("."):
            found = getattr(found, part)
    except Exception as error:  # whatever a module of somebody else runs into
        raise InputError(
            f"method is {shown(text)}, which cannot be loaded: {type(error).__name__}: {error}."
        ) from error
    return DirectMitigation(found.__name__, found) if _is_repair(found) else found


def _is_repair(given: Callable[..., Any]) -> bool:
    """Whether this is a function that takes a frame with its mask and returns the cleaned one."""
    if isinstance(given, type) or not callable(given) or hasattr(given, "step"):
        return False
    return tuple(signature(given).parameters)[:2] == _REPAIR
