"""Variational separation of object signals and mutual interference of automotive FMCW radars.

The public names stand in ``__init__.pyi``, once, for type checkers, editors and this module alike,
one line ``from module import name as name`` each. They are loaded when they are first used:
importing the package alone costs next to nothing.
"""

from importlib import import_module
from typing import Any

with open(f"{__path__[0]}/__init__.pyi", encoding="utf-8") as _stub:
    _LINES = [line.split() for line in _stub if line.startswith("from ")]
_HOMES = {name: module for _, module, _, name, *_ in _LINES}
__all__ = sorted(_HOMES)  # noqa: PLE0605


def __getattr__(name: str) -> Any:
    """Load a public name from its module, the first time that it is asked for."""
    if name not in _HOMES:
        raise AttributeError(f"module 'vsep' has no attribute {name!r}")
    value = getattr(import_module(_HOMES[name]), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
