"""``vsep convert`` from the command line, and the recordings that are not shipped."""

import json
import os
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from vsep_app import assets
from vsep_app.cli import main as cli

from tests.vsep.layout_scenes import LAYOUTS, capture
from vsep.files.frame import read_frame

RECORDINGS = Path(os.environ.get("VSEP_RECORDINGS", "nowhere"))
OPENRADAR = {
    "format": "npz",
    "key": "x",
    "start_frequency_hz": 77.4201e9,
    "slope_hz_per_s": 60e12,
    "sample_rate_hz": 2.5e6,
    "ramp_period_s": 184e-6,
    "lowest_beat": 0,
}
RADARLAB = {
    "format": "npz",
    "key": "x",
    "start_frequency_hz": 77e9,
    "slope_hz_per_s": 29.306e12,
    "sample_rate_hz": 20e6,
    "ramp_period_s": 29.56e-6,
    "adc_start_s": 1.66e-6,
}


def convert(folder: Path, recording: Path, settings: dict[str, Any], *more: str) -> int:
    (folder / "radar.json").write_text(json.dumps(settings))
    arguments = ["--settings", str(folder / "radar.json"), "--out", str(folder / "frame.npz")]
    return cli.main(["convert", str(recording), *arguments, *more])


def test_the_shipped_frame_comes_back(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    shipped = assets.path("frames/openradar_doppler_example_1.npz")
    assert convert(tmp_path, shipped, OPENRADAR | {"key": "received"}) == 0
    # Somebody walks there, through a good quarter of a cell of 5 cm in 24 ms.
    told = capsys.readouterr().err
    assert told.count("\n") == 1
    assert "An object at 0.575 m/s" in told
    assert "moves by 0.28 range cells within the frame" in told
    frame, original = read_frame(tmp_path / "frame.npz"), read_frame(shipped)
    # What the recording does not say is seen in it.
    assert frame.radar == replace(original.radar, range_migration=True)
    assert np.array_equal(frame.received, original.received)


def test_a_configuration_is_read_and_every_number_has_its_source(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    rng = np.random.default_rng(1)
    ramp, antenna, pair = np.ogrid[:16, :2, :64]
    line = np.exp(2j * np.pi * (0.2 * pair + 0.1 * antenna + 0.05 * ramp))
    noise = rng.normal(size=(16, 2, 64, 2)) @ np.array([1.0, 1.0j])
    whole = np.rint(500.0 * line + 5.0 * noise).reshape(16, 2, 32, 2)
    words = np.stack([whole.real, whole.imag], axis=-2).astype("<i2")
    words.tofile(tmp_path / "adc_data.bin")
    (tmp_path / "radar.cfg").write_text(
        "channelCfg 3 1 0\nadcCfg 2 1\nprofileCfg 0 77 7 6 57.14 0 0 29.982 1 64 10000 0 0 30\n"
        "chirpCfg 0 0 0 0 0 0 0 1\nframeCfg 0 0 16 1 100 1 0\n"
    )
    (tmp_path / "mine.json").write_text('{"antennas": "1"}')
    arguments = ["convert", str(tmp_path / "adc_data.bin"), "--out", str(tmp_path / "frame.npz")]
    for name in ("radar.cfg", "mine.json"):
        arguments += ["--settings", str(tmp_path / name)]
    assert cli.main(arguments) == 0
    told = capsys.readouterr()
    assert "slope_hz_per_s: 29.982 MHz/us  (profileCfg, line 3 of " in told.out
    assert "samples: complex-1x" in told.out
    assert "range: cells of 0.7812 m, up to 50 m (Complex 1x)" in told.out
    assert told.err == ""
    frame = read_frame(tmp_path / "frame.npz")
    assert frame.antennas is None
    assert frame.radar.lowest_beat == 0.0
    assert np.array_equal(
        frame.in_file_sign(frame.received) * 2**15, whole.reshape(16, 2, 64)[:, 1]
    )


def test_remarks_go_to_standard_error_and_errors_end_with_code_2(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    shipped = assets.path("frames/openradar_doppler_example_1.npz")
    wrong = OPENRADAR | {"key": "received", "slope_hz_per_s": 60e13}
    assert convert(tmp_path, shipped, wrong) == 0
    assert "vsep: The ramps sweep 30.5 GHz from 77.4201 to" in capsys.readouterr().err
    assert convert(tmp_path, shipped, wrong, "--frame", "3") == 2
    assert "frame is 3, but axes names no frames" in capsys.readouterr().err
    assert convert(tmp_path, tmp_path / "frame.npz", OPENRADAR) == 2
    assert "is the recording or its settings" in capsys.readouterr().err


def test_without_settings_the_three_best_layouts_are_printed(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    layout = LAYOUTS[0]
    recording = tmp_path / "adc.bin"
    recording.write_bytes(capture(layout, "clutter", np.random.default_rng(2)))
    assert cli.main(["convert", str(recording)]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[0] == (
        "1. dca1000-xwr14xx, complex-1x, 128 samples, 4 antennas, 1 transmitter, 64 ramps"
    )
    assert [line[:2] for line in lines[2:6:2]] == ["2.", "3."]
    assert all("of the cells" in line for line in lines[1:6:2])
    assert "num_samples: 128" in lines
    assert list(tmp_path.iterdir()) == [recording]


def test_a_guess_completes_what_the_settings_leave_open(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    layout = LAYOUTS[2]
    recording = tmp_path / "adc.bin"
    recording.write_bytes(capture(layout, "clutter", np.random.default_rng(2)))
    radar = {"start_frequency_hz": 77e9, "slope_hz_per_s": 30e12, "sample_rate_hz": 10e6}
    assert convert(tmp_path, recording, radar | {"ramp_period_s": 32e-6}, "--guess") == 0
    assert "num_antennas: 4  (guessed from the samples)" in capsys.readouterr().out
    frame = read_frame(tmp_path / "frame.npz")
    assert frame.num_antennas == 4
    assert frame.radar.shape == (64, 200)
    assert frame.radar.lowest_beat == 0.0


def test_a_frame_file_goes_to_sigmf_and_back_without_settings(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    shipped = str(assets.path("frames/openradar_doppler_example_1.npz"))
    stream, back = str(tmp_path / "frame.sigmf-meta"), str(tmp_path / "frame.npz")
    assert cli.main(["convert", shipped, "--out", stream]) == 0
    assert cli.main(["convert", stream, "--out", back]) == 0
    assert "An object at 0.575 m/s" in capsys.readouterr().err
    frame, original = read_frame(back), read_frame(shipped)
    # What moves is seen when it is converted.
    assert frame.radar == replace(original.radar, range_migration=True)
    assert np.array_equal(frame.received, original.received)


def test_settings_without_an_output_are_refused(
    tmp_path: Path, refused: Callable[..., str]
) -> None:
    (tmp_path / "radar.json").write_text(json.dumps(OPENRADAR))
    sentence = refused("convert", "adc.npz", "--settings", str(tmp_path / "radar.json"))
    assert "give --out, or --guess" in sentence


@pytest.mark.skipif(not RECORDINGS.is_dir(), reason="VSEP_RECORDINGS names no folder")
@pytest.mark.parametrize("name", ["20180608-195044", "20180613-190347"])
def test_a_capture_card_of_four_receivers_is_read(
    tmp_path: Path, name: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with np.load(RECORDINGS / f"radarlab_{name}.npz") as archive:
        stored = archive["x"]
    # Back to the words of the capture: its scale is sqrt(2) / 32767.
    scaled = stored.astype(np.complex128) * (32767 / np.sqrt(2))
    words = np.stack([scaled.real, scaled.imag]).round().astype(np.int64)
    # Single precision keeps 24 bits of the 16.
    np.testing.assert_allclose(words[0], scaled.real, atol=0.01)
    order = words.transpose(2, 3, 1, 0)  # ramps, samples, receivers, parts
    (order + 2**15).astype("<u2").tofile(tmp_path / "capture.bin")
    raw = RADARLAB | {"format": "tsw1400", "num_samples": 512, "num_antennas": 4}
    del raw["key"]
    assert convert(tmp_path, tmp_path / "capture.bin", raw) == 0
    assert capsys.readouterr().err == ""
    frame = read_frame(tmp_path / "frame.npz")
    assert frame.antennas is not None
    assert np.array_equal(frame.in_file_sign(frame.antennas) * 2**15, words[0] + 1j * words[1])
