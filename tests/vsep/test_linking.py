"""A kernel is compiled in one piece with what it calls."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from vsep.kernels import compiler

CALLEE = """
import numpy as np
from vsep.kernels.compiler import compiled

@compiled
def inner(first, second):
    total = 0.0
    for k in range(len(first)):
        total += np.sqrt(first[k]) * second[k]
    return total

@compiled
def copy_to(target, source):
    target[:] = source
"""
CALLER = """
import numpy as np
from vsep.kernels.callee import copy_to, inner
from vsep.kernels.compiler import compiled

@compiled
def cosine(first, second):
    return inner(first, second) / np.sqrt(inner(first, first) * inner(second, second))

@compiled
def copied(source, size):
    target = np.empty(size)
    copy_to(target, source)
    return target
"""
ARGUMENTS = """
import numpy as np
from vsep.kernels import callee, caller
first, second = np.arange(1.0, 98.0) / 7.0, np.arange(98.0, 1.0, -1.0) / 3.0
"""


@pytest.fixture
def package(tmp_path):
    kernels = tmp_path / "vsep" / "kernels"
    kernels.mkdir(parents=True)
    (tmp_path / "vsep" / "__init__.py").touch()
    for name in ("__init__.py", "compiler.py", "code_cache.py", "clock.py", "linking.py"):
        shutil.copy(Path(compiler.__file__).with_name(name), kernels / name)
    (kernels / "caller.py").write_text(CALLER)
    (kernels / "callee.py").write_text(CALLEE)
    return tmp_path


def printed(folder, program):
    """What a new process prints, word by word."""
    command = [sys.executable, "-c", ARGUMENTS + program]
    environment = {**os.environ, "PYTHONPATH": str(folder)}
    return subprocess.check_output(command, env=environment, cwd=folder, text=True).split()


def kept(folder):
    """The kernels of which there is machine code on disk."""
    files = (folder / "vsep" / "kernels" / "__pycache__").glob("*.nbc")
    return {path.name.partition("-")[0] for path in files}


COSINE = "print(caller.cosine(first, second).hex()); "
INNER = "print(callee.inner(first, second).hex()); "


def test_bits_do_not_depend_on_what_was_compiled_or_loaded_before(package):
    (alone,) = printed(package, COSINE)
    shutil.rmtree(package / "vsep" / "kernels" / "__pycache__")
    inner, after = printed(package, INNER + COSINE)
    assert after == alone
    assert printed(package, COSINE + INNER) == [alone, inner]  # now from the disk
    assert float.fromhex(inner) == pytest.approx(
        sum(((k + 1.0) / 7.0) ** 0.5 * (98.0 - k) / 3.0 for k in range(97)), rel=1e-13
    )


def test_only_what_python_calls_has_machine_code(package):
    printed(package, COSINE)
    assert kept(package) == {"caller.cosine"}
    printed(package, INNER)
    assert kept(package) == {"caller.cosine", "callee.inner"}


def test_a_kernel_shares_no_machine_code(package):
    defined = (
        "(result,) = caller.cosine.overloads.values(); "
        "print(*(function.linkage.name + ':' + function.name.partition('caller')[1]"
        " for function in result.library.get_defined_functions()))"
    )
    _, *functions = printed(package, COSINE + defined)
    shared = [name for name in functions if not name.startswith("internal")]
    assert shared == ["external:caller"] * 2  # the function, and what Python calls


FAILING = """
try: caller.copied(first, 5)
except ValueError as error: print(error)
"""


def test_an_exception_of_a_part_has_its_message(package):
    for _ in ("compiled", "loaded"):
        message = " ".join(printed(package, FAILING))
        assert message.startswith("cannot assign slice")
        assert "97" in message


def test_other_code_may_call_a_kernel_and_share_functions_of_numba(package):
    program = """
from numba import njit

caller.copied(first, 97)
inner, copy_to = callee.inner, callee.copy_to

@njit
def doubled(first, second, size):
    target = np.empty(size)
    copy_to(target, 2.0 * inner(first, second) * np.ones(3))
    return target

print(inner(first, second).hex(), *doubled(first, second, 3))
try: doubled(first, second, 2)
except ValueError as error: print(error)
"""
    once, *rest = printed(package, program)
    assert list(map(float, rest[:3])) == pytest.approx([2.0 * float.fromhex(once)] * 3, rel=1e-13)
    assert rest[3:5] == ["cannot", "assign"]


def test_the_clock_of_what_is_computed_stands_still_while_a_kernel_is_compiled(package):
    program = """
import time
from vsep.kernels.clock import computing_s
began, began_computing = time.perf_counter(), computing_s()
caller.cosine(first, second)
time.sleep(0.05)
print(computing_s() - began_computing, time.perf_counter() - began)
"""
    computing, all_of_it = map(float, printed(package, program))
    assert 0.05 <= computing < 0.3 * all_of_it


def test_memory_is_searched_again_after_a_compilation(package):
    assert printed(package, "import gc; " + COSINE + "print(gc.isenabled())")[1] == "True"


def test_numba_translates_what_only_compiled_code_calls():
    """The day it does no longer, `vsep.kernels.linking` is not needed."""
    from numba import njit

    inner = njit(lambda value: value + 1.0)
    outer = njit(lambda value: 2.0 * inner(value))
    assert outer(1.0) == 4.0
    (result,) = inner.overloads.values()
    assert result.library.get_pointer_to_function(result.fndesc.llvm_func_name) != 0
