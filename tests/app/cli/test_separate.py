"""``vsep separate``: result lines, signals, and what is refused."""

import contextlib
import os
import pty
import re
import signal
import subprocess
import termios
import time
from argparse import Namespace
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from vsep_app.cli import main as cli
from vsep_app.cli import separate as commands

from tests.app.cli.helpers import COMMAND, INTERRUPTIBLE, lines_of, start_process
from vsep.files.frame import read_frame
from vsep.inference.factorised import FactorisedSeparator
from vsep.inference.objects.object_only import ObjectOnlySeparator
from vsep.signal.filters import NoFilter
from vsep.signal.template import SignalModel

FrameArrays = Callable[..., dict[str, Any]]
Refused = Callable[..., str]


def test_separate_writes_one_line_per_frame_in_order(
    tmp_path: Path, frame_file: Callable[..., str]
) -> None:
    frames = [frame_file(name) for name in ("b.npz", "a.npz", "c.npz")]
    out = tmp_path / "results.jsonl"
    assert cli.main(["separate", *frames, "--out", str(out)]) == 0
    lines = lines_of(out)
    assert [line["file"] for line in lines] == frames
    for line in lines:
        (entry,) = line["objects"]
        # The frame's only object; its total SNR of 44 dB leaves 2e-4 of a cell to be wrong by.
        assert entry["beat"] == pytest.approx(0.2, abs=0.01 / 32)
        assert entry["doppler"] == pytest.approx(0.1, abs=0.01 / 4)


def test_separate_finds_the_burst_and_the_object_of_simulation_1(tmp_path: Path) -> None:
    frame, out = tmp_path / "frame.npz", tmp_path / "results.jsonl"
    levels = ["--snr-db", "30", "--sir-db", "-15", "--seed", "3"]
    cli.main(["simulate", "--preset", "simulation-1", *levels, "--out", str(frame)])
    assert cli.main(["separate", str(frame), "--out", str(out)]) == 0
    (line,) = lines_of(out)
    truth = read_frame(frame).truth
    assert truth is not None
    # Five standard deviations: one run of a fixed seed in a million would exceed them.
    nearest = min(line["objects"], key=lambda entry: abs(entry["beat"] - truth.beats[0]))
    assert abs(nearest["beat"] - truth.beats[0]) < 5 * nearest["beat_std"]
    (burst,) = line["interference"]
    # SIR -15 dB of a unit object: 31.6; the noise within the burst is 30 dB lower.
    assert burst["energy"] == pytest.approx(10**1.5, rel=0.03)
    assert burst["slope_hz_per_s"] == pytest.approx(truth.bursts[0].slope_hz_per_s, rel=0.01)


def test_separate_takes_all_antennas_together_or_the_one_asked_for(
    tmp_path: Path, frame_file: Callable[..., str], capsys: pytest.CaptureFixture[str]
) -> None:
    noise = np.random.default_rng(6).normal(scale=0.05, size=(2, 4, 4, 32))
    angle = np.exp(2j * np.pi * 0.5 * np.sin(np.radians(-20.0)) * np.arange(4))
    clean = np.exp(-2j * np.pi * (0.2 * np.arange(32) + 0.1 * np.arange(4)[:, None]))
    frame = frame_file(
        received=angle[:, None, None] * clean + noise[0] + 1j * noise[1],
        antenna_spacing_wavelengths=0.5,
    )
    out = tmp_path / "results.jsonl"
    assert cli.main(["separate", frame, "--out", str(out), "--signals", str(tmp_path / "s")]) == 0
    assert capsys.readouterr().err == ""
    line = lines_of(out)[0]
    assert line["num_antennas"] == 4
    assert "antenna" not in line
    (entry,) = line["objects"]
    assert entry["beat"] == pytest.approx(0.2, abs=0.01 / 32)
    assert abs(entry["angle_deg"] + 20.0) < 4.0 * entry["angle_std_deg"] < 2.0
    with np.load(tmp_path / "s" / "frame.npz", allow_pickle=False) as signals:
        assert signals["cleaned"].shape == (4, 4, 32)
    assert cli.main(["separate", frame, "--antenna", "1", "--out", str(out)]) == 0
    assert capsys.readouterr().err == ""
    one = lines_of(out)[0]
    assert (one["antenna"], one["num_antennas"]) == (1, 4)
    assert "angle_deg" not in one["objects"][0]
    assert cli.main(["separate", frame, "--antenna", "4", "--out", str(out)]) == 2
    assert "antenna is 4; it must lie between 0 and 3" in capsys.readouterr().err


def test_an_estimator_for_one_antenna_takes_the_first_and_says_so(
    tmp_path: Path,
    frame_arrays: FrameArrays,
    frame_file: Callable[..., str],
    capsys: pytest.CaptureFixture[str],
) -> None:
    one = frame_arrays()["received"]
    frame = frame_file(received=np.stack([one, one.conj()]))
    out = tmp_path / "results.jsonl"
    assert cli.main(["separate", frame, "--estimator", "joint", "--out", str(out)]) == 0
    said = capsys.readouterr().err
    assert "holds 2 antennas, of which this estimator takes one: antenna 0 is separated" in said
    first = lines_of(out)[0]
    assert (first["antenna"], first["num_antennas"]) == (0, 2)
    assert first["objects"][0]["beat"] == pytest.approx(0.2, abs=0.01 / 32)


def test_what_stands_still_is_removed_at_every_antenna(
    tmp_path: Path, frame_file: Callable[..., str]
) -> None:
    rng = np.random.default_rng(8)
    sample, ramp = np.arange(32), np.arange(8)[:, None]
    still, moving = (
        np.exp(-2j * np.pi * 0.3 * sample),
        np.exp(-2j * np.pi * (0.1 * sample + ramp / 4)),
    )
    noise = rng.normal(scale=0.02, size=(2, 2, 8, 32))
    frame = frame_file(received=10.0 * still + moving + noise[0] + 1j * noise[1])
    out = tmp_path / "results.jsonl"
    assert cli.main(["separate", frame, "--clutter", "remove", "--out", str(out)]) == 0
    beats = [entry["beat"] for entry in lines_of(out)[0]["objects"]]
    assert any(beat == pytest.approx(0.1, abs=0.01 / 32) for beat in beats)
    assert not any(beat == pytest.approx(0.3, abs=0.5 / 32) for beat in beats)


@pytest.mark.parametrize("beat_sign", [-1, 1])
def test_separate_answers_in_the_paper_sign_and_writes_signals_in_that_of_the_file(
    tmp_path: Path, frame_arrays: FrameArrays, frame_file: Callable[..., str], beat_sign: int
) -> None:
    stored = frame_arrays()["received"]
    stored = stored if beat_sign == -1 else stored.conj()
    frame = frame_file(received=stored, beat_sign=beat_sign)
    out, folder = tmp_path / "results.jsonl", tmp_path / "new" / "signals"
    assert cli.main(["separate", frame, "--out", str(out), "--signals", str(folder)]) == 0
    assert lines_of(out)[0]["objects"][0]["beat"] == pytest.approx(0.2, abs=0.01 / 32)
    with np.load(folder / "frame.npz", allow_pickle=False) as signals:
        assert np.array_equal(signals["cleaned"], stored - signals["interference_signal"])
        residual = stored - signals["object_signal"] - signals["interference_signal"]
    # Noise of 2 * 0.05^2 a sample is left; 128 samples scatter by 9 %, so five times that.
    assert np.mean(np.abs(residual) ** 2) == pytest.approx(0.005, rel=0.45)


def test_a_vector_comes_back_as_a_vector(
    tmp_path: Path, frame_arrays: FrameArrays, frame_file: Callable[..., str]
) -> None:
    frame = frame_file(received=frame_arrays()["received"][0])
    out = tmp_path / "results.jsonl"
    assert cli.main(["separate", frame, "--out", str(out), "--signals", str(tmp_path / "s")]) == 0
    with np.load(tmp_path / "s" / "frame.npz", allow_pickle=False) as signals:
        assert signals["object_signal"].shape == (32,)
    assert lines_of(out)[0]["objects"][0]["doppler_std"] is None


MODEL = SignalModel(
    num_ramps=4, num_samples=32, sample_rate_hz=5.1e6, anti_aliasing_filter=NoFilter()
)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("", FactorisedSeparator(model=MODEL, false_alarm_rate=0.05, schedule="robust")),
        ("--estimator object-only", ObjectOnlySeparator(model=MODEL, false_alarm_rate=0.05)),
        ("--schedule paper", FactorisedSeparator(model=MODEL, schedule="paper")),
        ("--object-threshold-db 9", FactorisedSeparator(model=MODEL, object_threshold_db=9.0)),
        ("--false-alarm-rate 1e-3", FactorisedSeparator(model=MODEL, false_alarm_rate=1e-3)),
        (
            "--interference-threshold-db 4 --max-iterations 7",
            FactorisedSeparator(model=MODEL, interference_threshold_db=4.0, max_iterations=7),
        ),
        (
            "--estimator object-only --object-threshold-db 9 --max-iterations 7",
            ObjectOnlySeparator(model=MODEL, object_threshold_db=9.0, max_iterations=7),
        ),
    ],
)
def test_options_describe_the_estimator(text: str, expected: object) -> None:
    arguments = ["separate", "frame.npz", "--out", "out", *text.split()]
    options = cli.parse(arguments)
    assert commands.make_separator(options, MODEL) == expected


def test_a_run_stops_at_the_largest_number_of_iterations(
    tmp_path: Path, frame_file: Callable[..., str]
) -> None:
    out = tmp_path / "results.jsonl"
    assert cli.main(["separate", frame_file(), "--out", str(out), "--max-iterations", "1"]) == 0
    assert [(line["iterations"], line["termination"]) for line in lines_of(out)] == [
        (1, "max_iterations")
    ]


def test_one_unreadable_frame_does_not_lose_the_others(
    tmp_path: Path, frame_file: Callable[..., str], capsys: pytest.CaptureFixture[str]
) -> None:
    frames = [frame_file("a.npz"), str(tmp_path / "absent.npz"), frame_file("c.npz")]
    out = tmp_path / "results.jsonl"
    assert cli.main(["separate", *frames, "--out", str(out)]) == 2
    lines = lines_of(out)
    assert [line["file"] for line in lines] == frames
    assert ["error" in line for line in lines] == [False, True, False]
    assert set(lines[1]) == {"file", "error"}
    error, throughput = capsys.readouterr().err.splitlines()
    assert error == f"vsep: {lines[1]['error']}"
    assert re.fullmatch(r"2 frames in .* s on 1 process: .* frames per second", throughput)


def test_several_processes_write_the_same_lines_in_the_same_order(
    tmp_path: Path, frame_file: Callable[..., str]
) -> None:
    frames = [frame_file("a.npz"), str(tmp_path / "absent.npz"), frame_file("c.npz")]
    results = []
    for workers in ("1", "2"):
        out = tmp_path / f"{workers}.jsonl"
        assert cli.main(["separate", *frames, "--out", str(out), "--workers", workers]) == 2
        results.append([line | {"seconds": 0.0} for line in lines_of(out)])
    assert results[0] == results[1]


def test_a_profile_says_where_the_time_went(
    tmp_path: Path, frame_file: Callable[..., str], capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "results.jsonl"
    assert cli.main(["separate", frame_file(), "--out", str(out), "--profile"]) == 0
    (line,) = lines_of(out)
    assert list(line["profile"]) == ["bursts and channels", "burst search", "objects", "the rest"]
    # Written to a microsecond each.
    assert sum(line["profile"].values()) == pytest.approx(line["seconds"], abs=3e-6)
    table = capsys.readouterr().err.splitlines()
    assert [row[:22].rstrip() for row in table] == list(line["profile"])


def test_a_frame_beyond_the_memory_does_not_lose_the_others(
    tmp_path: Path, frame_file: Callable[..., str], monkeypatch: pytest.MonkeyPatch
) -> None:
    frames = [frame_file("large.npz"), frame_file("small.npz")]
    solve = commands.run_estimator

    def limited(*arguments: Any, **_: Any) -> Any:
        monkeypatch.setattr(commands, "run_estimator", solve)
        raise MemoryError(*arguments[2:])

    monkeypatch.setattr(commands, "run_estimator", limited)
    out = tmp_path / "results.jsonl"
    assert cli.main(["separate", *frames, "--out", str(out)]) == 2
    assert ["error" in line for line in lines_of(out)] == [True, False]


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--false-alarm-rate", "2e9"], "false_alarm_rate is 2e+09 per frame"),
        (["--false-alarm-rate", "-1"], "false_alarm_rate is -1 per frame"),
        (["--false-alarm-rate", "nan"], "false_alarm_rate is nan per frame"),
        (["--object-threshold-db", "inf"], "object_threshold_db is inf dB"),
        (["--interference-threshold-db", "nan"], "interference_threshold_db is nan dB"),
        (["--object-threshold-db", "9", "--false-alarm-rate", "0.05"], "not allowed with"),
        (["--max-iterations", "0"], "max_iterations is 0"),
        (["--max-iterations", "many"], "invalid int value: 'many'"),
        (["--estimator", "magic"], "estimator is 'magic'; it must be one of factorised, joint"),
        (
            ["--estimator", "object-only", "--schedule", "paper"],
            "--schedule is paper; object-only takes none (factorised, joint and evidence do).",
        ),
        (
            ["--estimator", "masked", "--interference-threshold-db", "40"],
            "--interference-threshold-db is 40.0; masked takes none (factorised, joint and "
            "evidence do).",
        ),
        (["--mask", "truth"], "--mask is truth; factorised takes none (masked does)."),
        (["--estimator", "object-only", "--interferer-timing"], "factorised or joint"),
        (["--sched", "paper"], "unrecognized arguments"),
    ],
)
def test_absurd_options_are_refused_before_anything_is_written(
    refused: Refused, tmp_path: Path, frame_file: Callable[..., str], options: list[str], words: str
) -> None:
    frames = [frame_file("a.npz"), frame_file("b.npz")]
    out = tmp_path / "results.jsonl"
    assert words in refused("separate", *frames, "--out", str(out), *options)
    assert not out.exists()


def test_outputs_never_overwrite_a_frame(refused: Refused, frame_file: Callable[..., str]) -> None:
    frame = frame_file()
    content = Path(frame).read_bytes()
    folder = str(Path(frame).parent)
    assert "is one of the frames" in refused("separate", frame, "--out", frame)
    other = f"{folder}/results.jsonl"
    assert "would overwrite" in refused("separate", frame, "--out", other, "--signals", folder)
    assert Path(frame).read_bytes() == content


def test_signals_of_frames_of_one_name_are_refused(
    refused: Refused, tmp_path: Path, frame_file: Callable[..., str]
) -> None:
    frames = [frame_file("a/frame.npz"), frame_file("b/frame.npz")]
    out = str(tmp_path / "results.jsonl")
    folder = str(tmp_path / "signals")
    assert "2 frames are named frame" in refused(
        "separate", *frames, "--out", out, "--signals", folder
    )


def test_unwritable_outputs_are_refused(
    refused: Refused, tmp_path: Path, frame_file: Callable[..., str]
) -> None:
    frame = frame_file()
    absent = str(tmp_path / "absent" / "results.jsonl")
    assert "absent is no folder" in refused("separate", frame, "--out", absent)
    assert "Is a directory" in refused("separate", frame, "--out", str(tmp_path))
    out = str(tmp_path / "results.jsonl")
    assert "File exists" in refused("separate", frame, "--out", out, "--signals", frame)


def test_a_terminal_shows_progress_for_several_frames_only(
    tmp_path: Path, frame_file: Callable[..., str]
) -> None:
    def shown(*frames: str) -> str:
        terminal, end = pty.openpty()
        termios.tcsetwinsize(terminal, (24, 80))
        process = start_process(
            COMMAND, "separate", *frames, "--out", str(tmp_path / "r.jsonl"), stderr=end
        )
        os.close(end)
        assert process.wait(60) == 0
        process.communicate()
        with contextlib.suppress(OSError), open(terminal, "rb", buffering=0) as stream:
            # The few lines of a progress bar fit into the terminal's own buffer.
            return stream.read(10_000).decode()
        return ""

    assert "2/2" in shown(frame_file("a.npz"), frame_file("b.npz"))
    # Of a single frame that takes long, as on a busy machine, the iterations are shown.
    pieces = [piece.strip() for piece in shown(frame_file("a.npz")).split("\r")]
    assert all(
        re.match(r"a\.npz: \d+ of at most 100 iterations", piece) for piece in pieces if piece
    )


# As a shell starts what a script puts into the background.
SIGINT_IGNORED = ("sh", "-c", 'trap "" INT; exec "$@"', "sh")


def after_the_first_line(process: subprocess.Popen[str], out: Path) -> tuple[int, str]:
    """Interrupt a run once it has written a line; return its exit code and standard error."""
    deadline = time.monotonic() + 60.0
    while (not out.exists() or not out.read_text()) and time.monotonic() < deadline:
        time.sleep(0.01)
    process.send_signal(signal.SIGINT)
    _, errors = process.communicate(timeout=60)
    return process.returncode, errors


@pytest.mark.parametrize("before", [(), SIGINT_IGNORED], ids=["plain", "ignored"])
def test_an_interrupted_run_keeps_the_lines_it_has(
    tmp_path: Path, frame_file: Callable[..., str], before: tuple[str, ...]
) -> None:
    out = tmp_path / "results.jsonl"
    frames = [frame_file()] * 10_000
    process = start_process(INTERRUPTIBLE, "separate", *frames, "--out", str(out), before=before)
    assert after_the_first_line(process, out) == (130, "vsep: interrupted.\n")
    assert lines_of(out)


def test_a_run_in_the_background_of_a_script_is_not_interrupted(
    tmp_path: Path, frame_file: Callable[..., str]
) -> None:
    out = tmp_path / "results.jsonl"
    frames = [frame_file()] * 400
    options = ("--workers", "1", "--out", str(out))
    process = start_process(COMMAND, "separate", *frames, *options, before=SIGINT_IGNORED)
    code, errors = after_the_first_line(process, out)
    assert code == 0
    assert "interrupted" not in errors
    assert len(lines_of(out)) == 400


@pytest.mark.parametrize(
    ("asked", "frames", "cores", "expected"),
    [
        (None, 1, 8, 1),
        (None, 31, 8, 1),
        (None, 32, 8, 2),
        (None, 1000, 8, 8),
        (4, 1000, 8, 4),
        (4, 2, 8, 2),
    ],
)
def test_a_process_is_started_for_enough_frames(monkeypatch, asked, frames, cores, expected):
    monkeypatch.setattr(commands, "available_cores", lambda: cores)
    options = Namespace(workers=asked, frames=["frame.npz"] * frames)
    assert commands._num_workers(options) == expected


def test_what_the_evidence_kept_is_said_and_stands_in_the_line(tmp_path, frame_arrays, capsys):
    path, out = tmp_path / "frame.npz", tmp_path / "lines.jsonl"
    draws = np.random.default_rng(3).standard_normal((2, 16, 64))
    np.savez(path, **frame_arrays(received=draws[0] + 1j * draws[1]))
    assert cli.main(["separate", str(path), "--estimator", "evidence", "--out", str(out)]) == 0
    assert lines_of(out)[0]["choice"] == {"kept": "separation", "evidence_nats": None}
    assert "separation is kept, by the evidence of the objects" in capsys.readouterr().err


def test_an_interferer_of_the_same_slope_is_named(tmp_path, frame_arrays, capsys):
    rng = np.random.default_rng(2)
    draws = rng.standard_normal((2, 16, 64))
    received = draws[0] + 1j * draws[1]
    received[5:8] += 10.0 * np.exp(2j * np.pi * 0.21 * np.arange(64))
    path = tmp_path / "parallel.npz"
    np.savez(path, **frame_arrays(received=received))
    out = tmp_path / "lines.jsonl"
    assert cli.main(["separate", str(path), "--out", str(out)]) == 0
    assert lines_of(out)[0]["parallel_ramps"] == [5, 6, 7]
    said = capsys.readouterr().err
    assert "3 of its ramps, the first is ramp 5, hold a tone that the others lack" in said
    assert "--same-slope set-aside" in said
    assert any(abs(one["beat"] + 0.21) < 1 / 64 for one in lines_of(out)[0]["objects"])
    aside = ["separate", str(path), "--out", str(out), "--same-slope", "set-aside"]
    assert cli.main(aside) == 0
    assert lines_of(out)[0]["parallel_ramps"] == [5, 6, 7]
    assert all(abs(one["beat"] + 0.21) > 1 / 64 for one in lines_of(out)[0]["objects"])
    assert "they are set aside" in capsys.readouterr().err
