import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from vsep import _entry_points
from vsep._entry_points import load_entries, require_loadable
from vsep.errors import InputError

GROUP = "vsep.test_group"
Install = Callable[[str, str], None]


@pytest.fixture
def install(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Install]:
    """Make a distribution with these entry points, beside a module that it brings."""
    monkeypatch.syspath_prepend(str(tmp_path))
    (tmp_path / "vsep_test_plugin.py").write_text("ANSWER = 42\n")
    (tmp_path / "vsep_test_broken.py").write_text("raise RuntimeError('no licence')\n")

    def make(distribution: str, lines: str) -> None:
        folder = tmp_path / f"{distribution}-1.0.dist-info"
        folder.mkdir()
        (folder / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {distribution}\n")
        (folder / "entry_points.txt").write_text(f"[{GROUP}]\n{lines}\n")
        _entry_points._load.cache_clear()

    yield make
    _entry_points._load.cache_clear()
    for module in ("vsep_test_plugin", "vsep_test_broken"):
        sys.modules.pop(module, None)


def test_a_group_holds_what_distributions_declare(install: Install) -> None:
    install("plugin", "answer = vsep_test_plugin:ANSWER")
    assert load_entries(GROUP) == {"answer": 42}
    require_loadable(GROUP, "answer")


def test_a_broken_one_is_left_out_and_named_when_asked_for(install: Install) -> None:
    install("plugin", "answer = vsep_test_plugin:ANSWER\nbad = vsep_test_broken:X")
    assert list(load_entries(GROUP)) == ["answer"]
    with pytest.raises(InputError, match=r"bad of plugin .*vsep_test_broken:X.*no licence"):
        require_loadable(GROUP, "bad")


def test_a_name_given_twice_is_refused(install: Install) -> None:
    install("plugin", "answer = vsep_test_plugin:ANSWER")
    install("other", "answer = vsep_test_plugin:ANSWER")
    assert load_entries(GROUP) == {}
    with pytest.raises(InputError, match=r"2 entry points of vsep\.test_group are named answer"):
        require_loadable(GROUP, "answer")
