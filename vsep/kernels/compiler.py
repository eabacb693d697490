"""How the inner loops are compiled.

Numba translates them to machine code on their first call and keeps the result beside the module (or
in the user's cache folder where that cannot be written), so that the price is paid once.
"""

import hashlib
from collections.abc import Callable
from pathlib import Path
from typing import Final, TypeVar, cast

from numba import njit

Function = TypeVar("Function", bound=Callable[..., object])

# Sums may be reordered, which lets them run in vector registers; NaN and infinity keep their sense.
RELAXED = {"reassoc", "contract", "nsz"}
KERNELS: Final = Path(__file__).parent
MARK: Final = "sources.sha256"  # in the cache: what its machine code was made from


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


def drop_outdated(folder: Path) -> None:
    """Remove kept machine code if a source in the folder has changed since it was made.

    Numba looks at the file of a kernel alone, not at those of the kernels that became part of it.

    Parameters
    ----------
    folder : Path
        With the sources; the machine code stands in its ``__pycache__``.
    """
    sources = hashlib.sha256()
    for source in sorted(folder.glob("*.py")):
        sources.update(source.read_bytes())
    cache = folder / "__pycache__"
    try:
        if (cache / MARK).is_file() and (cache / MARK).read_text() == sources.hexdigest():
            return
        for kept in (*cache.glob("*.nbi"), *cache.glob("*.nbc")):
            kept.unlink(missing_ok=True)
        cache.mkdir(exist_ok=True)
        (cache / MARK).write_text(sources.hexdigest())
    except OSError:
        return  # not ours to write: Numba keeps the code elsewhere


drop_outdated(KERNELS)
