"""Time of the parts of a step, marked by the step and measured by the runner.

Marking costs a microsecond and changes nothing that a step returns.
"""

from collections.abc import Iterable, Mapping
from contextvars import ContextVar

from vsep.kernels.clock import computing_s

SEARCH = "burst search"
BURSTS = "bursts and channels"
OBJECTS = "objects"
REST = "the rest"

_seconds: ContextVar[dict[str, float] | None] = ContextVar("seconds by part", default=None)


class stopwatch:  # noqa: N801  as `part`
    """Collect the seconds of every part that is marked meanwhile.

    Examples
    --------
    >>> with stopwatch() as seconds:
    ...     with part(OBJECTS):
    ...         pass
    >>> list(seconds)
    ['objects']
    """

    __slots__ = ("_token",)

    def __enter__(self) -> dict[str, float]:
        """Begin with nothing."""
        seconds: dict[str, float] = {}
        self._token = _seconds.set(seconds)
        return seconds

    def __exit__(self, *_: object) -> None:
        """Hand over to the stopwatch around this one, if there is one."""
        _seconds.reset(self._token)


class part:  # noqa: N801  used as a word of the language, `with part(OBJECTS):`
    """Mark a part of a step; without a stopwatch nothing is kept."""

    __slots__ = ("name", "start")

    def __init__(self, name: str) -> None:
        self.name = name

    def __enter__(self) -> None:
        """Begin the part."""
        self.start = computing_s()

    def __exit__(self, *_: object) -> None:
        """Add its seconds."""
        seconds = _seconds.get()
        if seconds is not None:
            spent = computing_s() - self.start
            seconds[self.name] = seconds.get(self.name, 0.0) + spent


def with_rest(parts: Mapping[str, float], seconds: float) -> dict[str, float]:
    """Name what the parts of a step leave of its whole time.

    Examples
    --------
    >>> with_rest({"objects": 0.75}, 1.0)
    {'objects': 0.75, 'the rest': 0.25}
    """
    return {**parts, REST: max(seconds - sum(parts.values()), 0.0)}


def summed(steps: Iterable[Mapping[str, float]]) -> dict[str, float]:
    """Add the parts of several steps up.

    Examples
    --------
    >>> summed([{"objects": 0.25}, {"objects": 0.5, "the rest": 1.0}])
    {'objects': 0.75, 'the rest': 1.0}
    """
    total: dict[str, float] = {}
    for parts in steps:
        for name, seconds in parts.items():
            total[name] = total.get(name, 0.0) + seconds
    return total
