"""How far the separation of one frame is, on the terminal.

How many iterations a run takes is known when it has ended, not before. The bar is therefore full at
the largest number that the run may take, foretells no time, and is left early where the run
converges; beside it stands what has been found by then.
"""

import sys
from typing import Final, TextIO

from tqdm import tqdm

from vsep.inference.core.progress import Step
from vsep.units import to_db

DELAY_S: Final = 1.0  # a run that is over sooner shows none
INTERVAL_S: Final = 0.1
_LINE: Final = "{desc}: {n_fmt} of at most {total_fmt} iterations |{bar}| {elapsed}{postfix}"


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
        self._bar: tqdm[None] | None = None

    def begin(self, name: str) -> None:
        """Begin a frame."""
        self.end()
        self._bar = tqdm(
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
        """Show an iteration of the frame: where it is, and what it has found."""
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
