"""Cache of compiled kernels on disk.

All that is changed of Numba's cache, with the report it belongs to;
`tests/vsep/test_compiler.py` shows that Numba as it is still needs it.

- `drop_outdated`: issue 1833 (pull request 8396, open). Kept code is not outdated when a kernel
  that became part of it has changed.
- `_TemporaryFolder`, `_ReadOnly`: issue 5566 (open). Where no folder can be written, declaring a
  function is an error, and code beside the sources is not read where it could not be written.
- `_Cache`: no report of its own. Numba loads what it knows of every function before it looks for
  kept code, which takes longer than the code.
- `keep_code`: sets the cache of a dispatcher, as `njit(cache=True)` does with Numba's own.
"""

import hashlib
import multiprocessing
import os
import stat
import sys
import tempfile
from collections.abc import Callable
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import Any, Final

from numba.core import caching as numba_caching
from numba.core import externals as numba_externals
from numba.core import runtime as numba_runtime

caching: Any = numba_caching  # typed in part
externals: Any = numba_externals
runtime: Any = numba_runtime

MARK: Final = "sources.sha256"  # in the cache: what its machine code was made from


def _digest(folder: Path) -> str:
    sources = hashlib.sha256()
    for source in sorted(folder.glob("*.py")):
        sources.update(source.read_bytes())
    return sources.hexdigest()


def drop_outdated(folder: Path) -> bool:
    """Remove kept machine code if a source in the folder has changed since it was made.

    Numba looks at the file of a kernel alone, not at those of the kernels that became part of it.

    Parameters
    ----------
    folder : Path
        With the sources; the machine code stands in its ``__pycache__``.

    Returns
    -------
    bool
        Whether what stands there now was made from the sources as they are.
    """
    digest = _digest(folder)
    kept_code = folder / "__pycache__"
    try:
        if (kept_code / MARK).is_file() and (kept_code / MARK).read_text() == digest:
            return True
        for kept in (*kept_code.glob("*.nbi"), *kept_code.glob("*.nbc")):
            kept.unlink(missing_ok=True)
        kept_code.mkdir(exist_ok=True)
        (kept_code / MARK).write_text(digest)
    except OSError:
        return False  # not ours to write: Numba keeps the code elsewhere
    return True


class _TemporaryFolder(caching.InTreeCacheLocator):  # type: ignore[misc]
    """A folder of this user's among the temporary files, where no other can be written."""

    def __init__(self, py_func: Any, py_file: str) -> None:
        super().__init__(py_func, py_file)
        home = _own_temporary_folder(Path(py_file).parent)
        if home is None:
            raise OSError("no folder for temporary files")
        self._cache_path = str(home)

    @classmethod
    def from_function(cls, py_func: Any, py_file: str) -> Any:
        """Return None where there is no folder either."""
        try:
            return super().from_function(py_func, py_file)
        except OSError:
            return None


class _ReadOnly(caching.InTreeCacheLocator):  # type: ignore[misc]
    """The folder beside the sources, for reading."""

    def ensure_cache_path(self) -> None:
        """Ask for nothing: it is not written."""


@cache
def _own_temporary_folder(sources: Path) -> Path | None:
    """Return a folder that nobody else can write: what is read from it is run."""
    user = os.getuid() if hasattr(os, "getuid") else 0
    try:
        folder = Path(tempfile.gettempdir()) / f"vsep-kernels-{user}-{_digest(sources)[:16]}"
        folder.mkdir(mode=0o700, exist_ok=True)
        found = folder.lstat()
        if found.st_uid != user or found.st_mode & 0o022 or not stat.S_ISDIR(found.st_mode):
            raise OSError(f"{folder} belongs to somebody else")
        tempfile.TemporaryFile(dir=folder).close()
    except OSError:
        if multiprocessing.parent_process() is None:
            _say("no folder can be written for compiled kernels; every process compiles its own.")
        return None
    return folder


def _say(sentence: str) -> None:
    sys.stderr.write(f"vsep: {sentence}\n")


class _CodeCache(caching.CompileResultCacheImpl):  # type: ignore[misc]
    _locator_classes = (
        *caching.CompileResultCacheImpl._locator_classes,
        _TemporaryFolder,
        _ReadOnly,
    )


class _ShippedCode(_CodeCache):
    _locator_classes = (_ReadOnly,)


class _Cache(caching.FunctionCache):  # type: ignore[misc]
    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """Return kept code without making the compiler ready: that takes as long as all else."""
        runtime.rtsys.initialize(target_context)
        externals.c_math_functions.install(target_context)
        with self._guard_against_spurious_io_errors():
            return self._load_overload(sig, target_context)


class _ShippedCache(_Cache):
    _impl_class = _ShippedCode


def _nothing(sig: Any, target_context: Any) -> None:
    del sig, target_context


class _KernelCache(_Cache):
    """What can be written, and behind it what stands beside the sources.

    Parameters
    ----------
    function : callable
        The kernel.
    is_current : bool
        Whether the code beside the sources may be used.
    """

    _impl_class = _CodeCache

    def __init__(self, function: Callable[..., object], is_current: bool) -> None:
        super().__init__(function)
        self._load_shipped = _ShippedCache(function).load_overload if is_current else _nothing

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """Return the code of a signature, None where it has to be compiled."""
        for load in (super().load_overload, self._load_shipped):
            with suppress(OSError):  # a folder that cannot be read
                found = load(sig, target_context)
                if found is not None:
                    return found
        return None

    def save_overload(self, sig: Any, data: Any) -> None:
        """Keep the code of a signature, unless the disk is full or cannot be written."""
        home = Path(self.cache_path)
        try:
            if isinstance(self._impl.locator, _TemporaryFolder) and not any(home.iterdir()):
                _say(f"compiled kernels are kept in {home}; no cache folder can be written.")
            super().save_overload(sig, data)
        except OSError:
            self.disable()


def keep_code(machine_code: Any, function: Callable[..., object], *, is_current: bool) -> None:
    """Keep the machine code of a function on disk."""
    make: Any = _KernelCache
    machine_code._cache = make(function, is_current)
