import contextlib
import errno
import json
import os
import pty
import re
import signal
import subprocess
import sys
import termios
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from vsep_app.cli import main as cli
from vsep_app.cli import separate as commands
from vsep_app.cli import simulate_commands

import vsep
from vsep.files.frame import read_frame
from vsep.inference.factorised import FactorisedSeparator
from vsep.inference.objects.object_only import ObjectOnlySeparator
from vsep.signal.filters import NoFilter
from vsep.signal.template import SignalModel

FrameArrays = Callable[..., dict[str, Any]]
Refused = Callable[..., str]


@pytest.fixture
def frame_file(tmp_path: Path, frame_arrays: FrameArrays) -> Callable[..., str]:
    """Write a small frame and return its path as a text."""

    def write(name: str = "frame.npz", **changes: Any) -> str:
        path = tmp_path / name
        path.parent.mkdir(exist_ok=True)
        np.savez(path, **frame_arrays(**changes))
        return str(path)

    return write


@pytest.fixture
def refused(capsys: pytest.CaptureFixture[str]) -> Refused:
    """Run a command that must end with code 2, and return its one sentence."""

    def sentence(*arguments: str) -> str:
        try:
            code = cli.main(arguments)
        except SystemExit as stop:
            code = stop.code
        assert code == 2
        text = capsys.readouterr().err
        assert text.startswith("vsep: ")
        assert text.count("\n") == 1
        return text

    return sentence


def lines_of(path: Path) -> list[dict[str, Any]]:
    return [json.loads(line) for line in path.read_text().splitlines()]


# simulate


@pytest.mark.parametrize(
    ("preset", "shape"), [("simulation-1", (1, 256)), ("simulation-2-b", (16, 128))]
)
def test_simulate_writes_a_frame_with_truth_and_settings(
    tmp_path: Path, preset: str, shape: tuple[int, int]
) -> None:
    out = tmp_path / "frame.npz"
    levels = ["--snr-db", "40", "--sir-db", "-10.5", "--seed", "7"]
    assert cli.main(["simulate", "--preset", preset, *levels, "--out", str(out)]) == 0
    frame = read_frame(out)
    assert frame.received.shape == shape
    assert frame.settings == {
        "preset": preset,
        "snr_db": "40.0",
        "sir_db": "-10.5",
        "seed": "7",
    }
    assert frame.anti_aliasing_filter == vsep.RaisedCosineFilter(
        cutoff_hz=frame.radar.sample_rate_hz / 4, rolloff=0.25
    )
    assert frame.truth is not None
    energies = [
        np.sum(np.abs(signal) ** 2)
        for signal in (frame.truth.object_signal, frame.truth.interference_signal)
    ]
    # (26) holds for the frame by construction.
    assert 10 * np.log10(energies[0] / energies[1]) == pytest.approx(-10.5, abs=1e-9)


def test_simulate_gives_the_same_bytes_for_the_same_seed(tmp_path: Path) -> None:
    for name, seed in (("a", "1"), ("b", "1"), ("c", "2")):
        out = str(tmp_path / f"{name}.npz")
        cli.main(["simulate", "--preset", "simulation-1", "--seed", seed, "--out", out])
    first, second, other = ((tmp_path / f"{name}.npz").read_bytes() for name in "abc")
    assert first == second
    assert first != other


def test_simulate_without_interference_keeps_objects_and_noise(tmp_path: Path) -> None:
    arguments = ["simulate", "--preset", "simulation-2-a", "--seed", "4"]
    cli.main([*arguments, "--out", str(tmp_path / "with.npz")])
    cli.main([*arguments, "--no-interference", "--out", str(tmp_path / "without.npz")])
    disturbed, clean = (read_frame(tmp_path / name) for name in ("with.npz", "without.npz"))
    assert disturbed.truth is not None
    assert clean.truth is not None
    assert np.array_equal(disturbed.truth.object_signal, clean.truth.object_signal)
    assert not clean.truth.interference_signal.any()
    assert "sir_db" not in clean.settings
    difference = disturbed.received - disturbed.truth.interference_signal - clean.received
    # Two roundings of sums whose terms are at most the largest magnitude.
    largest = np.abs(disturbed.received).max()
    assert np.abs(difference).max() <= 4 * np.finfo(float).eps * largest


def test_simulate_with_one_antenna_gives_the_bytes_that_it_gave(tmp_path: Path) -> None:
    arguments = ["simulate", "--preset", "simulation-2-c", "--seed", "9", "--out"]
    cli.main([*arguments, str(tmp_path / "plain.npz")])
    cli.main([*arguments, str(tmp_path / "one.npz"), "--antennas", "1"])
    assert (tmp_path / "plain.npz").read_bytes() == (tmp_path / "one.npz").read_bytes()
    frame = read_frame(tmp_path / "one.npz")
    _, observation = vsep.simulate_preset("simulation-2-c", snr_db=60.0, sir_db=-20.0, seed=9)
    assert np.array_equal(frame.received, observation.received)
    assert frame.antennas is frame.antenna_spacing_wavelengths is frame.antennas_truth is None


def test_simulated_antennas_are_separated_with_the_angles_of_their_truth(tmp_path: Path) -> None:
    out, results = tmp_path / "array.npz", tmp_path / "results.jsonl"
    levels = ["--preset", "simulation-1", "--antennas", "4", "--antenna-spacing-wavelengths", "0.4"]
    angles = ["--object-angles-deg", "-20", "--interferer-angle-deg", "31.5"]
    assert cli.main(["simulate", *levels, *angles, "--out", str(out)]) == 0
    frame = read_frame(out, antenna=2)
    truth = frame.antennas_truth
    assert truth is not None
    assert frame.truth is not None
    assert truth.object_signal.shape == (4, 1, 256)
    assert truth.angles_deg is not None
    assert truth.interferer_angles_deg is not None
    assert truth.angles_deg.tolist() == [-20.0]
    assert truth.interferer_angles_deg.tolist() == [31.5]
    assert np.array_equal(frame.truth.amplitudes, truth.amplitudes[:, 2])
    assert np.array_equal(frame.truth.interference_signal, truth.interference_signal[2])
    cli.main(["separate", str(out), "--out", str(results)])
    found = lines_of(results)[0]["objects"]
    assert len(found) == 1
    # One frame: five deviations are exceeded once in two million.
    assert abs(found[0]["angle_deg"] + 20.0) < 5.0 * found[0]["angle_std_deg"]


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        (
            {"--antenna-spacing-wavelengths": "0.5"},
            "--antennas is 1; --antenna-spacing-wavelengths",
        ),
        ({"--antennas": "0"}, "--antennas: 0 is given"),
        ({"--antennas": "2", "--object-angles-deg": "95"}, "object_angles_deg is 95 degrees"),
        ({"--antennas": "2", "--antenna-spacing-wavelengths": "0"}, "spacing_wavelengths is 0"),
        ({"--preset": "simulation-3"}, "invalid choice: 'simulation-3'"),
        ({"--snr-db": "nan"}, "SNR is nan dB"),
        ({"--snr-db": "loud"}, "invalid float value: 'loud'"),
        ({"--sir-db": "1e9"}, "SIR is 1e+09 dB"),
        ({"--seed": "-1"}, "--seed: -1 is given"),
        ({"--seed": "1.5"}, "invalid whole number value: '1.5'"),
        ({"--seed": str(2**63)}, "must lie between 0 and 9223372036854775807"),
        ({"--out": "frame.txt"}, "must end in .npz"),
        ({"--out": "nowhere/frame.npz"}, "nowhere is no folder"),
        ({"--noise": "1"}, "unrecognized arguments"),
    ],
)
def test_simulate_refuses_in_one_sentence(
    refused: Refused,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    changes: dict[str, str],
    words: str,
) -> None:
    monkeypatch.chdir(tmp_path)
    options = {"--preset": "simulation-1", "--out": "frame.npz"} | changes
    assert words in refused("simulate", *(text for pair in options.items() for text in pair))
    assert list(tmp_path.iterdir()) == []


# separate


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
    options = cli.build_parser().parse_args(arguments)
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
    solve = commands.run

    def limited(*arguments: Any, **_: Any) -> Any:
        monkeypatch.setattr(commands, "run", solve)
        raise MemoryError(*arguments[2:])

    monkeypatch.setattr(commands, "run", limited)
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
        (["--sched", "paper"], "unrecognized arguments"),
    ],
)
def test_absurd_options_are_refused_before_anything_is_written(
    refused: Refused,
    tmp_path: Path,
    frame_file: Callable[..., str],
    options: list[str],
    words: str,
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


# The command itself


def start_process(code: str, *arguments: str, **options: Any) -> "subprocess.Popen[str]":
    """Start Python on this checkout, whatever the folder."""
    environment = os.environ | {"PYTHONPATH": str(Path(vsep.__file__).parents[1])}
    return subprocess.Popen(
        [sys.executable, "-c", code, *arguments],
        env=environment,
        text=True,
        **{"stdout": subprocess.PIPE, "stderr": subprocess.PIPE} | options,
    )


COMMAND = "import sys; from vsep_app.cli.main import main; sys.exit(main())"


def test_version_and_help_are_given(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit, match="0"):
        cli.main(["--version"])
    assert capsys.readouterr().out == f"vsep {vsep.__version__}\n"
    for command in ("serve", "simulate", "separate", "report"):
        with pytest.raises(SystemExit, match="0"):
            cli.main([command, "--help"])
        assert "example" in capsys.readouterr().out


def test_no_command_is_an_error(refused: Refused) -> None:
    assert "COMMAND" in refused()
    assert "invalid choice: 'sing'" in refused("sing")


@pytest.mark.parametrize("port", ["-1", "65536", "http"])
def test_serve_refuses_a_port_that_is_none(refused: Refused, port: str) -> None:
    assert "--port" in refused("serve", "--port", port)


def test_a_process_ends_with_the_code_and_without_a_traceback(tmp_path: Path) -> None:
    (tmp_path / "frame.npz").write_text("no frame")
    process = start_process(
        COMMAND, "separate", "frame.npz", "--out", "results.jsonl", cwd=tmp_path
    )
    _, errors = process.communicate(timeout=60)
    assert errors.startswith("vsep: frame.npz is not a frame file")
    assert "Traceback" not in errors
    assert process.returncode == 2


@pytest.mark.parametrize("code", [errno.ENOSPC, errno.EACCES])
def test_a_failing_disk_is_reported(
    refused: Refused, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, code: int
) -> None:
    def fail(*arguments: Any) -> None:
        raise OSError(code, os.strerror(code), arguments[0])

    monkeypatch.setattr(simulate_commands, "write_frame", fail)
    out = str(tmp_path / "frame.npz")
    sentence = refused("simulate", "--preset", "simulation-1", "--out", out)
    assert sentence == f"vsep: {out}: {os.strerror(code)}.\n"


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


def test_an_interrupted_run_keeps_the_lines_it_has(
    tmp_path: Path, frame_file: Callable[..., str]
) -> None:
    out = tmp_path / "results.jsonl"
    process = start_process(COMMAND, "separate", *[frame_file()] * 10_000, "--out", str(out))
    deadline = time.monotonic() + 60.0
    while (not out.exists() or not out.read_text()) and time.monotonic() < deadline:
        time.sleep(0.01)
    process.send_signal(signal.SIGINT)
    _, errors = process.communicate(timeout=60)
    assert process.returncode == 130
    assert errors == "vsep: interrupted.\n"
    assert lines_of(out)


def test_a_reader_that_leaves_early_causes_no_traceback() -> None:
    code = (
        "import sys\nfrom vsep_app.cli import main as cli\n"
        "def speak(options):\n"
        "    sys.stdout.write('x' * 1_000_000)\n    return 0\n"
        "cli._serve = speak\nsys.exit(cli.main(['serve']))"
    )
    process = start_process(code)
    assert process.stdout is not None
    process.stdout.close()
    assert process.stderr is not None
    errors = process.stderr.read()
    process.stderr.close()
    assert process.wait(60) == 141
    assert errors == ""
