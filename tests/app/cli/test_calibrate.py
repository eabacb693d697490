import json

import numpy as np
import pytest
from vsep_app.cli.main import main

from tests.vsep.test_calibrate import simulated_recording


@pytest.fixture
def recorded(tmp_path):
    """A frame file in the sign of a sensor with positive beat frequencies."""
    received, _ = simulated_recording()
    path = tmp_path / "drive.npz"
    _write(path, received[0].conj())
    return path


def _write(path, received, **changes):
    values = {
        "received": received,
        "sample_rate_hz": 10e6,
        "slope_hz_per_s": 30e12,
        "start_frequency_hz": 77e9,
        "ramp_period_s": 30e-6,
        "beat_sign": 1,
    }
    np.savez(path, **(values | changes))


def test_a_response_is_written_and_used(recorded, tmp_path, capsys):
    response, results = tmp_path / "response.npz", tmp_path / "results.jsonl"
    # In the sign of the file the bursts sweep upwards.
    arguments = [str(recorded), "--slope-difference", "10e12", "--out", str(response)]
    assert main(["calibrate", *arguments]) == 0
    said = capsys.readouterr().out
    assert "slope difference    10.0000 MHz/us" in said
    assert "sections" in said
    with np.load(response) as stored:
        assert stored["filter_response"].shape == stored["filter_frequency_hz"].shape
        assert float(stored["slope_difference_hz_per_s"]) == 10e12
        assert str(stored["sources"]) == "drive.npz"
    options = ["--response", str(response), "--clutter", "remove", "--max-iterations", "3"]
    assert main(["separate", str(recorded), *options, "--out", str(results)]) == 0
    line = json.loads(results.read_text())
    assert len(line["interference"]) > 10  # of 20 bursts, after three iterations
    # The object that stands still is left out: the strongest one moves.
    strongest = max(line["objects"], key=lambda each: each["component_snr_db"])
    assert abs(strongest["doppler"]) > 0.1


def test_a_frame_is_separated_by_the_response_of_its_own_bursts(recorded, tmp_path):
    response = str(tmp_path / "response.npz")
    assert main(["calibrate", str(recorded), "--out", response]) == 0

    def residual_db(name):
        folder = tmp_path / ("own" if name == "own" else "file")
        options = ["--clutter", "remove", "--max-iterations", "8", "--signals", str(folder)]
        options += ["--response", name, "--out", str(tmp_path / "lines.jsonl")]
        assert main(["separate", str(recorded), *options]) == 0
        with np.load(folder / "drive.npz") as signals, np.load(recorded) as frame:
            clutter = np.median(frame["received"].real, axis=0)
            clutter = clutter + 1j * np.median(frame["received"].imag, axis=0)
            left = frame["received"] - clutter - signals["object_signal"]
            return 10.0 * np.log10(np.mean(np.abs(left - signals["interference_signal"]) ** 2))

    assert residual_db("own") == pytest.approx(residual_db(response), abs=1e-6)


def test_every_antenna_of_a_frame_has_its_response(tmp_path, capsys):
    received, _ = simulated_recording()
    frame, response = str(tmp_path / "drive.npz"), str(tmp_path / "response.npz")
    _write(frame, np.stack([received[0], 2.0 * received[0]]).conj())
    assert main(["calibrate", frame, "--slope-difference", "10e12", "--out", response]) == 0
    with np.load(response) as stored:
        assert len(stored["filter_response"]) == 2
    options = ["--response", response, "--antenna", "2", "--out", str(tmp_path / "results.jsonl")]
    assert main(["separate", frame, *options]) == 2
    assert "the response has antennas 0 to 1" in capsys.readouterr().err


def test_recordings_of_two_receivers_are_refused(recorded, tmp_path, capsys):
    other = tmp_path / "other.npz"
    _write(other, np.ones((16, 64), complex), sample_rate_hz=5e6)
    out = str(tmp_path / "r.npz")
    assert main(["calibrate", str(recorded), str(other), "--out", out]) == 2
    assert "sample rate 5e+06 Hz" in capsys.readouterr().err


def test_a_recording_is_not_overwritten(recorded, capsys):
    assert main(["calibrate", str(recorded), "--out", str(recorded)]) == 2
    assert "is one of the recordings" in capsys.readouterr().err


def test_a_file_that_is_no_response_stops_the_run_at_once(recorded, tmp_path, capsys):
    out = str(tmp_path / "out.jsonl")
    assert main(["separate", str(recorded), "--response", str(recorded), "--out", out]) == 2
    assert "filter_frequency_hz" in capsys.readouterr().err


def test_clutter_of_a_few_ramps_stays(tmp_path, capsys):
    path = tmp_path / "short.npz"
    _write(path, np.ones((4, 64), complex))
    out = str(tmp_path / "out.jsonl")
    assert main(["separate", str(path), "--clutter", "remove", "--out", out]) == 2
    assert "4 ramps; to remove clutter at least 8 are needed" in capsys.readouterr().err
