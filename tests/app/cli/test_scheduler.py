"""``--scheduler``: frames and sequences on a cluster give the lines of one machine."""

import signal
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from vsep_app.cli import main as cli
from vsep_app.cli import separate

from tests.app.cli.helpers import lines_of
from tests.vsep.test_cluster import cluster  # noqa: F401  a fixture
from vsep.studies.cluster_map import map_on_cluster

Refused = Callable[..., str]


def without_seconds(path: Path) -> list[dict[str, Any]]:
    """The lines of a run but for the time they took."""
    return [line | {"seconds": 0} for line in lines_of(path)]


@pytest.fixture(scope="module")
def sequences(tmp_path_factory: pytest.TempPathFactory) -> list[str]:
    """Folders of two streets, and one of frames of which one cannot be read."""
    parent = tmp_path_factory.mktemp("sequences")
    folders = []
    for preset, seed, frames in (("street", "1", 7), ("street", "2", 3), ("simulation-1", "1", 60)):
        folders.append(str(parent / f"{preset}-{seed}"))
        chosen = ["--preset", preset, "--seed", seed, "--frames", str(frames)]
        assert cli.main(["simulate", *chosen, "--out", folders[-1]]) == 0
    (Path(folders[-1]) / "000020.npz").write_bytes(b"no archive")
    return folders


@pytest.mark.cluster
def rounded(value: Any) -> Any:
    """Return what is in a line with nine digits of every number."""
    if isinstance(value, dict):
        return {name: rounded(each) for name, each in value.items()}
    if isinstance(value, list):
        return [rounded(each) for each in value]
    return float(f"{value:.9g}") if isinstance(value, float) else value


def test_a_cluster_that_loses_a_worker_gives_the_lines_of_one_machine_in_their_order(
    cluster: Any,  # noqa: F811
    sequences: list[str],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def losing_a_worker(*given: Any, **options: Any) -> Any:
        for number, lines in enumerate(map_on_cluster(*given, **options)):
            if number == 7:  # of fifteen
                cluster.workers[0].kill()
                assert cluster.workers[0].wait(timeout=10.0) == -signal.SIGKILL
            yield lines

    monkeypatch.setattr(separate, "map_on_cluster", losing_a_worker)
    here, there = tmp_path / "here.jsonl", tmp_path / "there.jsonl"
    scheduled = ["--scheduler", cluster.address, "--out", str(there)]
    # Sequences while both workers live, then single frames.
    for command, folders, code in (
        ("stream", sequences[:2], 0),
        ("separate", sequences[2:], 2),
    ):
        assert cli.main([command, *folders, "--out", str(here)]) == code
        assert cli.main([command, *folders, *scheduled]) == code
        # LAPACK's last bits follow from where a matrix lies in the memory of a process.
        assert rounded(without_seconds(there)) == rounded(without_seconds(here))
    assert cluster.workers[0].poll() == -signal.SIGKILL


def test_a_scheduler_and_local_processes_are_not_for_the_same_frames(
    frame_file: Callable[..., str], refused: Refused, tmp_path: Path
) -> None:
    where = ("--scheduler", "tcp://127.0.0.1:9", "--out", str(tmp_path / "x.jsonl"))
    sentence = refused("separate", frame_file(), "--workers", "2", *where)
    assert "--workers is 2 and --scheduler tcp://127.0.0.1:9; give one of them" in sentence
    assert "is read by this machine" in refused("stream", "-", "--like", "a.npz", *where)


def test_a_scheduler_that_does_not_answer_is_named(
    frame_file: Callable[..., str],
    refused: Refused,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    pytest.importorskip("distributed")
    monkeypatch.setattr("vsep.studies.cluster._CONNECT_S", 0.5)
    where = ("--scheduler", "tcp://127.0.0.1:9", "--out", str(tmp_path / "x.jsonl"))
    assert "tcp://127.0.0.1:9" in refused("separate", frame_file(), *where)


def test_a_folder_is_separated_in_the_order_of_names(
    frame_file: Callable[..., str], tmp_path: Path
) -> None:
    for name in ("b.npz", "a.npz"):
        frame_file(f"night/{name}")
    out = tmp_path / "lines.jsonl"
    assert cli.main(["separate", str(tmp_path / "night"), "--out", str(out)]) == 0
    assert [Path(line["file"]).name for line in lines_of(out)] == ["a.npz", "b.npz"]
