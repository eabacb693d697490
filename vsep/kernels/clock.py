"""Clock of what is computed, which stands still while kernels are compiled, and who is told so."""

import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Final

listeners: Final[set[Callable[[str], object]]] = set()
"""Told the name of a kernel before it is compiled, and an empty one after it."""


class _Clock(threading.local):
    not_counted_s = 0.0


_clock = _Clock()


def computing_s() -> float:
    """Return the seconds of a clock that stands still while this thread compiles a kernel."""
    return time.perf_counter() - _clock.not_counted_s


@contextmanager
def not_counted() -> Iterator[None]:
    """Hold the clock of this thread."""
    began = computing_s()
    try:
        yield
    finally:
        _clock.not_counted_s += computing_s() - began
