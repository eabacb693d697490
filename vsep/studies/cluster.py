"""The same trials on a Dask cluster: scheduling, data transport and lost workers are Dask's work.

A trial whose worker dies is given to another one; a trial that takes down one worker after the
other becomes rows of status "failed". A scheduler that goes away takes with it what its workers are
at: once it is back, they are given it again.
"""

import time
from collections.abc import Callable, Generator, Iterable, Iterator
from functools import partial
from itertools import chain, islice
from typing import Any, TypeVar

from vsep._optional import require_library
from vsep._version import __version__
from vsep.errors import InputError
from vsep.studies.retries import ATTEMPTS, Retried, TrialRows, unnoticed, with_retries
from vsep.studies.study import Trial
from vsep.studies.trial import ABRUPT_END, Row, failed_rows, reason_of, run_trial

_CONNECT_S = 20.0
_RETURN_S = 60.0  # for which a scheduler that went away is waited for
# Trials handed out ahead, per worker thread.
_AHEAD = 3
_LOOK_S = 0.1

Item = TypeVar("Item")


def run_on_cluster(
    trials: Iterable[Trial], address: str, *, retried: Retried = unnoticed
) -> Iterator[list[Row]]:
    """Run trials on the workers of a Dask scheduler and yield their rows as they finish.

    Parameters
    ----------
    trials : iterable of Trial
        Taken only as fast as they are worked on.
    address : str
        Of the scheduler, for example ``"tcp://127.0.0.1:8786"``.
    retried : callable, optional
        Is given every row that is made again.

    Yields
    ------
    list of dict
        The rows of one trial.

    Raises
    ------
    InputError
        If Dask is not installed, there is no scheduler or no worker, a worker has another version
        of this package, or the scheduler goes away and stays away.
    """
    dask = require_library("distributed", "A scheduler", "cluster")
    yield from with_retries(partial(_run, dask=dask, address=address), trials, retried)


def _run(
    trials: Iterable[Trial], _attempts: int, *, dask: Any, address: str
) -> Iterator[TrialRows]:
    """Run every trial once."""
    for trial, future in finished_futures(run_trial, trials, dask, address):
        yield trial, _rows_of(future, trial)


def finished_futures(
    function: Callable[[Item], Any], items: Iterable[Item], dask: Any, address: str
) -> Iterator[tuple[Item, Any]]:
    """Call a function with every item on the workers of a scheduler, in any order.

    A scheduler may go away as often as a trial may be tried; once it is back, what was unfinished
    is handed out again.

    Parameters
    ----------
    function : callable
        Of a module that the workers have.
    items : iterable
        Taken only as fast as they are worked on.
    dask : module
        ``distributed``.
    address : str
        Of the scheduler.

    Yields
    ------
    item
    future
        Finished, or in error.
    """
    waiting, timeout_s = iter(items), _CONNECT_S
    for _ in range(ATTEMPTS):
        unfinished = yield from _finished_connected(function, waiting, dask, address, timeout_s)
        if not unfinished:
            return
        waiting, timeout_s = chain(unfinished, waiting), _RETURN_S
    raise InputError(f"The scheduler at {address} went away; run again to resume.")


def _finished_connected(
    function: Callable[[Item], Any],
    waiting: Iterator[Item],
    dask: Any,
    address: str,
    timeout_s: float,
) -> Generator[tuple[Item, Any], None, list[Item]]:
    """Call until there are no more items, or the scheduler goes; return those unfinished."""
    running: dict[Any, Item] = {}
    with _connected(dask.Client, address, timeout_s) as client:
        ahead = _AHEAD * _num_threads(client, address, timeout_s)
        finished = dask.as_completed()
        while True:
            for item in islice(waiting, ahead - len(running)):
                future = client.submit(function, item, pure=False)
                running[future] = item
                finished.add(future)
            if not running:
                return []
            future = next(finished)
            if future.status not in ("finished", "error"):
                # The client tries for its own time to come back; closed amid that it complains.
                while client.status == "connecting":
                    time.sleep(_LOOK_S)
                return list(running.values())
            yield running.pop(future), future


def library_version() -> str:
    """Return the version of this package where the call runs."""
    return __version__


def _connected(kind: Any, address: str, timeout_s: float) -> Any:
    try:
        return kind(address, timeout=timeout_s)
    except (OSError, ValueError, TimeoutError) as error:
        raise InputError(
            f"No Dask scheduler answers at {address}: {error or type(error).__name__}."
        ) from None


def _num_threads(client: Any, address: str, timeout_s: float) -> int:
    """Count the worker threads, after a look at what the workers have installed."""
    try:
        client.wait_for_workers(1, timeout=timeout_s)
    except TimeoutError:
        raise InputError(
            f"The scheduler at {address} has no workers; start at least one."
        ) from None
    try:
        versions = client.run(library_version)
    except Exception as error:  # whatever a worker without this package runs into
        raise InputError(f"A worker of {address} cannot run vsep: {error}.") from None
    others = {version for version in versions.values() if version != __version__}
    if others:
        raise InputError(
            f"A worker of {address} has vsep {others.pop()}; it must be {__version__}, as here."
        )
    num_threads: int = sum(client.ncores().values())
    return max(1, num_threads)


def _rows_of(future: Any, trial: Trial) -> list[Row]:
    if future.status == "error":
        error = future.exception()
        killed = type(error).__name__ == "KilledWorker"
        return failed_rows(trial, ABRUPT_END if killed else reason_of(error))
    rows: list[Row] = future.result()
    return rows
