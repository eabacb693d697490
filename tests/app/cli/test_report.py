"""``vsep report``: sources, settings, outputs, and what is refused."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from vsep_app.cli import main as cli
from vsep_app.cli.report import spec_of


def spec(*arguments: str) -> Any:
    return spec_of(cli.parse(["report", *arguments]))


@pytest.fixture
def frame(tmp_path: Path, frame_arrays: Any) -> str:
    """A small frame file."""
    path = tmp_path / "frame.npz"
    np.savez(path, **frame_arrays(preset="simulation-2-a", seed=7, filter_kind="none"))
    return str(path)


def test_options_reach_plan_and_spec(frame: str) -> None:
    asked = "--schedule paper --object-threshold-db 9 --max-iterations 7 --ramp 2 --iterations 1,3"
    made = spec(frame, *asked.split(), "--interference-threshold-db", "4")
    assert (made.plan.schedule, made.plan.object_threshold_db) == ("paper", 9.0)
    assert (made.plan.max_iterations, made.ramp, made.iterations) == (7, 2, (1, 3))
    assert made.interference_threshold_db == 4.0
    plain = spec(frame)
    assert (plain.plan.estimator, plain.plan.false_alarm_rate) == ("factorised", 0.05)
    masked = spec(frame, "--estimator", "masked", "--mask", "amplitude")
    assert (masked.plan.estimator, masked.mask) == ("masked", "amplitude")


def test_a_preset_takes_levels_and_seed() -> None:
    made = spec("--preset", "simulation-2-c", "--sir-db", "-30", "--seed", "123456789012")
    assert (made.plan.preset, made.plan.snr_db, made.plan.sir_db) == ("simulation-2-c", 60.0, -30.0)
    assert made.plan.seed == 123456789012
    assert not spec("--preset", "simulation-1", "--no-interference").plan.interference


def test_all_outputs_come_from_one_run_and_can_be_made_again(tmp_path: Path, frame: str) -> None:
    names = {"--out": "a.json", "--record": "a.html", "--animate": "a.gif"}
    outputs = [part for flag, name in names.items() for part in (flag, str(tmp_path / name))]
    assert cli.main(["report", frame, "--iteration", "2", *outputs]) == 0
    told = json.loads((tmp_path / "a.json").read_text())
    assert told["result"]["iterations"] == 2
    # The frame is kept: it may be gone by then.
    Path(frame).unlink()
    again = str(tmp_path / "again.json")
    for name in names.values():
        assert cli.main(["report", "--from", str(tmp_path / name), "--out", again]) == 0
        assert Path(again).read_bytes() == (tmp_path / "a.json").read_bytes()


def test_several_frames_become_a_folder(
    tmp_path: Path, frame: str, capsys: pytest.CaptureFixture[str]
) -> None:
    absent, folder = str(tmp_path / "absent.npz"), tmp_path / "reports"
    code = cli.main(["report", frame, absent, "--out", str(folder), "--max-iterations", "1"])
    assert code == 2
    assert "absent.npz does not exist" in capsys.readouterr().err
    assert sorted(path.name for path in folder.iterdir()) == ["frame.html", "index.html"]


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ("--out a.html", "One thing to report on is needed"),
        ("frame.npz --preset simulation-1 --out a.html", "One thing to report on is needed"),
        ("--rows rows.jsonl --preset simulation-1 --out a.html", "One thing to report on"),
        ("frame.npz", "Nothing to write is named"),
        ("frame.npz --out a.svg", "must end in .html, .png, .pdf or .json"),
        ("frame.npz --record a.pdf", "must end in .html"),
        ("frame.npz --animate a.avi", "must end in .gif, .webp or .mp4"),
        ("frame.npz --out frame.npz", "is one of the frames"),
        ("--from a.html --out a.html", "is read, too"),
        ("frame.npz --out b.html --record b.html", "is named twice"),
        ("frame.npz --out absent/a.html", "is no folder"),
        ("absent.npz --out a.html", "does not exist"),
        ("frame.npz --seed 3 --out a.html", "--seed is 3; a frame file takes none (simulation-1"),
        (
            "frame.npz --estimator object-only --schedule robust --out a.html",
            "--schedule is robust; object-only takes none (factorised, joint and evidence do)",
        ),
        ("frame.npz other.npz --mask truth --out reports", "factorised takes none (masked does)"),
        ("--preset real-frame --snr-db 3 --out a.html", "--snr-db is 3.0; real-frame takes none"),
        (
            "--preset simulation-1 --no-interference --sir-db 3 --out a.html",
            "--sir-db is 3.0; a scene without one takes none (a scene with an interferer does)",
        ),
        ("--preset simulation-1 --iterations 1,2,3,4,5,6,7 --out a.html", "at most 6"),
        ("--preset simulation-1 --ramp -1 --out a.html", "must not be negative"),
        ("--preset simulation-1 --sir-db 1000 --out a.html", "SIR is 1000"),
        ("frame.npz other.npz --record a.html", "give --out FOLDER alone"),
        ("frame.npz other.npz --from a.html --out b.html", "needs one frame at most"),
        ("--from frame.npz --out a.html", "does not say how it was made"),
        (
            "--preset simulation-1 --antenna 1 --out a.html",
            "--antenna is 1; it can only be used with a frame file",
        ),
        ("frame.npz --antenna 1 --out a.html", "antenna"),
        ("--trial fig-3 --out a.html", "must read study/point"),
    ],
)
def test_what_cannot_be_reported_is_one_sentence(
    frame: str,
    monkeypatch: pytest.MonkeyPatch,
    refused: Callable[..., str],
    arguments: str,
    words: str,
) -> None:
    monkeypatch.chdir(Path(frame).parent)
    before = set(Path.cwd().iterdir())
    assert words in refused("report", *arguments.split())
    assert set(Path.cwd().iterdir()) == before


@pytest.mark.parametrize("numbers", ["a", "1,,2", "-1", ""])
def test_a_film_strip_needs_numbers(capsys: pytest.CaptureFixture[str], numbers: str) -> None:
    with pytest.raises(SystemExit, match="2"):
        cli.main(["report", "frame.npz", "--out", "a.html", f"--iterations={numbers}"])
    assert "--iterations" in capsys.readouterr().err


def test_a_recording_and_its_settings_make_a_report_at_once(
    tmp_path: Path, raw_capture: Any, refused: Callable[..., str]
) -> None:
    (tmp_path / "adc.bin").write_bytes(raw_capture.content)
    (tmp_path / "radar.yaml").write_bytes(raw_capture.settings)
    settings = ["--settings", str(tmp_path / "radar.yaml")]
    out = tmp_path / "report.json"
    more = ["--max-iterations", "2", "--out", str(out)]
    assert cli.main(["report", str(tmp_path / "adc.bin"), *settings, *more]) == 0
    assert "adc.bin" in out.read_text()
    assert "needs one recording" in refused("report", "a.bin", "b.bin", *settings, *more)
