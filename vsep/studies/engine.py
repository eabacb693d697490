"""Run the trials of a study: on local processes, or wherever `run_on_cluster` reaches.

Every trial is a pure function, so the order in which trials finish, the number of workers and an
interruption change nothing but the order of the rows.
"""

import threading
from collections.abc import Collection, Generator, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, Executor, Future, wait
from concurrent.futures.process import BrokenProcessPool
from dataclasses import replace
from itertools import islice
from pathlib import Path

from vsep._processes import worker_pool
from vsep._validation import require_range
from vsep.studies.cluster import run_on_cluster
from vsep.studies.pickling import dump_trial, run_dumped_trial
from vsep.studies.rows import RowKey, append_rows, read_rows, repair, require_same_study, row_key
from vsep.studies.study import Study, Trial
from vsep.studies.trial import Row, failed_rows, run_trial

# Trials handed out ahead, per worker, so that none waits for work.
_AHEAD = 3
_STOP_CHECK_S = 0.2


def record_study(
    study: Study,
    path: str | Path,
    *,
    workers: int = 1,
    scheduler: str | None = None,
    stop: threading.Event | None = None,
) -> Generator[list[Row], None, None]:
    """Run what is missing of a study, append its rows to a file and yield them as they finish.

    Closing the iterator stops the study; calling again resumes it with nothing lost or repeated.
    What is at work then is not waited for but made again later.

    Parameters
    ----------
    study : Study
        What to run.
    path : str or Path
        JSON lines, made if need be.
    workers : int
        Local processes.
    scheduler : str, optional
        Address of a Dask scheduler whose workers are used in place of local processes.
    stop : threading.Event, optional
        Set by another thread it ends local processes at once, without a row to wait for.

    Yields
    ------
    list of dict
        The new rows of one trial.

    Raises
    ------
    InputError
        If the file holds something else, or the scheduler cannot be used.
    OSError
        If the file cannot be written.
    """
    require_range("workers", workers, 1, 4096)
    trials = list(pending_trials(study, finished_keys(study, path)))
    if not trials:
        return
    if scheduler is None:
        results = run_on_processes(trials, workers=workers, stop=stop)
    else:
        results = run_on_cluster(trials, scheduler)
    with open(path, "a", encoding="utf-8") as file:
        for rows in results:
            append_rows(file, rows)
            yield rows


def finished_keys(study: Study, path: str | Path) -> set[RowKey]:
    """Return the keys of the rows a file holds, its torn last line removed; none if it is new."""
    if not Path(path).exists():
        return set()
    rows = read_rows(path)
    require_same_study(rows, study, path)
    repair(path)
    return {row_key(row) for row in rows}


def pending_trials(study: Study, finished: Collection[RowKey]) -> Iterator[Trial]:
    """Yield the trials that have rows missing, with the methods that are.

    All points grow together: the first realisation of every point comes before the second.
    """
    for realization in range(study.realizations):
        for index in study.point_indices:
            trial = study.trial(index, realization)
            missing = tuple(
                method
                for method in trial.methods
                if (study.name, index, realization, method) not in finished
            )
            if missing:
                yield replace(trial, methods=missing)


def run_on_processes(
    trials: Iterable[Trial], *, workers: int, stop: threading.Event | None = None
) -> Iterator[list[Row]]:
    """Run trials on local worker processes and yield their rows as they finish.

    A trial that takes its process down with it is found by running the suspects one by one; it
    becomes rows of status "failed", the others are run again.

    Parameters
    ----------
    trials : iterable of Trial
        Taken only as fast as they are worked on.
    workers : int
        Number of processes.
    stop : threading.Event, optional
        Once set, the processes are ended and there are no more rows.

    Yields
    ------
    list of dict
        The rows of one trial.
    """
    waiting = iter(trials)
    stop = threading.Event() if stop is None else stop
    suspects = yield from _run_until_breakage(waiting, workers, stop)
    while suspects:
        for trial in suspects:
            if (yield from _run_until_breakage(iter([trial]), 1, stop)):
                yield failed_rows(trial, "the worker process ended abruptly")
        suspects = yield from _run_until_breakage(waiting, workers, stop)


def _run_until_breakage(
    waiting: Iterator[Trial], workers: int, stop: threading.Event
) -> Generator[list[Row], None, list[Trial]]:
    """Run trials until there are no more, or a process died; return those that are unfinished.

    After a stop none is: whoever goes on later makes them again.
    """
    unfinished: dict[Trial, None] = {}
    running: dict[Future[list[Row]], Trial] = {}
    with worker_pool(workers) as pool:
        try:
            while not stop.is_set():
                for trial in islice(waiting, workers * _AHEAD - len(running)):
                    unfinished[trial] = None
                    running[_submit(pool, trial)] = trial
                if not running:
                    break
                done, _ = wait(running, timeout=_STOP_CHECK_S, return_when=FIRST_COMPLETED)
                # Whole results first: a breakage ends all that runs at once.
                for future in sorted(done, key=lambda one: one.exception() is not None):
                    rows = _rows_of(future, running[future])
                    del unfinished[running.pop(future)]
                    yield rows
        except BrokenProcessPool:
            return list(unfinished)
    return []


def _submit(pool: Executor, trial: Trial) -> Future[list[Row]]:
    if trial.handed:
        return pool.submit(run_dumped_trial, dump_trial(trial))
    return pool.submit(run_trial, trial)


def _rows_of(future: Future[list[Row]], trial: Trial) -> list[Row]:
    """Return the rows of a trial; a method that the worker cannot load makes failed ones."""
    error = future.exception()
    if error is None or isinstance(error, BrokenProcessPool):
        return future.result()
    return failed_rows(trial, f"{type(error).__name__}: {error}")
