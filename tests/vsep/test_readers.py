"""Recordings behind libraries of their own: HDF5, SigMF, ROS bags, words of xwr, xarray."""

from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest

from tests.vsep.layout_scenes import LAYOUTS, capture
from tests.vsep.ros_bags import write_bag
from vsep.errors import InputError
from vsep.files.frame import Frame, read_frame, write_frame
from vsep.recordings.convert import convert_recording
from vsep.recordings.guess import guess_layouts
from vsep.recordings.readers import READERS
from vsep.recordings.settings import parse_settings
from vsep.recordings.sigmf_files import write_sigmf
from vsep.recordings.suggest import suggest_settings

RADAR = {
    "start_frequency_hz": 77e9,
    "slope_hz_per_s": 3e13,
    "sample_rate_hz": 1e7,
    "ramp_period_s": 6e-5,
    "samples": "complex-2x",
}


def signal(*shape: int) -> Any:
    rng = np.random.default_rng(3)
    return np.rint(100.0 * (rng.normal(size=(*shape, 2)) @ np.array([1.0, 1.0j])))


def converted(path: Path, **settings: Any) -> Frame:
    return convert_recording(str(path), parse_settings(RADAR | settings))[0]


def in_file(frame: Frame) -> Any:
    stored = frame.received if frame.antennas is None else frame.antennas
    return frame.in_file_sign(stored)


def test_an_array_of_hdf5_is_read_by_its_name(tmp_path: Path) -> None:
    samples = signal(3, 8, 32)
    with h5py.File(tmp_path / "adc.h5", "w") as file:
        file["radar/adc"] = samples
        file["radar/other"] = np.arange(3)
        file["sample_rate_hz"] = 1e7
        file.attrs["name"] = "noise"
    assert np.array_equal(
        in_file(converted(tmp_path / "adc.h5", format="hdf5", key="radar/adc")), samples
    )
    suggested = suggest_settings(str(tmp_path / "adc.h5"), "adc.h5")
    assert (suggested["format"], suggested["key"]) == ("hdf5", "radar.adc")
    assert suggested["sample_rate_hz"] == 1e7
    with pytest.raises(InputError, match=r"holds several|radar\.adc"):
        converted(tmp_path / "adc.h5", format="hdf5")


def test_arrays_of_matlab_7_3_have_their_axes_in_order(tmp_path: Path) -> None:
    samples = signal(3, 8, 32)
    parts = np.dtype([("real", "f8"), ("imag", "f8")])
    stored = np.empty((32, 8, 3), parts)
    stored["real"], stored["imag"] = samples.T.real, samples.T.imag
    with h5py.File(tmp_path / "adc.mat", "w", userblock_size=512) as file:
        file["radar/adc"] = stored
    with open(tmp_path / "adc.mat", "r+b") as raw:
        raw.write(b"MATLAB 7.3 MAT-file, Platform: GLNXA64")
    found = converted(tmp_path / "adc.mat", format="mat", key="radar.adc")
    assert np.array_equal(in_file(found), samples)
    assert suggest_settings(str(tmp_path / "adc.mat"), "adc.mat")["format"] == "mat"


def test_hdf5_that_claims_too_much_or_lies_elsewhere_is_refused(tmp_path: Path) -> None:
    with h5py.File(tmp_path / "large.h5", "w") as file:
        file.create_dataset("adc", shape=(2**16, 2**16), dtype="f4", chunks=(64, 64))
    with pytest.raises(InputError, match="holds 4294967296 elements"):
        converted(tmp_path / "large.h5", format="hdf5")
    np.zeros(256).tofile(tmp_path / "secret")
    with h5py.File(tmp_path / "outside.h5", "w") as file:
        where = [(str(tmp_path / "secret"), 0, 2048)]
        file.create_dataset("adc", shape=(8, 32), dtype="f8", external=where)
    with pytest.raises(InputError, match="lies in other files"):
        converted(tmp_path / "outside.h5", format="hdf5")
    content = (tmp_path / "large.h5").read_bytes()
    (tmp_path / "cut.h5").write_bytes(content[: len(content) // 2])
    with pytest.raises(InputError, match="damaged or no HDF5"):
        converted(tmp_path / "cut.h5", format="hdf5")


def test_a_frame_in_sigmf_comes_back_as_it_was(tmp_path: Path) -> None:
    np.save(tmp_path / "adc.npy", signal(3, 8, 32))
    frame = converted(tmp_path / "adc.npy", format="npy", sign="negative")
    write_sigmf(str(tmp_path / "frame.sigmf-meta"), frame)
    name = str(tmp_path / "frame.sigmf-data")
    settings = parse_settings(suggest_settings(name, name))
    again, _ = convert_recording(name, settings)
    assert again.radar == frame.radar
    assert np.array_equal(in_file(again), in_file(frame))
    assert again.beat_sign == frame.beat_sign


def test_a_stream_of_sigmf_needs_to_be_cut(tmp_path: Path) -> None:
    np.save(tmp_path / "adc.npy", signal(8, 32))
    write_sigmf(str(tmp_path / "a.sigmf-meta"), converted(tmp_path / "adc.npy", format="npy"))
    with pytest.raises(InputError, match="num_samples must say where"):
        converted(tmp_path / "a.sigmf-meta", format="sigmf")
    with pytest.raises(InputError, match="256 samples of a channel, which is no frame of 9 ramps"):
        converted(tmp_path / "a.sigmf-meta", format="sigmf", num_samples=32, num_ramps=9)
    second = converted(
        tmp_path / "a.sigmf-meta", format="sigmf", num_samples=32, num_ramps=4, frame=1
    )
    assert np.array_equal(in_file(second), np.load(tmp_path / "adc.npy")[4:])
    (tmp_path / "a.sigmf-meta").write_text("{}")
    with pytest.raises(InputError, match="no metadata of SigMF"):
        converted(tmp_path / "a.sigmf-meta", format="sigmf", num_samples=32)


def test_words_of_a_ros_bag_are_a_raw_capture(tmp_path: Path) -> None:
    layout = LAYOUTS[2]
    content = capture(layout, "clutter", np.random.default_rng(5))
    write_bag(tmp_path / "a.bag", content, 4)
    (tmp_path / "a.bin").write_bytes(content)
    path = str(tmp_path / "a.bag")
    assert tuple(guess_layouts(path)[0].settings.values()) == layout.settings
    raw = {"format": layout.format, "num_samples": layout.num_samples, "num_antennas": 4}
    frame, remarks = convert_recording(path, parse_settings(RADAR | raw))
    assert np.array_equal(in_file(frame), in_file(converted(tmp_path / "a.bin", **raw)))
    assert "4 messages of /radar/adc are taken for a raw capture" in remarks[0]
    with pytest.raises(InputError, match="has no topic '/other'; it has /log, /radar/adc"):
        converted(tmp_path / "a.bag", key="/other", **raw)
    with pytest.raises(InputError, match="holds no words in /log"):
        converted(tmp_path / "a.bag", key="/log", **raw)
    (tmp_path / "cut.bag").write_bytes((tmp_path / "a.bag").read_bytes()[:5000])
    with pytest.raises(InputError, match="damaged or no ROS bag"):
        converted(tmp_path / "cut.bag", **raw)


def test_samples_as_xwr_keeps_them_are_put_in_order(tmp_path: Path) -> None:
    samples = signal(2, 8, 2, 4, 32)  # frames, loops, transmitters, receivers, samples
    pairs = samples.reshape(*samples.shape[:-1], 16, 2)
    words = np.stack([pairs.real, pairs.imag], axis=-2).reshape(*samples.shape[:-1], 64)
    np.save(tmp_path / "clip.npy", words.astype("<i2"))
    axes = "frames,ramps,transmitters,antennas,iiqq"
    settings = {"format": "npy", "axes": axes, "num_transmitters": 2, "frame": 1}
    found = in_file(converted(tmp_path / "clip.npy", **settings))
    expected = samples[1].transpose(1, 2, 0, 3).reshape(8, 8, 32)
    assert np.array_equal(found, expected)
    np.save(tmp_path / "odd.npy", words[..., :-2].astype("<i2"))
    with pytest.raises(InputError, match="the axis iiqq has length 62"):
        converted(tmp_path / "odd.npy", **settings)


def test_a_frame_becomes_a_labelled_array(tmp_path: Path) -> None:
    np.save(tmp_path / "adc.npy", signal(3, 8, 32))
    write_frame(tmp_path / "frame.npz", converted(tmp_path / "adc.npy", format="npy"))
    array = read_frame(tmp_path / "frame.npz").to_xarray()
    assert array.dims == ("antenna", "ramp", "sample")
    assert np.array_equal(array.values, signal(3, 8, 32))
    assert float(array.ramp_start_s[2]) == pytest.approx(2 * 6e-5)
    assert float(array.sample_time_s[10]) == pytest.approx(1e-6)
    assert array.attrs["slope_hz_per_s"] == 3e13


def test_every_reader_has_a_label_and_own_suffixes() -> None:
    suffixes = [suffix for reader in READERS.values() for suffix in reader.suffixes]
    assert len(suffixes) == len(set(suffixes))
    assert len({reader.label for reader in READERS.values()}) == len(READERS)
