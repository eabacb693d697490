"""Compiler of the kernels, which Numba translates to machine code on their first call.

The result is kept beside the modules, or in a folder of the user's where that cannot be written, so
that the price is paid once. Numba itself is loaded at the first call of any kernel: what needs
none, such as reading and writing files, does not wait for it.
"""

import functools
import sys
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any, Final, TypeVar, cast

from vsep.kernels.clock import not_counted

Function = TypeVar("Function", bound=Callable[..., object])

OPTIONS: Final[dict[str, Any]] = {
    # Sums may be reordered, which lets them run in vector registers; NaN and infinity keep their
    # sense.
    "fastmath": {"reassoc", "contract", "nsz"},
    "error_model": "numpy",
    # No kernel is handed to C: an eighth of the time that compiling takes.
    "no_cfunc_wrapper": True,
}
_PACKAGE: Final = __name__.partition(".")[0]
_LOCK = threading.RLock()
_pending: "list[_Kernel]" = []


class _Kernel:
    """A kernel that waits for the first call of any; its machine code then takes its place."""

    def __init__(self, function: Callable[..., object]) -> None:
        functools.update_wrapper(self, function)
        self.function = function
        self.machine_code: Any = None

    def __call__(self, *arguments: Any, **named: Any) -> Any:
        """Load Numba and call the machine code."""
        if self.machine_code is None:
            with not_counted():
                _load()
        return self.machine_code(*arguments, **named)


def compiled(function: Function) -> Function:
    """Compile a function of arrays and numbers; it must not allocate more than it returns."""
    kernel = _Kernel(function)
    with _LOCK:
        _pending.append(kernel)
    return cast(Function, kernel)


def _load() -> None:
    """Let Numba take over all kernels that there are, in every module that has loaded them."""
    from vsep.kernels.code_cache import drop_outdated, keep_code
    from vsep.kernels.linking import in_one_piece

    with _LOCK:
        is_current = drop_outdated(Path(__file__).parent)
        for kernel in _pending:
            machine_code = in_one_piece(kernel.function, OPTIONS)
            keep_code(machine_code, kernel.function, is_current=is_current)
            kernel.machine_code = machine_code
        _pending.clear()
        # A kernel finds the kernels that it calls among the names of its module, and nobody else
        # takes a detour either.
        for name, module in tuple(sys.modules.items()):
            if name.partition(".")[0] == _PACKAGE:
                _replace_kernels(vars(module))


def _replace_kernels(names: dict[str, Any]) -> None:
    for name, value in tuple(names.items()):
        if isinstance(value, _Kernel):
            names[name] = value.machine_code
