"""A function of many items on the workers of a Dask scheduler, with the results in order."""

from collections.abc import Callable, Iterator, Sequence
from functools import partial
from typing import TypeVar

from vsep._optional import require_library
from vsep.studies.cluster import finished_futures
from vsep.studies.trial import ABRUPT_END, reason_of

Item = TypeVar("Item")
Result = TypeVar("Result")


def map_on_cluster(
    function: Callable[[Item], Result],
    items: Sequence[Item],
    address: str,
    *,
    lost: Callable[[Item, str], Result],
) -> Iterator[Result]:
    """Yield the results of a function in the order of its arguments.

    An item whose worker is killed is given to another one; so is all that a scheduler had when it
    went away, once it is back. Results that come early are held until their turn.

    Parameters
    ----------
    function : callable
        Of a module that the workers have; it may be a `functools.partial` of one. What it reads
        from the disk they must see under the same names.
    items : sequence
        Its arguments.
    address : str
        Of the scheduler, for example ``"tcp://127.0.0.1:8786"``.
    lost : callable
        Makes the result of an item that takes down one worker after the other, or that its worker
        cannot do, from the item and a sentence.

    Raises
    ------
    InputError
        If Dask is not installed, there is no scheduler or no worker, a worker has another version
        of this package, or the scheduler goes away and stays away.
    """
    dask = require_library("distributed", "A scheduler", "cluster")
    held: dict[int, Result] = {}
    due = 0
    numbered = partial(_numbered, function)
    for (number, item), future in finished_futures(numbered, enumerate(items), dask, address):
        if future.status == "error":
            error = future.exception()
            killed = type(error).__name__ == "KilledWorker"
            held[number] = lost(item, ABRUPT_END if killed else reason_of(error))
        else:
            held[number] = future.result()
        while due in held:
            yield held.pop(due)
            due += 1


def _numbered(function: Callable[[Item], Result], numbered: tuple[int, Item]) -> Result:
    return function(numbered[1])
