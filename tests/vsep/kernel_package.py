"""A package of two kernels beside a copy of what compiles them, for processes of its own."""

import shutil
from pathlib import Path

from vsep.kernels import compiler

COMPILER = ("__init__.py", "compiler.py", "code_cache.py", "clock.py", "linking.py")


def write_package(folder, *, caller, callee):
    """Write the package with these sources; return the folder of the kernels."""
    kernels = folder / "vsep" / "kernels"
    kernels.mkdir(parents=True)
    (folder / "vsep" / "__init__.py").touch()
    for name in COMPILER:
        shutil.copy(Path(compiler.__file__).with_name(name), kernels / name)
    (kernels / "caller.py").write_text(caller)
    (kernels / "callee.py").write_text(callee)
    return kernels
