"""What an interrupted or failed write leaves: the old file, or whole lines."""

import os
import resource
import stat
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from vsep.errors import InputError
from vsep.files import line_file
from vsep.files.line_file import LineFile, lines_of_a_run
from vsep.files.writing import write_npz, write_table, write_text, written_beside

FULL = 4096


@pytest.fixture
def small_disk() -> Iterator[None]:
    """No file of this process can grow beyond `FULL` bytes, as on a full disk."""
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (FULL, hard))
    yield
    resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))


WRITERS: dict[str, Callable[[Path], None]] = {
    "text": lambda path: write_text(path, "a" * 3 * FULL),
    "npz": lambda path: write_npz(path, received=np.ones(FULL)),
    "table": lambda path: write_table(path, ["a"], ([row] for row in range(FULL))),
}


@pytest.mark.parametrize("write", WRITERS.values(), ids=WRITERS)
@pytest.mark.usefixtures("small_disk")
def test_a_disk_that_gets_full_leaves_the_old_file_and_names_it(tmp_path: Path, write: Any) -> None:
    path = tmp_path / "out.npz"
    path.write_text("old")
    with pytest.raises(OSError, match="too large") as caught:
        write(path)
    assert caught.value.filename == str(path)
    assert [one.name for one in tmp_path.iterdir()] == ["out.npz"]
    assert path.read_text() == "old"


@pytest.mark.parametrize("write", WRITERS.values(), ids=WRITERS)
@pytest.mark.skipif(not Path("/dev/full").exists(), reason="the system has no such device")
def test_a_device_without_room_is_named(write: Any) -> None:
    with pytest.raises(OSError, match="No space left") as caught:
        write(Path("/dev/full"))
    assert caught.value.filename == "/dev/full"
    assert Path("/dev/full").is_char_device()


def test_an_interruption_leaves_the_old_file(tmp_path: Path) -> None:
    path = tmp_path / "out.txt"
    path.write_text("old")

    def interrupted() -> None:
        with written_beside(path) as beside:
            beside.write_text("half")
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        interrupted()
    assert [one.name for one in tmp_path.iterdir()] == ["out.txt"]
    assert path.read_text() == "old"


def test_links_and_permissions_stay(tmp_path: Path) -> None:
    path, link = tmp_path / "out.txt", tmp_path / "link.txt"
    path.write_text("old")
    path.chmod(0o640)
    link.symlink_to(path)
    write_text(link, "new")
    assert link.is_symlink()
    assert path.read_text() == "new"
    assert stat.S_IMODE(path.stat().st_mode) == 0o640


def test_a_new_file_has_the_permissions_of_any_other(tmp_path: Path) -> None:
    (tmp_path / "plain.txt").touch()
    write_text(tmp_path / "new.txt", "new")
    assert (tmp_path / "new.txt").stat().st_mode == (tmp_path / "plain.txt").stat().st_mode


@pytest.mark.usefixtures("small_disk")
def test_a_line_that_finds_no_room_is_left_out_as_a_whole(tmp_path: Path) -> None:
    path = tmp_path / "rows.jsonl"
    line = "x" * (FULL // 2 - 1) + "\n"
    with LineFile(path) as file:
        file.write(line)
        with pytest.raises(OSError, match="too large") as caught:
            file.write(line + "yyy\n")
        assert caught.value.filename == str(path)
        file.write(line)
    assert path.read_text() == 2 * line


def test_a_second_run_on_a_file_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "rows.jsonl"
    with LineFile(path, alone=True) as file:
        file.write("1\n")
        with pytest.raises(InputError, match=r"Another run writes into .*rows\.jsonl; wait"):
            LineFile(path, alone=True)
    with LineFile(path, alone=True) as file:
        file.write("2\n")
    assert path.read_text() == "1\n2\n"


def test_without_locks_the_size_tells_of_a_second_run(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(line_file, "fcntl", None)
    path = tmp_path / "rows.jsonl"
    with LineFile(path, alone=True) as first, LineFile(path, alone=True) as second:
        first.write("1\n")
        with pytest.raises(InputError, match="Another run writes"):
            second.write("2\n")
    assert path.read_text() == "1\n"


def test_lines_reach_the_disk_at_intervals(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    synced: list[int] = []
    monkeypatch.setattr(line_file.os, "fsync", synced.append)
    seconds = iter([0.0, 1.0, 6.0, 6.0, 7.0])
    monkeypatch.setattr(line_file.time, "monotonic", lambda: next(seconds, 7.0))
    with LineFile(tmp_path / "rows.jsonl") as file:
        file.write("1\n")
        assert not synced
        file.write("2\n")
        assert len(synced) == 1
        file.write("3\n")
    assert len(synced) == 2


def test_a_file_without_a_line_is_not_left_behind(tmp_path: Path) -> None:
    with LineFile(tmp_path / "new.jsonl"):
        pass
    (tmp_path / "old.jsonl").touch()
    with LineFile(tmp_path / "old.jsonl"):
        pass
    assert os.listdir(tmp_path) == ["old.jsonl"]


def test_an_interrupted_run_keeps_its_lines_in_a_new_file_and_never_destroys_an_old_one(
    tmp_path: Path,
) -> None:
    def interrupted(path: Path) -> None:
        with lines_of_a_run(path) as file:
            file.write("new\n")
            raise KeyboardInterrupt

    new, old = tmp_path / "new.jsonl", tmp_path / "old.jsonl"
    old.write_text("old\n")
    for path in (new, old):
        with pytest.raises(KeyboardInterrupt):
            interrupted(path)
    assert (new.read_text(), old.read_text()) == ("new\n", "old\n")
    with lines_of_a_run(old) as file:
        file.write("newer\n")
    assert old.read_text() == "newer\n"
    assert sorted(os.listdir(tmp_path)) == ["new.jsonl", "old.jsonl"]
