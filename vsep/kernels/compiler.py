"""Compiler options of the kernels.

Numba translates them to machine code on their first call and keeps the result beside the module (or
in the user's cache folder where that cannot be written), so that the price is paid once.
"""

from collections.abc import Callable
from pathlib import Path
from typing import Any, Final, TypeVar, cast

from numba import njit

from vsep.kernels.code_cache import drop_outdated, keep_code

Function = TypeVar("Function", bound=Callable[..., object])

OPTIONS: Final[dict[str, Any]] = {
    # Sums may be reordered, which lets them run in vector registers; NaN and infinity keep their
    # sense.
    "fastmath": {"reassoc", "contract", "nsz"},
    "error_model": "numpy",
    # What a kernel calls becomes part of it. Otherwise a callee would have several machine codes,
    # its own and one in each caller's file, which round differently; which of them is called would
    # depend on what the process has loaded or compiled before, and with it the last bit of every
    # result.
    "forceinline": True,
}


def compiled(function: Function) -> Function:
    """Compile a function of arrays and numbers; it must not allocate more than it returns."""
    machine_code: Any = njit(**OPTIONS)(function)
    keep_code(machine_code, function)
    return cast(Function, machine_code)


drop_outdated(Path(__file__).parent)
