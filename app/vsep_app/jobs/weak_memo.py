"""Smaller versions of records, each made once however many sessions hold the record."""

from collections.abc import Callable
from dataclasses import fields, is_dataclass
from typing import Any, Generic, TypeVar
from weakref import WeakKeyDictionary, WeakSet

import numpy as np

RecordT = TypeVar("RecordT")


class WeakMemo(Generic[RecordT]):
    """A function of a record that is called once for each; its results are left as they are.

    Parameters
    ----------
    function : callable
        Record to record; the result must not refer to its argument.

    Examples
    --------
    >>> class Record:
    ...     pass
    >>> smaller = WeakMemo(lambda record: Record())
    >>> record = Record()
    >>> smaller(record) is smaller(record) is smaller(smaller(record))
    True
    """

    def __init__(self, function: Callable[[RecordT], RecordT]) -> None:
        self._function = function
        self._results: WeakKeyDictionary[RecordT, RecordT] = WeakKeyDictionary()
        self._made: WeakSet[RecordT] = WeakSet()

    def __call__(self, record: RecordT) -> RecordT:
        """Return the smaller version."""
        if record in self._made:
            return record
        result = self._results.get(record)
        if result is None:
            result = self._results[record] = self._function(record)
            self._made.add(result)
        return result

    def made(self, record: RecordT) -> bool:
        """Whether a record is a smaller version."""
        return record in self._made


def num_bytes(value: Any) -> int:
    """Return the memory of all arrays in a record.

    Examples
    --------
    >>> num_bytes((np.zeros(3), [np.zeros(2)], "text"))
    40
    """
    if isinstance(value, np.ndarray):
        return value.nbytes
    if isinstance(value, tuple | list):
        return sum(num_bytes(one) for one in value)
    if is_dataclass(value):
        return sum(num_bytes(getattr(value, each.name)) for each in fields(value))
    return 0
