"""Trials without a result for a reason outside of them, such as a killed worker, are run again."""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace
from typing import Final, TypeAlias

from vsep.studies.study import Trial
from vsep.studies.trial import Row, is_missing

ATTEMPTS: Final = 3
"""How often a run of a study tries a trial until it has a result or a reason of its own."""

TrialRows: TypeAlias = tuple[Trial, list[Row]]
Retried: TypeAlias = Callable[[Row], None]


def unnoticed(row: Row) -> None:
    """Take no notice of a row that is made again."""
    del row


def with_retries(
    run: Callable[[Iterable[Trial], int], Iterator[TrialRows]],
    trials: Iterable[Trial],
    retried: Retried = unnoticed,
) -> Iterator[list[Row]]:
    """Run trials, and those that have rows missing once more when the others are done.

    Parameters
    ----------
    run : callable
        Runs trials in any order; it is told how many attempts there have been before.
    trials : iterable of Trial
        What to run.
    retried : callable, optional
        Is given every row that is made again.

    Yields
    ------
    list of dict
        Rows of one trial: finished ones, and after the last attempt the missing ones as well.
    """
    waiting = trials
    for attempt in range(ATTEMPTS):
        again: list[Trial] = []
        for trial, rows in run(waiting, attempt):
            missing = [row for row in rows if is_missing(row)] if attempt + 1 < ATTEMPTS else []
            kept = [row for row in rows if row not in missing]
            if missing:
                again.append(replace(trial, methods=tuple(row["method"] for row in missing)))
            for row in missing:
                retried(row)
            if kept:
                yield kept
        if not again:
            return
        waiting = again
