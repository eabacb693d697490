"""``vsep simulate``: frame files with their truth."""

import errno
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from vsep_app.cli import main as cli
from vsep_app.cli import simulate
from vsep_app.cli.report import spec_of
from vsep_app.jobs.tasks import make_scene
from vsep_app.model.settings import Settings, preset_values

import vsep
from tests.app.cli.helpers import lines_of
from vsep.files.frame import read_frame
from vsep.parameters import FILTER_PARAMETERS, SCENE_PARAMETERS

FrameArrays = Callable[..., dict[str, Any]]
Refused = Callable[..., str]


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
    assert frame.settings == {"preset": preset, "snr_db": "40.0", "sir_db": "-10.5", "seed": "7"}
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


def test_every_setting_of_the_page_is_an_option_and_gives_the_frame_of_the_page(
    tmp_path: Path,
) -> None:
    changed = {
        "snr_db": 50.0,
        "sir_db": -5.0,
        "interferer_slope": 9.6,
        "interferer_waveform": "two-profiles",
        "burst_shift": -1.5,
        "interference_model": "convolution",
        "second_interferer": True,
        "num_objects": 13,
        "seed": 5,
        "num_cars": 1,
        "object_acceleration": 5.0,
        "doppler_division": "2/3",
        "phase_jitter": 3.0,
        "phase_noise": 2.0,
        "phase_noise_bandwidth": 50.0,
        "iq_gain": -0.4,
        "iq_phase": 1.5,
        "dc_offset": 3.0,
        "filter_kind": "butterworth",
        "filter_cutoff": 1.1,
        "filter_order": 4,
        "assumed_kind": "raised_cosine",
        "assumed_cutoff": 1.2,
        "assumed_rolloff": 0.5,
    }
    others = {"interference", "assume_true_filter", "filter_rolloff", "assumed_order"}
    page = {each.name for each in (*SCENE_PARAMETERS, *FILTER_PARAMETERS)}
    assert changed.keys() | others == page
    out, options = tmp_path / "frame.npz", ["--preset", "simulation-2-b"]
    for name, value in changed.items():
        options += ["--" + name.replace("_", "-")] + [str(value)] * (value is not True)
    assert cli.main(["simulate", *options, "--out", str(out)]) == 0
    frame = read_frame(out)
    settings = Settings(
        **{**preset_values("simulation-2-b"), **changed, "assume_true_filter": False}
    )
    of_page = make_scene(settings.plan())
    assert np.array_equal(frame.received, of_page.frame.received)
    assert frame.assumed_filter == of_page.assumed_filter
    assert frame.assumed_filter == vsep.RaisedCosineFilter(cutoff_hz=1.2e6, rolloff=0.5)
    assert frame.truth is not None
    groups = frame.truth.groups.reshape(2, -1)[0]  # of the lines of the first transmitter
    assert list(groups[:13]) == [-1] * 13
    assert set(groups[13:]) == {0}
    ramps = [burst.ramp for burst in frame.truth.bursts]
    assert len(ramps) > len(set(ramps))  # two in a ramp
    told = {
        ("true_" if name.startswith("filter_") else "") + name: str(1 if value is True else value)
        for name, value in changed.items()
        if not name.startswith("assumed_")
    }
    assert frame.settings == {"preset": "simulation-2-b", **told}
    spec = spec_of(cli.parse(["report", *options]))
    assert spec.plan == settings.plan()


def test_antennas_receive_through_the_filter_that_is_asked_for(tmp_path: Path) -> None:
    def truth(count: int, *options: str) -> vsep.GroundTruth:
        out = str(tmp_path / "frame.npz")
        scene = ["--preset", "simulation-2-b", "--second-interferer", "--out", out, *options]
        assert cli.main(["simulate", *scene, "--antennas", str(count)]) == 0
        found = read_frame(out).truth
        assert found is not None
        return found

    butterworth = ("--filter-kind", "butterworth")
    one, two = truth(1, *butterworth), truth(2, *butterworth)
    assert np.allclose(one.object_signal, two.object_signal)
    assert [burst.ramp for burst in one.bursts] == [burst.ramp for burst in two.bursts]
    assert not np.allclose(truth(2).interference_signal, two.interference_signal, rtol=0.1)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        (
            {"--antenna-spacing-wavelengths": "0.5"},
            "--antenna-spacing-wavelengths is 0.5; one antenna takes none (an array does)",
        ),
        (
            {"--sir-db": "3", "--no-interference": None},
            "--sir-db is 3.0; a scene without one takes none (a scene with an interferer does)",
        ),
        ({"--antennas": "0"}, "--antennas: 0 is given"),
        ({"--antennas": "2", "--object-angles-deg": "95"}, "object_angles_deg is 95 degrees"),
        ({"--antennas": "2", "--antenna-spacing-wavelengths": "0"}, "spacing_wavelengths is 0"),
        ({"--preset": "simulation-3"}, "invalid choice: 'simulation-3'"),
        ({"--snr-db": "nan"}, "SNR is nan dB"),
        ({"--snr-db": "loud"}, "invalid float value: 'loud'"),
        ({"--sir-db": "1e9"}, "SIR is 1e+09 dB"),
        ({"--seed": "-1"}, "--seed: -1 is given"),
        ({"--seed": "1.5"}, "invalid integer value: '1.5'"),
        ({"--seed": str(2**63)}, "must lie between 0 and 9223372036854775807"),
        ({"--out": "frame.txt"}, "must end in .npz"),
        ({"--out": "nowhere/frame.npz"}, "nowhere is no folder"),
        ({"--noise": "1"}, "unrecognized arguments"),
        ({"--interferer-slope": "900"}, "Interferer slope is 900 MHz/µs; it must lie between"),
        ({"--num-objects": "41"}, "41 is given, it must lie between 1 and 40"),
        ({"--interference-model": "exact"}, "invalid choice: 'exact'"),
        (
            {"--filter-order": "4"},
            "--filter-order is 4; --filter-kind raised_cosine takes none (--filter-kind",
        ),
        (
            {"--assumed-kind": "none", "--assumed-cutoff": "2"},
            "--assumed-cutoff is 2.0; --assumed-kind none takes none (--assumed-kind",
        ),
        (
            {"--second-interferer": None, "--no-interference": None},
            "--second-interferer is given; a scene without one takes none",
        ),
    ],
)
def test_simulate_refuses_in_one_sentence(
    refused: Refused,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    changes: dict[str, str | None],
    words: str,
) -> None:
    monkeypatch.chdir(tmp_path)
    options = {"--preset": "simulation-1", "--out": "frame.npz"} | changes
    assert words in refused(
        "simulate", *(text for pair in options.items() for text in pair if text is not None)
    )
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("code", [errno.ENOSPC, errno.EACCES])
def test_a_failing_disk_is_reported(
    refused: Refused, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, code: int
) -> None:
    def fail(*arguments: Any) -> None:
        raise OSError(code, os.strerror(code), arguments[0])

    monkeypatch.setattr(simulate, "write_frame", fail)
    out = str(tmp_path / "frame.npz")
    sentence = refused("simulate", "--preset", "simulation-1", "--out", out)
    assert sentence == f"vsep: {out}: {os.strerror(code)}.\n"
