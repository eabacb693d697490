"""Progress of long commands on the terminal; none is drawn where tqdm is not installed.

The number of iterations of a run is known when it has ended, not before. The bar of iterations is
therefore full at the maximum, shows no remaining time and may stop before it; beside it stands what
has been found by then.
"""

import sys
from collections.abc import Iterable, Iterator
from contextlib import closing
from importlib import import_module
from importlib.util import find_spec
from typing import Any, Final, TextIO

from vsep.inference.core.progress import Step
from vsep.units import to_db

DELAY_S: Final = 1.0  # a run that is over sooner shows none
INTERVAL_S: Final = 0.1
_LINE: Final = "{desc}: {n_fmt} of at most {total_fmt} iterations |{bar}| {elapsed}{postfix}"


class _NoBar:
    """A bar that draws nothing."""

    disable = True

    def __init__(self, iterable: Iterable[Any] = (), **_: Any) -> None:
        self._iterable = iterable

    def __iter__(self) -> Iterator[Any]:
        return iter(self._iterable)

    def update(self, _: int) -> None:
        pass

    def close(self) -> None:
        pass

    @staticmethod
    def write(text: str, file: TextIO) -> None:
        file.write(text + "\n")


def _bar_class() -> Any:
    return import_module("tqdm").tqdm if find_spec("tqdm") is not None else _NoBar


def counted(lines: Iterable[Any], total: int, unit: str) -> Iterator[Any]:
    """Yield what is given; the terminal shows how many of the total have been, if several."""
    # tqdm draws nothing by itself (None) where standard error is no terminal.
    yield from _bar_class()(lines, total=total, unit=unit, disable=None if total > 1 else True)


def counter(total: int, unit: str, done: int = 0) -> "closing[Any]":
    """Return a context whose value has ``update(number)`` for what has been done since."""
    return closing(_bar_class()(total=total, initial=done, unit=unit, disable=None))


def say(sentence: str) -> None:
    """Write a line to standard error, above the bar if there is one."""
    _bar_class().write(f"vsep: {sentence}", file=sys.stderr)


class IterationProgress:
    """One bar for the frames that this process separates, one after the other.

    Parameters
    ----------
    max_iterations : int
        Where a run stops at the latest.
    stream : text stream, optional
        Standard error by default. Nothing is written where it is no terminal.
    delay_s : float
        How long a run must take before its bar is drawn.
    interval_s : float
        How long it then stands still at least.

    Examples
    --------
    >>> import io
    >>> bar = IterationProgress(100, stream=io.StringIO())
    >>> bar.begin("frame.npz")
    >>> bar.end()
    """

    def __init__(
        self,
        max_iterations: int,
        *,
        stream: TextIO | None = None,
        delay_s: float = DELAY_S,
        interval_s: float = INTERVAL_S,
    ) -> None:
        self._max_iterations, self._delay_s, self._interval_s = max_iterations, delay_s, interval_s
        self._stream = sys.stderr if stream is None else stream
        self._bar: Any = None

    def begin(self, name: str) -> None:
        """Begin a frame."""
        self.end()
        self._bar = _bar_class()(
            total=self._max_iterations,
            desc=name,
            bar_format=_LINE,
            file=self._stream,
            disable=None,
            delay=self._delay_s,
            mininterval=self._interval_s,
            leave=False,
        )

    def show(self, step: Step) -> None:
        """Show an iteration of the frame: its number, and what has been found."""
        if self._bar is None or self._bar.disable:
            return
        state = step.state
        noise_db = -float(to_db(state.noise_precision))
        self._bar.set_postfix_str(
            f"{state.objects.num_components} objects, {len(state.bursts)} bursts, "
            f"unexplained {noise_db:.1f} dB a sample",
            refresh=False,
        )
        self._bar.update(state.iteration - self._bar.n)

    def end(self) -> None:
        """Wipe the bar of the frame, if there is one."""
        if self._bar is not None:
            self._bar.close()
            self._bar = None
