"""Memory of pages: collected seldom, and given back to the system once they are closed.

The C library keeps what is freed for whoever asks next, in an arena for every thread; a server
that had thirty pages once would go on looking as if it had them.
"""

import ctypes
import gc
from collections.abc import Callable
from contextlib import suppress
from typing import Final

from tornado.ioloop import IOLoop, PeriodicCallback

MOST_ARENAS: Final = 2
_M_ARENA_MAX: Final = -8  # glibc's number of the parameter
# New objects after which the young are looked through, times ten the younger ones, times two all: a
# page is some 70,000, and one that has left waits for the last of these.
NEW_OBJECTS: Final = 50_000, 10, 2
PERIOD_MS: Final = 20_000
LOOKS: Final = 3  # after a page has left: its document goes later


def few_arenas() -> None:
    """Let all threads share what is free; other C libraries than glibc have nothing to set."""
    with suppress(OSError, AttributeError):
        ctypes.CDLL(None).mallopt(_M_ARENA_MAX, MOST_ARENAS)


def look_through_less() -> None:
    """Keep the collector from what stays, and from looking a hundred times while a page is made.

    With Python's own threshold of 700 new ones a tenth of the time of a page is the collector's,
    and more the more pages are open.
    """
    gc.collect()
    gc.freeze()
    gc.set_threshold(*NEW_OBJECTS)


def give_back() -> None:
    """Return what is free to the system, as far as the C library can."""
    with suppress(OSError, AttributeError):
        ctypes.CDLL(None).malloc_trim(0)


def begin_tidying(loop: IOLoop, num_pages: Callable[[], int]) -> None:
    """Give memory back every now and then, if pages have left; all of it once none is open.

    Parameters
    ----------
    loop : IOLoop
        Of the server.
    num_pages : callable
        Returns how many pages are open.
    """
    before = looks_left = 0

    def look() -> None:
        nonlocal before, looks_left
        now = num_pages()
        looks_left = LOOKS if now < before else max(0, looks_left - 1)
        if looks_left > 0:
            if now == 0:
                gc.collect()  # nobody waits for it
            # No lock of Python's is held meanwhile: the loop goes on.
            loop.run_in_executor(None, give_back)
        before = now

    PeriodicCallback(look, PERIOD_MS).start()
