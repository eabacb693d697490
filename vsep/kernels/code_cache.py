"""Cache of compiled kernels on disk and in memory.

All that is changed of Numba's behaviour, with the report it belongs to;
`tests/vsep/test_compiler.py` shows that Numba as it is still needs it.

- `drop_outdated`: issue 1833 (pull request 8396, open). Kept code is not outdated when a kernel
  that became part of it has changed.
- `fold_intermediate_code`: no report of its own; issue 3464 is about the same memory. LLVM's parsed
  form of what was loaded, which only the compilation of callers needs, takes more than all else of
  a run.
- `keep_code`: sets the cache of a dispatcher, as `njit(cache=True)` does with Numba's own.
"""

import hashlib
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import Any, Final

from llvmlite.binding import parse_bitcode
from numba.core import caching as numba_caching

caching: Any = numba_caching  # typed in part

MARK: Final = "sources.sha256"  # in the cache: what its machine code was made from


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


def fold_intermediate_code(library: Any) -> None:
    """Replace what LLVM parsed of a loaded library's intermediate code by its compressed text.

    It is parsed again if a caller is compiled in this process. A library that does not look as
    those of the Numba versions that this is known of stays as it is.
    """
    parsed = getattr(library, "_shared_module", None)
    if parsed is None or not hasattr(library, "_get_module_for_linking"):
        return
    folded = zlib.compress(parsed.as_bitcode(), level=1)
    library._shared_module = None

    def module_for_linking() -> Any:
        if library._shared_module is None:
            library._shared_module = parse_bitcode(zlib.decompress(folded))
        return library._shared_module

    library._get_module_for_linking = module_for_linking


class _LightCodeCache(caching.CompileResultCacheImpl):  # type: ignore[misc]
    def rebuild(self, target_context: Any, payload: Any) -> Any:
        result = caching.CompileResultCacheImpl.rebuild(self, target_context, payload)
        fold_intermediate_code(result.library)
        return result


class _KernelCache(caching.FunctionCache):  # type: ignore[misc]
    _impl_class = _LightCodeCache


def keep_code(machine_code: Any, function: Callable[..., object]) -> None:
    """Keep the machine code of a function on disk, and little of it in memory."""
    make: Any = _KernelCache
    machine_code._cache = make(function)
