"""``vsep stream``: result lines of sequences, of files, a folder and a pipe."""

import io
import json
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from vsep_app.cli import main as cli

from tests.app.cli.helpers import lines_of
from vsep.files.frame import read_frame

Refused = Callable[..., str]
NUM_FRAMES = 8


@pytest.fixture(scope="module")
def street(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the first frames of the street."""
    folder = tmp_path_factory.mktemp("sequence") / "street"
    arguments = ["--preset", "street", "--seed", "1", "--frames", str(NUM_FRAMES)]
    assert cli.main(["simulate", *arguments, "--out", str(folder)]) == 0
    return folder


def test_a_folder_gives_a_line_a_frame_with_tracks(
    street: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "lines.jsonl"
    assert cli.main(["stream", str(street), "--out", str(out)]) == 0
    lines = lines_of(out)
    assert [line["frame"] for line in lines] == list(range(NUM_FRAMES))
    assert [line["start"] for line in lines[:2]] == ["cold", "clean"]
    assert [Path(line["file"]).name for line in lines] == [
        f"{number:06d}.npz" for number in range(NUM_FRAMES)
    ]
    last = lines[-1]
    for track in last["tracks"]:
        if track["object"] is not None:
            found = last["objects"][track["object"]]
            assert track["range_m"] == pytest.approx(found["range_m"], abs=0.05)
    assert sum(track["confirmed"] for track in last["tracks"]) >= 8
    told = capsys.readouterr().err
    assert f"{NUM_FRAMES} frames in" in told
    assert "1 cold" in told


def test_files_in_order_are_the_folder(street: Path, tmp_path: Path) -> None:
    files = sorted(map(str, street.glob("*.npz")))
    outs = [tmp_path / "files.jsonl", tmp_path / "folder.jsonl"]
    for sources, out in zip((files, [str(street)]), outs, strict=True):
        assert cli.main(["stream", *sources, "--out", str(out)]) == 0
    first, second = ([line | {"seconds": 0} for line in lines_of(out)] for out in outs)
    assert first == second


def test_a_pipe_gives_the_objects_of_the_files(
    street: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    files = sorted(street.glob("*.npz"))[:3]
    content = io.BytesIO()
    for file in files:
        np.save(content, read_frame(file).received)
    content.seek(0)
    monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(content))
    piped, filed = tmp_path / "piped.jsonl", tmp_path / "filed.jsonl"
    assert cli.main(["stream", "-", "--like", str(files[0]), "--out", str(piped)]) == 0
    assert cli.main(["stream", *map(str, files), "--out", str(filed)]) == 0
    for first, second in zip(lines_of(piped), lines_of(filed), strict=True):
        assert first["objects"] == second["objects"]
        assert first["tracks"] == second["tracks"]


def test_a_frame_that_cannot_be_read_leaves_a_gap(
    street: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    files = sorted(map(str, street.glob("*.npz")))
    broken = tmp_path / "broken.npz"
    broken.write_bytes(b"no archive")
    out = tmp_path / "lines.jsonl"
    sources = [*files[:4], str(broken), *files[5:]]
    assert cli.main(["stream", *sources, "--out", str(out)]) == 2
    lines = lines_of(out)
    assert "broken.npz" in lines[4]["error"]
    assert "broken.npz" in capsys.readouterr().err
    before, after = (
        {track["track"] for track in line["tracks"] if track["confirmed"]}
        for line in (lines[3], lines[5])
    )
    assert lines[5]["start"] != "cold"
    assert before == after


def test_every_folder_is_a_sequence_of_its_own(street: Path, tmp_path: Path) -> None:
    other = tmp_path / "other"
    other.mkdir()
    for number in range(2):
        name = f"{number:06d}.npz"
        (other / name).write_bytes((street / name).read_bytes())
    out = tmp_path / "lines.jsonl"
    assert cli.main(["stream", str(other), str(street), "--out", str(out)]) == 0
    lines = lines_of(out)
    assert [line["frame"] for line in lines] == [0, 1, *range(NUM_FRAMES)]
    assert lines[2]["start"] == "cold"


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (("-",), "needs --like FRAME"),
        (("-", "a.npz", "--like", "b.npz"), "is one sequence of its own"),
        (("a.npz", "--like", "b.npz"), "--like b.npz is for -"),
        (("a.npz", "--cycle-ms", "0"), "cycle_s is 0 s"),
        (("a.npz", "--false-alarm-rate", "-1"), "false_alarm_rate is -1"),
    ],
)
def test_what_cannot_be_done_is_refused(
    refused: Refused, tmp_path: Path, arguments: tuple[str, ...], sentence: str
) -> None:
    out = tmp_path / "lines.jsonl"
    assert sentence in refused("stream", *arguments, "--out", str(out))
    assert not out.exists()


def test_a_street_is_simulated_from_its_seed_with_its_settings(
    tmp_path: Path, refused: Refused
) -> None:
    first, second = tmp_path / "first.npz", tmp_path / "second.npz"
    for out, slope in ((first, "9.2"), (second, "8.6")):
        arguments = ["--preset", "street", "--interferer-slope", slope]
        assert cli.main(["simulate", *arguments, "--out", str(out)]) == 0
    assert read_frame(first).radar.shape == (32, 256)
    sentence = refused(
        "simulate", "--preset", "street", "--num-objects", "4", "--out", str(tmp_path / "x.npz")
    )
    assert "--num-objects is 4; street takes none" in sentence


def test_a_sequence_of_a_preset_moves_its_objects(tmp_path: Path, refused: Refused) -> None:
    folder = tmp_path / "sequence"
    arguments = ["simulate", "--preset", "simulation-2-a", "--frames", "3", "--out", str(folder)]
    assert cli.main(arguments) == 0
    frames = [read_frame(path) for path in sorted(folder.glob("*.npz"))]
    beats = np.array([frame.truth.beats for frame in frames if frame.truth is not None])
    assert len(beats) == 3
    # Equal steps: objects move at constant velocity.
    np.testing.assert_allclose(np.diff(beats, 2, axis=0), 0.0, atol=1e-12)
    assert np.abs(np.diff(beats, axis=0)).max() > 1e-4
    assert "a sequence has 1" in refused(*arguments, "--antennas", "2")


def test_lines_are_json(street: Path, tmp_path: Path) -> None:
    out = tmp_path / "lines.jsonl"
    cli.main(["stream", str(street / "000000.npz"), "--out", str(out)])
    assert json.loads(out.read_text())["tracks"][0]["hits"] == 1
