"""How the inner loops are compiled.

Numba translates them to machine code on their first call and keeps the result beside the module (or
in the user's cache folder where that cannot be written), so that the price is paid once.
"""

from collections.abc import Callable
from typing import TypeVar, cast

from numba import njit

Function = TypeVar("Function", bound=Callable[..., object])

# Sums may be reordered, which lets them run in vector registers; NaN and infinity keep their sense.
RELAXED = {"reassoc", "contract", "nsz"}


def compiled(function: Function) -> Function:
    """Compile a function of arrays and numbers; it must not allocate more than it returns.

    What it calls becomes part of it. Otherwise a callee would have several machine codes, its own
    and one in each caller's file, which round differently; which of them is called would depend on
    what the process has loaded or compiled before, and with it the last bit of every result.
    """
    machine_code = njit(cache=True, fastmath=RELAXED, error_model="numpy", forceinline=True)(
        function
    )
    return cast(Function, machine_code)
