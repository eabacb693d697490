"""Kept machine code follows the sources of all kernels, not only of its own."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

from vsep.kernels import compiler
from vsep.kernels.code_cache import MARK, drop_outdated

CALLER = """
from vsep.kernels.compiler import compiled
from vsep.kernels.callee import value

@compiled
def doubled():
    return 2.0 * value()
"""
CALLEE = """
from vsep.kernels.compiler import compiled

@compiled
def value():
    return {}
"""


def doubled(folder):
    """What a new process gets from the caller."""
    program = "from vsep.kernels.caller import doubled; print(doubled())"
    environment = {**os.environ, "PYTHONPATH": str(folder)}
    command = [sys.executable, "-c", program]
    return float(subprocess.check_output(command, env=environment, cwd=folder, text=True))


def test_a_kernel_is_compiled_again_when_one_that_it_calls_has_changed(tmp_path):
    kernels = tmp_path / "vsep" / "kernels"
    kernels.mkdir(parents=True)
    (tmp_path / "vsep" / "__init__.py").touch()
    for name in ("__init__.py", "compiler.py", "code_cache.py"):
        shutil.copy(Path(compiler.__file__).with_name(name), kernels / name)
    (kernels / "caller.py").write_text(CALLER)
    (kernels / "callee.py").write_text(CALLEE.format(1.0))
    assert doubled(tmp_path) == 2.0
    assert list((kernels / "__pycache__").glob("caller.doubled*.nbc"))
    (kernels / "callee.py").write_text(CALLEE.format(3.0))
    assert doubled(tmp_path) == 6.0


def test_machine_code_stays_while_the_sources_do(tmp_path):
    (tmp_path / "kernel.py").write_text("one = 1\n")
    drop_outdated(tmp_path)
    kept = tmp_path / "__pycache__" / "kernel.one.nbc"
    kept.write_bytes(b"code")
    drop_outdated(tmp_path)
    assert kept.exists()
    (tmp_path / "kernel.py").write_text("one = 2\n")
    drop_outdated(tmp_path)
    assert not kept.exists()
    assert (tmp_path / "__pycache__" / MARK).exists()


OF_NUMBA = """
from numba import njit

@njit(cache=True)
def {name}():
    return {value}
"""


def numbas_own(folder, program):
    """What a new process prints that has Numba's own cache."""
    command = [sys.executable, "-c", program]
    environment = {**os.environ, "PYTHONPATH": str(folder)}
    return subprocess.check_output(command, env=environment, cwd=folder, text=True).split()


def test_numba_does_not_see_that_a_callee_has_changed(tmp_path):
    """The day it does (issue 1833), `drop_outdated` is not needed."""
    callee, caller = tmp_path / "numba_callee.py", tmp_path / "numba_caller.py"
    callee.write_text(OF_NUMBA.format(name="callee", value="1.0"))
    caller.write_text(
        "from numba_callee import callee\n" + OF_NUMBA.format(name="caller", value="2.0 * callee()")
    )
    program = "from numba_caller import caller; print(caller())"
    assert numbas_own(tmp_path, program) == ["2.0"]
    callee.write_text(OF_NUMBA.format(name="callee", value="3.0"))
    assert numbas_own(tmp_path, program) == ["2.0"]


def test_numba_holds_the_intermediate_code_of_what_it_loads(tmp_path):
    """The day it does no longer, `fold_intermediate_code` is not needed."""
    (tmp_path / "numba_held.py").write_text(OF_NUMBA.format(name="held", value="1.0"))
    program = (
        "from numba_held import held; held(); (result,) = held.overloads.values();"
        "print(bool(held.stats.cache_hits), result.library._shared_module is not None)"
    )
    numbas_own(tmp_path, program)
    assert numbas_own(tmp_path, program) == ["True", "True"]
