"""Run the trials of a study: on local processes, or wherever `run_on_cluster` reaches.

Every trial is a pure function, so the order in which trials finish, the number of workers and an
interruption change nothing but the order of the rows.
"""

import threading
from collections.abc import Collection, Generator, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, Executor, Future, wait
from concurrent.futures.process import BrokenProcessPool
from dataclasses import replace
from functools import partial
from itertools import islice
from pathlib import Path

from vsep._processes import worker_pool
from vsep._validation import require_range
from vsep.files.line_file import LineFile
from vsep.studies.cluster import run_on_cluster
from vsep.studies.pickling import dump_trial, run_dumped_trial
from vsep.studies.retries import Retried, TrialRows, unnoticed, with_retries
from vsep.studies.rows import (
    RowKey,
    read_rows,
    require_same_study,
    row_key,
    rows_text,
    torn_bytes,
)
from vsep.studies.study import Study, Trial
from vsep.studies.trial import ABRUPT_END, Row, failed_rows, is_missing, reason_of, run_trial

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
    retried: Retried = unnoticed,
) -> Generator[list[Row], None, None]:
    """Run what is missing of a study, append its rows to a file and yield them as they finish.

    Closing the iterator stops the study; calling again resumes it with nothing lost or repeated.
    What is at work then is not waited for but made again later. A row without a result for a reason
    outside of its trial (`vsep.studies.trial.is_missing`) is made again within the run, see
    `vsep.studies.retries`, and by the next one. What an interrupted run left behind the last whole
    row is cut off.

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
    retried : callable, optional
        Is given every row that is made again within the run.

    Yields
    ------
    list of dict
        The new rows of one trial.

    Raises
    ------
    InputError
        If the file holds something else, another run writes into it, or the scheduler cannot be
        used.
    OSError
        If the file cannot be written.
    """
    require_range("workers", workers, 1, 4096)
    with LineFile(path, alone=True) as file:
        trials = list(pending_trials(study, finished_keys(study, path)))
        if torn := torn_bytes(path):
            file.cut(Path(path).stat().st_size - torn)
        if not trials:
            return
        if scheduler is None:
            results = run_on_processes(trials, workers=workers, stop=stop, retried=retried)
        else:
            results = run_on_cluster(trials, scheduler, retried=retried)
        for rows in results:
            file.write(rows_text(rows))
            yield rows


def finished_keys(study: Study, path: str | Path) -> set[RowKey]:
    """Return the keys of the rows a file holds, but for those that a run makes again."""
    if not Path(path).exists():
        return set()
    rows = read_rows(path)
    require_same_study(rows, study, path)
    return {row_key(row) for row in rows if not is_missing(row)}


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
    trials: Iterable[Trial],
    *,
    workers: int,
    stop: threading.Event | None = None,
    retried: Retried = unnoticed,
) -> Iterator[list[Row]]:
    """Run trials on local worker processes and yield their rows as they finish.

    A trial that takes its process down with it is found by running the suspects one by one. It is
    run again when the others are done, as is one that had no memory, with half as many processes
    each time; after the last attempt it becomes rows of status "failed".

    Parameters
    ----------
    trials : iterable of Trial
        Taken only as fast as they are worked on.
    workers : int
        Number of processes.
    stop : threading.Event, optional
        Once set, the processes are ended and there are no more rows.
    retried : callable, optional
        Is given every row that is made again.

    Yields
    ------
    list of dict
        The rows of one trial.
    """
    stop = threading.Event() if stop is None else stop
    yield from with_retries(partial(_run, workers=workers, stop=stop), trials, retried)


def _run(
    trials: Iterable[Trial], attempts: int, *, workers: int, stop: threading.Event
) -> Iterator[TrialRows]:
    """Run every trial once, those that a process died of one by one."""
    waiting, workers = iter(trials), max(1, workers >> attempts)
    suspects = yield from _run_until_breakage(waiting, workers, stop)
    while suspects:
        for trial in suspects:
            if (yield from _run_until_breakage(iter([trial]), 1, stop)):
                yield trial, failed_rows(trial, ABRUPT_END)
        suspects = yield from _run_until_breakage(waiting, workers, stop)


def _run_until_breakage(
    waiting: Iterator[Trial], workers: int, stop: threading.Event
) -> Generator[TrialRows, None, list[Trial]]:
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
                    trial = running.pop(future)
                    del unfinished[trial]
                    yield trial, rows
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
    return failed_rows(trial, reason_of(error))
