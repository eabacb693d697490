"""A kernel is compiled in one piece with what it calls."""

import json
import os
import subprocess
import sys
from types import SimpleNamespace

import pytest

from tests.vsep.kernel_package import write_package

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
BEGIN = """
import gc, json, time
import numpy as np
from vsep.kernels import callee, caller
from vsep.kernels.clock import computing_s
first, second = np.arange(1.0, 98.0) / 7.0, np.arange(98.0, 1.0, -1.0) / 3.0
told = {}
"""


def package(folder):
    """A package of these kernels and of what compiles them."""
    write_package(folder, caller=CALLER, callee=CALLEE)
    return folder


def told(folder, program):
    """What a new process tells."""
    command = [sys.executable, "-c", BEGIN + program + "print(json.dumps(told))"]
    environment = {**os.environ, "PYTHONPATH": str(folder)}
    text = subprocess.check_output(command, env=environment, cwd=folder, text=True)
    files = (folder / "vsep" / "kernels" / "__pycache__").glob("*.nbc")
    kept = {path.name.partition("-")[0] for path in files}
    return SimpleNamespace(**json.loads(text), kept=kept)


COSINE = "told['cosine'] = caller.cosine(first, second)\n"
INNER = "told['inner'] = callee.inner(first, second)\n"
FAILING = """
try: caller.copied(first, 5)
except ValueError as error: told['message'] = str(error)
"""
FIRST = """
from vsep.kernels.clock import listeners
told['heard'] = []
listeners.add(told['heard'].append)
began, began_computing = time.perf_counter(), computing_s()
told['cosine'] = caller.cosine(first, second)
time.sleep(0.05)
told['computing_s'], told['all_s'] = computing_s() - began_computing, time.perf_counter() - began
told['collects'] = gc.isenabled()
(result,) = caller.cosine.overloads.values()
told['linkage'] = [
    (function.linkage.name, function.name) for function in result.library.get_defined_functions()
]
"""
ASKED = """
import sys

def asks(call, *arguments):
    names = []
    call(*arguments)
    sys.setprofile(lambda frame, event, argument: names.append(frame.f_code.co_name))
    call(*arguments)
    sys.setprofile(None)
    return '_numba_unpickle' in names

told['asks'] = asks(caller.copied, first, 97)
"""
OTHERS = """
from numba import njit

inner, copy_to = callee.inner, callee.copy_to

@njit
def doubled(first, second, size):
    target = np.empty(size)
    copy_to(target, 2.0 * inner(first, second) * np.ones(3))
    return target

told['doubled'] = doubled(first, second, 3).tolist()
told['numba_asks'] = asks(doubled, first, second, 3)
try: doubled(first, second, 2)
except ValueError as error: told['refused'] = str(error)
"""


@pytest.fixture(scope="module")
def alone(tmp_path_factory):
    """A process that calls one kernel, which calls another."""
    return told(package(tmp_path_factory.mktemp("alone")), FIRST)


@pytest.fixture(scope="module")
def together(tmp_path_factory):
    """One that calls the other first, and one that finds the code of both."""
    folder = package(tmp_path_factory.mktemp("together"))
    return (
        told(folder, INNER + COSINE + FAILING + ASKED + OTHERS),
        told(folder, COSINE + INNER + FAILING + ASKED),
    )


def test_bits_do_not_depend_on_what_was_compiled_or_loaded_before(alone, together):
    compiled, loaded = together
    assert compiled.cosine == loaded.cosine == alone.cosine
    assert compiled.inner == loaded.inner
    expected = sum(((k + 1.0) / 7.0) ** 0.5 * (98.0 - k) / 3.0 for k in range(97))
    assert compiled.inner == pytest.approx(expected, rel=1e-13)


def test_only_what_python_calls_has_machine_code(alone, together):
    assert alone.kept == {"caller.cosine"}
    assert together[0].kept == {"caller.cosine", "caller.copied", "callee.inner"}


def test_who_listens_hears_of_a_compilation_and_of_its_end(alone):
    assert alone.heard == ["cosine", ""]


def test_a_kernel_shares_no_machine_code(alone):
    shared = [name for linkage, name in alone.linkage if linkage != "internal"]
    assert len(shared) == 2  # the function, and what Python calls
    assert all("cosine" in name for name in shared)


def test_an_exception_of_a_part_has_its_message(together):
    for process in together:
        assert process.message.startswith("cannot assign slice")


def test_a_kernel_asks_python_for_no_class_of_what_it_returns(together):
    compiled, loaded = together
    assert not compiled.asks
    assert not loaded.asks
    assert compiled.numba_asks  # the day it does no longer, `_Python` of linking is not needed


def test_other_code_may_call_a_kernel_and_share_functions_of_numba(together):
    compiled, _ = together
    assert compiled.doubled == pytest.approx([2.0 * compiled.inner] * 3, rel=1e-13)
    assert compiled.refused.startswith("cannot assign slice")


def test_the_clock_of_what_is_computed_stands_still_while_a_kernel_is_compiled(alone):
    assert 0.05 <= alone.computing_s < 0.3 * alone.all_s


def test_memory_is_searched_again_after_a_compilation(alone):
    assert alone.collects


def test_numba_translates_what_only_compiled_code_calls():
    """The day it does no longer, `vsep.kernels.linking` is not needed."""
    from numba import njit

    inner = njit(lambda value: value + 1.0)
    outer = njit(lambda value: 2.0 * inner(value))
    assert outer(1.0) == 4.0
    (result,) = inner.overloads.values()
    assert result.library.get_pointer_to_function(result.fndesc.llvm_func_name) != 0
