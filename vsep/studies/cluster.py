"""The same trials on a Dask cluster: scheduling, data transport and lost workers are Dask's work.

A trial whose worker dies is given to another one; a trial that takes down one worker after the
other becomes rows of status "failed".
"""

from collections.abc import Iterable, Iterator
from itertools import islice
from typing import Any

from vsep._optional import require_library
from vsep._version import __version__
from vsep.errors import InputError
from vsep.studies.study import Trial
from vsep.studies.trial import Row, failed_rows, run_trial

_CONNECT_S = 20.0
# Trials handed out ahead, per worker thread.
_AHEAD = 3


def run_on_cluster(trials: Iterable[Trial], address: str) -> Iterator[list[Row]]:
    """Run trials on the workers of a Dask scheduler and yield their rows as they finish.

    Parameters
    ----------
    trials : iterable of Trial
        Taken only as fast as they are worked on.
    address : str
        Of the scheduler, for example ``"tcp://127.0.0.1:8786"``.

    Yields
    ------
    list of dict
        The rows of one trial.

    Raises
    ------
    InputError
        If Dask is not installed, there is no scheduler or no worker, a worker has another version
        of this package, or the scheduler goes away.
    """
    dask = require_library("distributed", "A scheduler", "cluster")
    with _connected(dask.Client, address) as client:
        waiting = iter(trials)
        running: dict[Any, Trial] = {}
        ahead = _AHEAD * _num_threads(client, address)
        finished = dask.as_completed()
        while True:
            for trial in islice(waiting, ahead - len(running)):
                future = client.submit(run_trial, trial, pure=False)
                running[future] = trial
                finished.add(future)
            if not running:
                return
            future = next(finished)
            yield _rows_of(future, running.pop(future), address)


def library_version() -> str:
    """Return the version of this package where the call runs."""
    return __version__


def _connected(kind: Any, address: str) -> Any:
    try:
        return kind(address, timeout=_CONNECT_S)
    except (OSError, ValueError, TimeoutError) as error:
        raise InputError(
            f"No Dask scheduler answers at {address}: {error or type(error).__name__}."
        ) from None


def _num_threads(client: Any, address: str) -> int:
    """Count the worker threads, after a look at what the workers have installed."""
    try:
        client.wait_for_workers(1, timeout=_CONNECT_S)
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


def _rows_of(future: Any, trial: Trial, address: str) -> list[Row]:
    if future.status == "error":
        error = future.exception()
        return failed_rows(trial, f"{type(error).__name__}: {error}")
    if future.status == "cancelled":
        raise InputError(f"The scheduler at {address} went away; run again to resume.")
    rows: list[Row] = future.result()
    return rows
