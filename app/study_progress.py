"""How long a study still takes, and the line that says so."""

import time
from collections.abc import Callable

from app.study_session import StudyPhase, StudySnapshot

_FEWEST_ROWS = 4


class Pace:
    """Rows a second since the start of the run; the rows that were there before do not count."""

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self._start: tuple[float, int] | None = None

    def begin(self, num_rows: int) -> None:
        """Begin to count."""
        self._start = self._clock(), num_rows

    def left_s(self, snapshot: StudySnapshot) -> float | None:
        """Return the seconds that are left, None while that cannot be said."""
        if self._start is None or snapshot.phase is not StudyPhase.RUNNING:
            return None
        started, before = self._start
        made = len(snapshot.rows) - before
        if made < _FEWEST_ROWS:
            return None
        seconds = self._clock() - started
        return seconds / made * (snapshot.num_rows - len(snapshot.rows))


def duration(seconds: float) -> str:
    """Return a duration as people say it.

    Examples
    --------
    >>> duration(42.3), duration(600.0), duration(9000.0)
    ('42 s', '10 min', '2 h 30 min')
    """
    if seconds < 100.0:
        return f"{seconds:.0f} s"
    minutes = round(seconds / 60.0)
    return f"{minutes} min" if minutes < 100 else f"{minutes // 60} h {minutes % 60} min"


def progress_text(snapshot: StudySnapshot, left_s: float | None) -> str:
    """Return how far a study is, in one line."""
    parts = [f"{len(snapshot.rows)} of {snapshot.num_rows} rows"]
    if snapshot.num_failed:
        parts.append(f"{snapshot.num_failed} failed")
    if left_s is not None:
        parts.append(f"{duration(left_s)} left")
    return " · ".join(parts)
