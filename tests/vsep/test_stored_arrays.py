"""`vsep.recordings.stored_arrays`: NumPy's versions and records, MATLAB's structures and cells."""

import contextlib
import io
import struct
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.io import savemat

from vsep.errors import InputError
from vsep.recordings.convert import convert_recording
from vsep.recordings.matlab import matlab_shapes, read_matlab
from vsep.recordings.settings import RecordingSettings
from vsep.recordings.stored_arrays import read_stored_array

RNG = np.random.default_rng(4)
CUBE = RNG.normal(size=(2, 3, 16, 2)) @ np.array([1.0, 1.0j])


def settings(kind: str, **changes: Any) -> RecordingSettings:
    radar = {
        "format": kind,
        "start_frequency_hz": 77e9,
        "slope_hz_per_s": 3e13,
        "sample_rate_hz": 1e7,
        "ramp_period_s": 1e-4,
    }
    return RecordingSettings(**(radar | changes))


@pytest.mark.parametrize("version", [(1, 0), (2, 0), (3, 0)])
def test_every_version_of_numpy_is_read(tmp_path: Path, version: tuple[int, int]) -> None:
    with (tmp_path / "a.npy").open("wb") as file:
        np.lib.format.write_array(file, CUBE, version=version)
    assert np.array_equal(read_stored_array(str(tmp_path / "a.npy"), settings("npy")), CUBE)


def test_a_header_that_is_too_long_is_refused(tmp_path: Path) -> None:
    (tmp_path / "a.npy").write_bytes(b"\x93NUMPY\x02\x00" + struct.pack("<I", 2**31) + b"{}")
    with pytest.raises(InputError, match="damaged or cut off"):
        read_stored_array(str(tmp_path / "a.npy"), settings("npy"))


def test_pairs_of_words_are_complex_samples(tmp_path: Path) -> None:
    pairs = np.zeros((4, 16), dtype=[("re", "<i2"), ("im", "<i2")])
    pairs["re"], pairs["im"] = RNG.integers(-500, 500, (2, 4, 16))
    np.save(tmp_path / "a.npy", pairs)
    found = read_stored_array(str(tmp_path / "a.npy"), settings("npy"))
    assert np.array_equal(found, pairs["re"] + 1j * pairs["im"])
    np.save(tmp_path / "b.npy", np.zeros(4, dtype=[("a", "i2"), ("b", "i2"), ("c", "i2")]))
    with pytest.raises(InputError, match="records of 3 fields; two numbers, I and Q"):
        read_stored_array(str(tmp_path / "b.npy"), settings("npy"))


@pytest.mark.parametrize("kind", ["npz", "mat"])
def test_i_and_q_may_lie_apart(tmp_path: Path, kind: str) -> None:
    path = tmp_path / f"a.{kind}"
    parts = {"I": CUBE.real, "Q": CUBE.imag, "short": CUBE.real[:1]}
    savemat(path, parts) if kind == "mat" else np.savez(path, **parts)
    assert np.array_equal(read_stored_array(str(path), settings(kind, key="I, Q")), CUBE)
    with pytest.raises(InputError, match="real numbers of one shape are needed"):
        read_stored_array(str(path), settings(kind, key="I,short"))
    with pytest.raises(InputError, match="one array or two, I and Q"):
        read_stored_array(str(path), settings(kind, key="I,Q,short"))


def cells(*arrays: Any) -> Any:
    made = np.empty((1, len(arrays)), dtype=object)
    made[0] = [None] * len(arrays)
    for place, array in enumerate(arrays):
        made[0, place] = array
    return made


@pytest.mark.parametrize("compressed", [False, True])
def test_arrays_inside_of_structures_and_cells_are_read(compressed: bool) -> None:
    several = np.zeros((1, 2), dtype=[("x", object), ("note", object)])
    several[0, 0] = CUBE, "a text"
    several[0, 1] = CUBE * 3, 1.0
    stored = {
        "radar": {"adc": CUBE, "fs": 5.0, "deep": {"er": np.eye(3)}, "none": np.zeros((0, 0))},
        "frames": cells(CUBE.real.astype(np.float32), CUBE * 2),
        "many": several,
        "plain": CUBE,
    }
    file = io.BytesIO()
    savemat(file, stored, do_compression=compressed)
    file.seek(0)
    names = set(matlab_shapes(file, "a.mat"))
    assert {"radar.adc", "radar.fs", "radar.deep.er", "frames{2}", "many(2).x", "plain"} <= names
    assert "many(1).note" not in names
    for key, expected in (
        ("radar.adc", CUBE),
        ("radar.deep.er", np.eye(3)),
        ("frames{1}", CUBE.real.astype(np.float32)),
        ("frames{2}", CUBE * 2),
        ("many(2).x", CUBE * 3),
        ("plain", CUBE),
    ):
        file.seek(0)
        assert np.array_equal(read_matlab(file, "a.mat", key), expected)
    file.seek(0)
    with pytest.raises(InputError, match=r"holds no array 'radar'; it holds radar.adc"):
        read_matlab(file, "a.mat", "radar")


def test_a_damaged_structure_never_fails_otherwise_than_by_a_sentence() -> None:
    file = io.BytesIO()
    savemat(file, {"radar": {"adc": CUBE, "fs": 5.0}})
    whole = file.getvalue()
    for place in range(150, len(whole), 97):
        damaged = bytearray(whole)
        damaged[place] ^= 0x55
        for content in (whole[:place], bytes(damaged)):
            with contextlib.suppress(InputError):
                read_matlab(io.BytesIO(content), "a.mat", "radar.adc")


@pytest.mark.parametrize("dtype", ["f8", "f4", "i4", "i2", "u2", "u1"])
def test_matrices_of_version_4_are_read(dtype: str) -> None:
    matrix = RNG.integers(0, 200, (5, 7)).astype(dtype)
    file = io.BytesIO()
    savemat(file, {"other": np.eye(2), "adc": matrix}, format="4")
    file.seek(0)
    assert matlab_shapes(file, "a.mat") == {"other": (2, 2), "adc": (5, 7)}
    file.seek(0)
    found = read_matlab(file, "a.mat", "adc")
    assert np.array_equal(found, matrix)
    assert found.dtype == np.dtype(dtype)


def test_complex_matrices_of_version_4_are_read(tmp_path: Path) -> None:
    savemat(tmp_path / "a.mat", {"adc": CUBE[0]}, format="4")
    assert np.array_equal(read_stored_array(str(tmp_path / "a.mat"), settings("mat")), CUBE[0])
    content = (tmp_path / "a.mat").read_bytes()
    (tmp_path / "b.mat").write_bytes(content[:-8])
    with pytest.raises(InputError, match="no MATLAB file of version 4 to 7"):
        read_stored_array(str(tmp_path / "b.mat"), settings("mat"))


# What the values say of themselves


def scene(seed: int = 3) -> Any:
    """Whole numbers (ramps, samples) of two lines and noise."""
    rng = np.random.default_rng(seed)
    time = np.arange(64)
    signal = 900.0 * np.exp(0.7j * time) + 300.0 * np.exp(2.1j * time)
    signal = signal + 9.0 * rng.normal(size=(16, 64, 2)) @ np.array([1.0, 1.0j])
    return np.rint(signal)


@pytest.mark.parametrize("bits", [12, 16])
def test_values_that_lost_their_sign_get_it_back(tmp_path: Path, bits: int) -> None:
    whole = scene()
    lost = whole.real % 2**bits + 1j * (whole.imag % 2**bits)
    np.save(tmp_path / "a.npy", lost)
    frame, remarks = convert_recording(str(tmp_path / "a.npy"), settings("npy"))
    assert np.array_equal(frame.in_file_sign(frame.received), whole)
    assert f"signed words of {bits} bits that were read as unsigned" in remarks[0]


def test_the_offset_of_unsigned_words_is_removed(tmp_path: Path) -> None:
    rng = np.random.default_rng(5)
    line = 300.0 * np.cos(2.0 * np.pi * 0.2 * np.arange(128))
    words = np.rint(2048.0 + line + 3.0 * rng.normal(size=(16, 128))).astype(np.uint16)
    np.save(tmp_path / "a.npy", words)
    real = settings("npy", samples="real")
    frame, remarks = convert_recording(str(tmp_path / "a.npy"), real)
    # 20 log10(2048 / (300 / sqrt 2)) is 19.7 dB.
    assert "A constant offset of 2048 LSB (20 dB relative to the rest) was removed" in remarks[0]
    spectrum = np.abs(np.fft.ifft(frame.received * np.hanning(frame.radar.num_samples)))
    assert np.all(spectrum[:, [0, 1, -1]] < 0.01 * spectrum.max())
    kept, remarks = convert_recording(
        str(tmp_path / "a.npy"), settings("npy", samples="real", offset="keep")
    )
    assert not any("offset" in remark for remark in remarks)
    assert np.abs(np.fft.ifft(kept.received))[0, 0] > 100.0


def test_the_offset_of_signed_words_is_remarked_and_stays(tmp_path: Path) -> None:
    line = 300.0 * np.cos(2.0 * np.pi * 0.2 * np.arange(128)) + np.zeros((16, 1))
    np.save(tmp_path / "a.npy", np.rint(line + 230.0).astype(np.int16))
    _, remarks = convert_recording(str(tmp_path / "a.npy"), settings("npy", samples="real"))
    assert "offset: remove takes it off" in remarks[0]
