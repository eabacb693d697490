"""`vsep.recordings.stored_arrays`: .npy, .npz and .mat of unknown origin."""

import io
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.io import savemat

from vsep.errors import InputError
from vsep.recordings.settings import RecordingSettings
from vsep.recordings.stored_arrays import read_stored_array

SIGNAL = np.arange(24).reshape(2, 3, 4) * (1.0 + 0.3j) / 7.0


def settings(kind: str, key: str | None = None) -> RecordingSettings:
    return RecordingSettings(
        format=kind,
        start_frequency_hz=77e9,
        slope_hz_per_s=3e13,
        sample_rate_hz=1e7,
        ramp_period_s=1e-4,
        key=key,
    )


def told(path: Path, key: str | None = None) -> str:
    with pytest.raises(InputError) as caught:
        read_stored_array(str(path), settings(path.suffix[1:], key))
    text = str(caught.value)
    assert "\n" not in text
    assert len(text) < 400
    return text


def write(path: Path, **arrays: Any) -> Path:
    if path.suffix == ".npy":
        np.save(path, next(iter(arrays.values())))
    elif path.suffix == ".npz":
        np.savez(path, **arrays)
    else:
        savemat(path, arrays, do_compression=True)
    return path


@pytest.mark.parametrize("suffix", ["npy", "npz", "mat"])
@pytest.mark.parametrize("dtype", [np.complex128, np.complex64, np.float32, np.int16])
def test_an_array_comes_back_exactly(tmp_path: Path, suffix: str, dtype: Any) -> None:
    stored = (SIGNAL if np.issubdtype(dtype, np.complexfloating) else SIGNAL.real).astype(dtype)
    path = write(tmp_path / f"a.{suffix}", x=stored)
    assert np.array_equal(read_stored_array(str(path), settings(suffix)), stored)


def test_a_matlab_file_without_compression_is_read(tmp_path: Path) -> None:
    path = tmp_path / "a.mat"
    savemat(path, {"x": SIGNAL}, do_compression=False)
    assert np.array_equal(read_stored_array(str(path), settings("mat")), SIGNAL)


def test_a_big_endian_matlab_file_with_whole_numbers_kept_small_is_read(tmp_path: Path) -> None:
    # One double array [3 7], stored as bytes in a short element, as MATLAB does.
    body = b"".join(
        [
            *(b"\0\0\0\x06", b"\0\0\0\x08", b"\0\0\0\x06", bytes(4)),  # flags: double
            *(b"\0\0\0\x05", b"\0\0\0\x08", b"\0\0\0\x01", b"\0\0\0\x02"),  # 1 x 2
            *(b"\0\x01\0\x01", b"x\0\0\0"),
            *(b"\0\x02\0\x02", b"\x03\x07\0\0"),
        ]
    )
    path = tmp_path / "a.mat"
    header = b"MATLAB 5.0 MAT-file".ljust(124) + b"\x01\0MI"
    path.write_bytes(header + b"\0\0\0\x0e" + len(body).to_bytes(4, "big") + body)
    assert read_stored_array(str(path), settings("mat")).tolist() == [[3.0, 7.0]]


def test_matlab_files_of_version_4_are_told_how_to_be_saved_again(tmp_path: Path) -> None:
    path = tmp_path / "a.mat"
    savemat(path, {"x": SIGNAL[0]}, format="4")
    assert "save it again in MATLAB" in told(path)


@pytest.mark.parametrize("suffix", ["npz", "mat"])
def test_of_several_arrays_one_must_be_named(tmp_path: Path, suffix: str) -> None:
    path = write(tmp_path / f"a.{suffix}", x=SIGNAL, rate=np.ones((1, 1)))
    assert np.array_equal(read_stored_array(str(path), settings(suffix, "x")), SIGNAL)
    assert "name one of them by key" in told(path)
    assert "holds no array 'y'; it holds" in told(path, "y")


def test_a_npy_file_has_no_names(tmp_path: Path) -> None:
    assert "one array without a name" in told(write(tmp_path / "a.npy", x=SIGNAL), "x")


@pytest.mark.parametrize("suffix", ["npy", "npz"])
def test_pickled_objects_are_refused(tmp_path: Path, suffix: str) -> None:
    path = write(tmp_path / f"a.{suffix}", x=np.array([{}, 1], dtype=object))
    assert "pickled objects" in told(path)


@pytest.mark.parametrize("suffix", ["npy", "npz"])
def test_texts_are_refused(tmp_path: Path, suffix: str) -> None:
    assert "numbers are needed" in told(write(tmp_path / f"a.{suffix}", x=np.array(["a", "b"])))


@pytest.mark.parametrize(
    ("value", "kind"),
    [
        ({"a": 1.0}, "struct"),
        (np.array([1, "a"], dtype=object), "cell"),
        ("text", "char"),
        (np.ones((2, 2), dtype=bool), "logical"),
    ],
)
def test_matlab_classes_without_samples_are_refused(tmp_path: Path, value: Any, kind: str) -> None:
    assert f"x is of class {kind}; an array of numbers" in told(write(tmp_path / "a.mat", x=value))


def test_empty_files_and_arrays_are_told(tmp_path: Path) -> None:
    assert "x declares 0 elements" in told(write(tmp_path / "a.mat", x=np.zeros((0, 3))))
    assert "holds no array" in told(write(tmp_path / "b.mat"))
    assert "holds no array" in told(write(tmp_path / "b.npz"))
    for name in ("c.npy", "c.npz", "c.mat"):
        (tmp_path / name).write_bytes(b"")
        assert name in told(tmp_path / name)


def test_version_7_3_is_told_how_to_be_saved_again(tmp_path: Path) -> None:
    path = tmp_path / "a.mat"
    text = b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(512)
    path.write_bytes(text + b"\x89HDF\r\n\x1a\n" + bytes(100))
    assert "version 7.3, which is HDF5; save it again" in told(path)


def test_a_header_that_lies_about_its_size_is_refused(tmp_path: Path) -> None:
    memory = io.BytesIO()
    np.lib.format.write_array_header_1_0(
        memory, {"descr": "<c16", "fortran_order": False, "shape": (2**40,)}
    )
    path = tmp_path / "a.npy"
    path.write_bytes(memory.getvalue() + bytes(64))
    assert "at most 67108864 elements are allowed" in told(path)


def test_a_matlab_file_that_expands_to_too_much_is_refused(tmp_path: Path) -> None:
    path = write(tmp_path / "a.mat", x=np.zeros((2**14, 2**13), dtype=np.uint8))
    assert path.stat().st_size < 200_000
    assert "x declares 134217728 elements" in told(path)


@pytest.mark.parametrize("suffix", ["npy", "npz", "mat"])
def test_cut_off_files_end_in_a_sentence(tmp_path: Path, suffix: str) -> None:
    whole = write(tmp_path / f"a.{suffix}", x=SIGNAL).read_bytes()
    path = tmp_path / f"cut.{suffix}"
    for length in np.linspace(0, len(whole) - 1, 25).astype(int):
        path.write_bytes(whole[:length])
        assert path.name in told(path)


@pytest.mark.parametrize("suffix", ["npy", "npz", "mat"])
def test_damaged_files_end_in_a_sentence_or_an_array(tmp_path: Path, suffix: str) -> None:
    path = write(tmp_path / f"a.{suffix}", x=SIGNAL)
    if suffix == "mat":
        savemat(path, {"x": SIGNAL}, do_compression=False)
    whole = path.read_bytes()
    rng = np.random.default_rng(11)
    kinds = set()
    for _ in range(400):
        damaged = bytearray(whole)
        for place in rng.integers(0, min(len(whole), 260), 3):
            damaged[place] = rng.integers(256)
        path.write_bytes(damaged)
        try:
            kinds.add(read_stored_array(str(path), settings(suffix)).dtype.kind)
        except InputError as error:
            kinds.add(str(error)[-1])
    # Most of the places hold lengths and types: sentences are the rule, numbers the exception.
    assert "." in kinds
    assert kinds <= set(".iufc")
