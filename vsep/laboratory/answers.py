"""What was found in the cells of the last questions, so that a question asked again goes on."""

import threading
from collections import OrderedDict

from vsep._arrays import require_range
from vsep.laboratory.cells import Finding
from vsep.laboratory.question import Cell, Question

_MOST_QUESTIONS = 32


class Answers:
    """Findings by question; those longest not asked for are forgotten. Threads may share it.

    Parameters
    ----------
    most : int
        Number of questions kept.
    """

    def __init__(self, most: int = _MOST_QUESTIONS) -> None:
        require_range("Number of questions", most, 1, 10**6)
        self._most = most
        self._lock = threading.Lock()
        self._findings: OrderedDict[Question, dict[Cell, Finding]] = OrderedDict()

    def of(self, question: Question) -> dict[Cell, Finding]:
        """Return what is known of a question, and count it as asked."""
        with self._lock:
            return dict(self._asked(question))

    def add(self, question: Question, finding: Finding) -> None:
        """Keep what was found in one cell."""
        with self._lock:
            self._asked(question)[finding.cell] = finding

    def _asked(self, question: Question) -> dict[Cell, Finding]:
        found = self._findings.setdefault(question, {})
        self._findings.move_to_end(question)
        while len(self._findings) > self._most:
            self._findings.popitem(last=False)
        return found
