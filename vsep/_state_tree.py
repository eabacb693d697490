"""All that a state holds, walked from record to record, and compared to the last bit."""

from collections.abc import Iterator, Mapping
from dataclasses import fields, is_dataclass
from enum import Enum
from types import BuiltinFunctionType, FunctionType
from typing import Any

import numpy as np

_ATOMS = (
    np.ndarray,
    np.dtype,
    np.generic,
    Enum,
    type,
    FunctionType,
    BuiltinFunctionType,
    str,
    bytes,
)


def leaves(
    value: Any, path: str = "state", *, into_mutable: bool = True
) -> Iterator[tuple[str, Any]]:
    """Yield a value and all that it holds, with where it is."""
    yield path, value
    parts: list[tuple[str, Any]] = []
    if isinstance(value, _ATOMS):
        return
    if isinstance(value, Mapping):
        parts = [(f"[{key!r}]", each) for key, each in value.items()] if into_mutable else []
    elif isinstance(value, tuple | list):
        into = into_mutable or isinstance(value, tuple)
        parts = [(f"[{index}]", each) for index, each in enumerate(value)] if into else []
    elif is_dataclass(value):
        parts = [(f".{field.name}", getattr(value, field.name)) for field in fields(value)]
    elif hasattr(value, "__dict__"):
        parts = [(f".{key}", each) for key, each in vars(value).items()]
    for suffix, each in parts:
        yield from leaves(each, path + suffix, into_mutable=into_mutable)


def first_difference(first: Any, second: Any, path: str = "state") -> str | None:
    """Return where two values differ in a bit; None where they do not."""
    one, other = list(leaves(first, path)), list(leaves(second, path))
    for (where, value), (elsewhere, twin) in zip(one, other, strict=False):
        if where != elsewhere or type(value) is not type(twin) or not _is_equal(value, twin):
            return where
    return None if len(one) == len(other) else path


def _is_equal(value: Any, twin: Any) -> bool:
    if isinstance(value, np.ndarray):
        same = value.dtype == twin.dtype and value.shape == twin.shape
        return bool(same) and value.tobytes() == twin.tobytes()
    if isinstance(value, float):
        return bool(value == twin or (np.isnan(value) and np.isnan(twin)))
    if isinstance(value, int | complex | str | bytes | Enum | set):
        return bool(value == twin)
    return True  # a record: its parts are compared
