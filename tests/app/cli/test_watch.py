"""``vsep watch``: captures of a folder, each once, with figures and clips."""

import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from vsep_app.cli import main as cli

from tests.app.cli.helpers import lines_of
from vsep.files.frame import read_frame


def watch(folder: Path, *more: str) -> int:
    arguments = ["watch", str(folder / "in"), "--settings", str(folder / "radar.yaml")]
    return cli.main([*arguments, "--out", str(folder / "all.jsonl"), "--existing", *more])


def test_every_capture_is_separated_and_interfered_ones_become_clips(
    tmp_path: Path, raw_capture: Any, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "in").mkdir()
    (tmp_path / "radar.yaml").write_bytes(raw_capture.settings)
    for number, content in enumerate((raw_capture.content, b"12", raw_capture.content)):
        (tmp_path / "in" / f"c{number}.bin").write_bytes(content)
        os.utime(tmp_path / "in" / f"c{number}.bin", (1000.0, 1000.0 + 20 * number))
    folders = ["--frames", str(tmp_path / "frames"), "--clips", str(tmp_path / "clips")]
    limits = ["--last-s", "30", "--count", "3", "--max-iterations", "3"]
    assert watch(tmp_path, *folders, *limits) == 2
    first, second, third = lines_of(tmp_path / "all.jsonl")
    assert "holds 2 bytes" in second["error"]
    assert first["figures"] == third["figures"]
    assert first["figures"]["ramp_share"] > 0.0
    assert first["figures"]["side_by_side"]
    assert len(first["interference"]) > 0
    told = capsys.readouterr().err
    assert "c0.bin frame 0: " in told
    assert "Yes, with separation" in told
    # The clip of the third reaches back over the second, not the first.
    clips = {path.name: sorted(os.listdir(path)) for path in (tmp_path / "clips").iterdir()}
    assert clips == {"c0": ["c0.bin"], "c2": ["c1.bin", "c2.bin"]}
    assert read_frame(tmp_path / "frames" / "c0-0.npz").radar.num_samples == 128


def test_all_frames_of_a_capture_are_taken(tmp_path: Path, raw_capture: Any) -> None:
    (tmp_path / "in").mkdir()
    ramps = len(raw_capture.received)
    (tmp_path / "radar.yaml").write_bytes(raw_capture.settings + f"num_ramps: {ramps}\n".encode())
    (tmp_path / "in" / "two.bin").write_bytes(2 * raw_capture.content)
    assert (
        watch(tmp_path, "--idle-s", "0.1", "--max-iterations", "1", "--estimator", "object-only")
        == 0
    )
    assert [line["frame"] for line in lines_of(tmp_path / "all.jsonl")] == [0, 1]


def test_a_folder_that_is_not_there_is_told(tmp_path: Path, refused: Callable[..., str]) -> None:
    (tmp_path / "radar.yaml").write_text("format: npy\n")
    arguments = ["watch", str(tmp_path / "none"), "--settings", str(tmp_path / "radar.yaml")]
    assert "cannot be watched" in refused(*arguments, "--out", str(tmp_path / "a.jsonl"))
