"""Kept machine code follows the sources of all kernels, not only of its own."""

import os
import subprocess
import sys

import pytest

from tests.vsep.kernel_package import write_package
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
    kernels = write_package(tmp_path, caller=CALLER, callee=CALLEE.format(1.0))
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


@pytest.fixture
def package(tmp_path):
    """A package of two kernels whose cache folder can be written by nobody, not even root."""
    write_package(tmp_path, caller=CALLER, callee=CALLEE.format(1.0))
    return tmp_path


FOLDERS = ("HOME", "XDG_CACHE_HOME", "NUMBA_CACHE_DIR", "TMPDIR")
CALL = "from vsep.kernels import caller; print(caller.doubled()); "
HITS = "print(sum(caller.doubled.stats.cache_hits.values()))"


def called(package, program, *, writable=()):
    """What a process prints, and says, in which nothing can be written but some folders."""
    (package / "file").touch()
    nowhere = str(package / "file" / "folder")
    environment = {
        name: nowhere for name in ("HOME", "XDG_CACHE_HOME", "NUMBA_CACHE_DIR", "TMPDIR")
    }
    environment |= {"PYTHONPATH": str(package), "PYTHONDONTWRITEBYTECODE": "1"}
    environment |= {name: str(package / name) for name in writable}
    for name in writable:
        (package / name).mkdir(exist_ok=True)
    done = subprocess.run(
        [sys.executable, "-c", program],
        env=os.environ | environment,
        cwd=package,
        text=True,
        capture_output=True,
        check=True,
    )
    return done.stdout.split(), done.stderr.splitlines()


def test_without_a_cache_folder_code_is_kept_among_the_temporary_files(package):
    (package / "vsep" / "kernels" / "__pycache__").touch()
    printed, (sentence,) = called(package, CALL + HITS, writable=["TMPDIR"])
    (home,) = (package / "TMPDIR").iterdir()
    assert printed == ["2.0", "0"]
    assert str(home) in sentence
    assert home.stat().st_mode & 0o777 == 0o700
    assert called(package, CALL + HITS, writable=["TMPDIR"]) == (["2.0", "1"], [])


def test_code_is_not_read_from_a_folder_that_others_can_write(package):
    (package / "vsep" / "kernels" / "__pycache__").touch()
    called(package, CALL, writable=["TMPDIR"])
    (home,) = (package / "TMPDIR").iterdir()
    home.chmod(0o777)
    printed, (sentence,) = called(package, CALL + HITS, writable=["TMPDIR"])
    assert printed == ["2.0", "0"]
    assert sentence.endswith("every process compiles its own.")


def test_without_any_folder_kernels_are_compiled_all_the_same(package):
    (package / "vsep" / "kernels" / "__pycache__").touch()
    nowhere = f"import tempfile; tempfile.tempdir = {str(package / 'file' / 'folder')!r}; "
    printed, (sentence,) = called(package, nowhere + CALL + HITS)
    assert printed == ["2.0", "0"]
    assert sentence.endswith("every process compiles its own.")


def test_code_beside_the_sources_is_read_where_it_cannot_be_written(package):
    """As in a container whose root is read-only."""
    assert doubled(package) == 2.0
    read_only = (
        "from numba.core.caching import InTreeCacheLocator as beside\n"
        "def refuse(locator): raise OSError('read-only')\n"
        "beside.ensure_cache_path = refuse\n"
    )
    assert called(package, read_only + CALL + HITS, writable=["TMPDIR"]) == (["2.0", "1"], [])


READY = "import sys; print('numba.np.arraymath' in sys.modules)"


def test_kept_code_is_loaded_without_the_compiler(package):
    assert called(package, CALL + READY)[0] == ["2.0", "True"]
    assert called(package, CALL + READY)[0] == ["2.0", "False"]


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
