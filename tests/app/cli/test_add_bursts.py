"""``vsep add-bursts``: the steps of the paper's Appendix C."""

import numpy as np
import pytest
from vsep_app.cli.main import main

import vsep
from vsep.calibration.burst_transfer import measured_bursts
from vsep.signal.filters import NoFilter

RADAR = vsep.ChirpSequence(
    start_frequency_hz=76.2e9,
    slope_hz_per_s=2.08e13,
    sample_rate_hz=40e6,
    ramp_period_s=44e-6,
    num_samples=256,
    num_ramps=32,
)


@pytest.fixture
def files(tmp_path):
    """A frame of a scene, and a measurement of a static one with a burst in every fourth ramp."""
    rng = np.random.default_rng(5)
    noise = rng.standard_normal((2, 2, *RADAR.shape)) @ np.eye(256)
    scene, office = (1e-2 * (one[0] + 1j * one[1]) for one in noise)
    samples, ramps = np.arange(256), np.arange(32)[:, None]
    scene = scene + np.exp(-2j * np.pi * (0.11 * samples + 0.2 * ramps))
    office = office + np.exp(-2j * np.pi * 0.05 * samples)
    chirp = np.exp(1j * np.pi * 6.1e12 * ((samples - 128) / 40e6) ** 2)
    burst = np.where((ramps % 4 == 1) & (np.abs(samples - 128) < 40), 30.0 * chirp, 0.0)
    for name, received in (("street", scene), ("office", office + burst)):
        frame = vsep.Frame(received=received, radar=RADAR, anti_aliasing_filter=NoFilter())
        vsep.write_frame(tmp_path / f"{name}.npz", frame)
    return tmp_path, scene, burst


def test_bursts_of_a_static_scene_come_out_alone(files):
    folder, _, burst = files
    received = vsep.read_frame(folder / "office.npz").received
    found = measured_bursts(received, np.abs(burst) > 0.0)
    # The noise of a hit sample and of the mean over 24 ramps, of both parts of a deviation of 1e-2.
    assert np.abs(found - burst).max() < 6e-2


def test_the_frame_gets_filtered_bursts_of_the_level_asked_for_and_the_filter(files):
    folder, scene, burst = files
    out = folder / "test.npz"
    words = ["add-bursts", str(folder / "street.npz"), "--bursts", str(folder / "office.npz")]
    assert main([*words, "--mask", "amplitude", "--sir-db", "-10", "--out", str(out)]) == 0
    made = vsep.read_frame(out)
    added = made.received - scene
    ratio = np.sum(np.abs(scene) ** 2) / np.sum(np.abs(added) ** 2)
    assert 10.0 * np.log10(ratio) == pytest.approx(-10.0, abs=1e-6)
    # Appendix C: 0.5 and 5 MHz; 40 dB and more are gone at 20 MHz and at zero.
    response = np.abs(made.anti_aliasing_filter.response(np.array([0.0, 0.5e6, 2e6, 5e6, 19e6])))
    assert response[[1, 3]] == pytest.approx(np.sqrt(0.5), rel=1e-3)
    assert response[2] == pytest.approx(1.0, abs=1e-3)
    assert response[[0, 4]].max() < 1e-2
    hit = np.abs(burst).any(axis=1)
    energy = np.sum(np.abs(added) ** 2, axis=1)
    assert energy[hit].min() > 1e3 * energy[~hit].max()
    assert made.truth_mask[hit].any(axis=1).all()


def test_a_measurement_without_bursts_is_refused(files, capsys):
    folder, _, _ = files
    words = ["add-bursts", str(folder / "street.npz"), "--bursts", str(folder / "street.npz")]
    assert main([*words, "--mask", "amplitude", "--out", str(folder / "x.npz")]) == 2
    assert "There is no burst" in capsys.readouterr().err
