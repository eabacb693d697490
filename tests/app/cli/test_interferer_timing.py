"""``vsep interferer-timing``: from result lines to interferers, tables and pictures."""

import csv
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from vsep_app.cli import main as cli

from vsep.files.timing_lines import read_timings

SLOPE, OTHER, PERIOD, OTHER_PERIOD, RATE = 29e12, 10e12, 30e-6, 72.3e-6, 20e6


def result(num_ramps: int = 64, **changes: Any) -> dict[str, Any]:
    """A result line with the crossings of one interferer, worked out here."""
    bursts = []
    for ramp in range(num_ramps):
        for chirp in range(-10, 64):
            age = PERIOD * ramp - OTHER_PERIOD * chirp - 3e-6
            start = OTHER * age  # both radars start at the same frequency
            crossing = -start / (OTHER - SLOPE)
            if 0.0 <= crossing <= 400 / RATE and 0.0 <= age + crossing <= OTHER_PERIOD:
                bursts.append(
                    {
                        "ramp": ramp,
                        "start_frequency_hz": start,
                        "slope_hz_per_s": OTHER - SLOPE,
                        "num_components": 1,
                    }
                )
    radar = {
        "start_frequency_hz": 77e9,
        "slope_hz_per_s": SLOPE,
        "sample_rate_hz": RATE,
        "ramp_period_s": PERIOD,
        "num_samples": 400,
        "num_ramps": num_ramps,
        "lowest_beat": -0.5,
    }
    return {"file": "a.npz", "radar": radar, "interference": bursts} | changes


@pytest.fixture
def results(tmp_path: Path) -> Callable[..., str]:
    def write(*lines: Any) -> str:
        path = tmp_path / "results.jsonl"
        path.write_text("".join(json.dumps(line) + "\n" for line in lines))
        return str(path)

    return write


def test_an_interferer_is_described(
    results: Callable[..., str], capsys: pytest.CaptureFixture[str]
) -> None:
    path = results(result(), {"file": "b.npz", "error": "b.npz does not exist."})
    assert cli.main(["interferer-timing", path]) == 0
    line = json.loads(capsys.readouterr().out)
    (interferer,) = line["interferers"]
    assert interferer["slope_hz_per_s"] == pytest.approx(OTHER, rel=1e-8)
    assert interferer["ramp_period_s"] == pytest.approx(OTHER_PERIOD, rel=1e-8)
    # Known up to whole intervals.
    turns = (interferer["time_offset_s"] - 3e-6) / OTHER_PERIOD
    assert turns == pytest.approx(round(turns), abs=1e-5)
    assert interferer["bursts"] == line["bursts"] == len(result()["interference"])
    assert "remark" not in line


def test_a_parallel_interferer_is_remarked(
    results: Callable[..., str], capsys: pytest.CaptureFixture[str]
) -> None:
    assert (
        cli.main(["interferer-timing", results(result(interference=[], parallel_ramps=[4, 7]))])
        == 0
    )
    line = json.loads(capsys.readouterr().out)
    assert line["interferers"] == []
    assert "Ramps 4, 7 hold a strong tone that others lack" in line["remark"]


def test_the_table_lists_every_burst(tmp_path: Path, results: Callable[..., str]) -> None:
    line = result()
    stray = line["interference"][0] | {"start_frequency_hz": 1e6, "slope_hz_per_s": 5e12}
    line["interference"].append(stray)
    out = tmp_path / "bursts.csv"
    assert cli.main(["interferer-timing", results(line), "--out", str(out)]) == 0
    with out.open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == len(line["interference"])
    own = [row for row in rows if row["interferer"] == "0"]
    assert len(own) == len(rows) - 1
    assert max(abs(float(row["residual_samples"])) for row in own) < 1e-6
    for row in own:
        difference = float(row["crossing_sample"]) - float(row["predicted_sample"])
        assert difference == pytest.approx(float(row["residual_samples"]), abs=1e-12)


@pytest.mark.parametrize(("suffix", "start"), [("png", b"\x89PNG"), ("svg", b"<?xml")])
def test_the_raster_is_drawn(
    tmp_path: Path, results: Callable[..., str], suffix: str, start: bytes
) -> None:
    for name, line in (("full", result()), ("empty", result(interference=[]))):
        out = tmp_path / f"{name}.{suffix}"
        assert cli.main(["interferer-timing", results(line), "--out", str(out)]) == 0
        assert out.read_bytes().startswith(start)


@pytest.mark.parametrize(
    ("lines", "words"),
    [
        ([], "holds no frame"),
        ([[1]], "line 1 is no result line"),
        ([result(), {"file": "b"}], "line 2 is no result line"),
        ([result(radar={"slope": 1})], "line 1 is no result line"),
        ([result(interference=[{"ramp": 0}])], "line 1 is no result line"),
        ([result(interference=3)], "line 1 is no result line"),
        ([result(parallel_ramps="x")], "line 1 is no result line"),
    ],
)
def test_what_is_no_result_is_told(
    results: Callable[..., str], capsys: pytest.CaptureFixture[str], lines: Any, words: str
) -> None:
    assert cli.main(["interferer-timing", results(*lines)]) == 2
    assert words in capsys.readouterr().err


def test_other_files_are_told(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "results.jsonl"
    for content, words in ((b"{", "line 1 is no result"), (b"\xff\xfe", "is no text")):
        path.write_bytes(content)
        assert cli.main(["interferer-timing", str(path)]) == 2
        assert words in capsys.readouterr().err
    assert cli.main(["interferer-timing", str(tmp_path / "nowhere.jsonl")]) == 2
    assert "No such file" in capsys.readouterr().err
    assert cli.main(["interferer-timing", str(path), "--out", "a.pdf"]) == 2
    assert "must end in .png, .svg or .csv" in capsys.readouterr().err


def test_result_lines_of_separate_are_understood(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    frame, lines = tmp_path / "frame.npz", tmp_path / "results.jsonl"
    cli.main(["simulate", "--preset", "simulation-2-c", "--out", str(frame)])
    separate = ["separate", str(frame), "--max-iterations", "3", "--out", str(lines)]
    assert cli.main(separate) == 0
    (read,) = read_timings(str(lines))
    assert len(read.crossings.ramps) >= 8
    assert np.all(np.abs(read.crossings.samples) < 256)
    assert capsys.readouterr().err == ""
