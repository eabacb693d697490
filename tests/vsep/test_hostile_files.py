"""Files made to harm: small ones that expand, lie about their sizes, or never end."""

import io
import os
import struct
import time
import tracemalloc
import zipfile
import zlib
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from vsep.errors import InputError
from vsep.files.archive import EXPANSION, MAX_MEMBERS, MIN_EXPANDED_BYTES
from vsep.files.frame import read_frame
from vsep.recordings.matlab import matlab_shapes
from vsep.recordings.settings import read_settings
from vsep.recordings.stored_arrays import read_stored_array
from vsep.recordings.suggest import suggest_settings
from vsep.studies.rows import read_rows

# What is expanded is held once as it comes and once as it is cut out, and a little more.
MAX_MEMORY = 2 * MIN_EXPANDED_BYTES + 2**23


def header(shape: Any, dtype: Any) -> bytes:
    """The first bytes of an array in NumPy's format, which claim whatever they are told to."""
    text = f"{{'descr': {dtype!r}, 'fortran_order': False, 'shape': {shape!r}, }}"
    padded = text.ljust(-(-(len(text) + 11) // 64) * 64 - 11) + "\n"
    return b"\x93NUMPY\x01\x00" + struct.pack("<H", len(padded)) + padded.encode("latin-1")


def archive(path: Path, members: dict[str, bytes]) -> Path:
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as file:
        for name, content in members.items():
            file.writestr(f"{name}.npy", content)
    return path


def told(path: Path, read: Any = read_frame) -> str:
    """The sentence that reading ends with; it takes little memory to come to it."""
    tracemalloc.start()
    try:
        with pytest.raises(InputError) as caught:
            read(str(path))
        assert tracemalloc.get_traced_memory()[1] < MAX_MEMORY
    finally:
        tracemalloc.stop()
    sentence = str(caught.value)
    assert "\n" not in sentence
    return sentence


def test_one_element_of_gigabytes_is_refused_before_it_is_read(tmp_path: Path) -> None:
    size = 200_000_000
    content = header((1,), f"|V{size}") + bytes(size)
    path = archive(tmp_path / "frame.npz", {"received": content})
    del content
    assert path.stat().st_size < 2**20
    assert f"expands to {size + 128} bytes" in told(path)


def test_a_number_of_many_bytes_is_refused_although_it_is_there(tmp_path: Path) -> None:
    path = archive(tmp_path / "frame.npz", {"received": header((8,), "|V65") + bytes(8 * 65)})
    assert "elements of 65 bytes; numbers are needed, at most 64" in told(path)


def test_a_valid_frame_that_expands_too_far_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "frame.npz"
    np.savez_compressed(path, received=np.zeros((512, 16384), dtype=np.complex128))
    assert path.stat().st_size * EXPANSION < 2**27
    assert f"over {EXPANSION} times the size of the archive" in told(path)


def test_arrays_that_expand_together_are_counted_together(tmp_path: Path) -> None:
    # Each alone is allowed; the sum is not.
    half = np.zeros(MIN_EXPANDED_BYTES // 16 * 5 // 8, dtype=np.complex128)
    path = tmp_path / "recording.npz"
    np.savez_compressed(path, received=half, **{"first": half})
    from vsep.files.archive import Archive

    with Archive(path, "recording.npz") as opened:
        assert opened.array("first").size == half.size
        with pytest.raises(InputError, match="expands to"):
            opened.array("received")


def test_an_archive_of_many_files_is_refused(tmp_path: Path) -> None:
    path = archive(tmp_path / "frame.npz", {f"a{i}": b"" for i in range(MAX_MEMBERS + 1)})
    assert f"holds {MAX_MEMBERS + 1} files; at most {MAX_MEMBERS} are read" in told(path)


def test_a_directory_of_megabytes_is_refused_before_it_is_read(tmp_path: Path) -> None:
    path = archive(tmp_path / "frame.npz", {f"{i:0200d}": b"" for i in range(3000)})
    assert "lists its files in" in told(path)


def test_a_length_that_is_no_count_is_refused(tmp_path: Path) -> None:
    path = archive(tmp_path / "frame.npz", {"received": header((True, 256), "<c16") + bytes(4096)})
    assert "damaged or cut off" in told(path)


@pytest.mark.parametrize("dtype", ["|S4000000", "<U1000000"])
def test_a_long_text_is_refused(tmp_path: Path, dtype: str) -> None:
    content = header((1,), dtype) + bytes(4_000_000)
    path = archive(tmp_path / "frame.npz", {"received": content})
    assert "text of over 4096 characters" in told(path)


def matlab_element(kind: int, data: bytes) -> bytes:
    return struct.pack("<LL", kind, len(data)) + data + bytes(-len(data) % 8)


def matlab_matrix(name: str, count: int, kind: int = 2) -> bytes:
    """An array of bytes, or of doubles for kind 9."""
    flags = matlab_element(6, struct.pack("<LL", {2: 9, 9: 6}[kind], 0))
    lengths = matlab_element(5, struct.pack("<ll", 1, count))
    return matlab_element(
        14,
        flags
        + lengths
        + matlab_element(1, name.encode())
        + matlab_element(kind, bytes(count * {2: 1, 9: 8}[kind])),
    )


MATLAB_HEADER = b"MATLAB 5.0".ljust(124) + b"\x00\x01IM"


def test_a_matlab_file_of_many_variables_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "a.mat"
    path.write_bytes(MATLAB_HEADER + b"".join(matlab_matrix(f"v{i}", 1) for i in range(60_000)))
    assert f"more than {MAX_MEMBERS} variables" in told(
        path, lambda name: matlab_shapes(io.BytesIO(Path(name).read_bytes()), name)
    )


def test_a_matlab_array_that_expands_too_far_is_refused(tmp_path: Path, settings: Any) -> None:
    packed = zlib.compress(matlab_matrix("adc", MIN_EXPANDED_BYTES // 6, 9), 9)
    path = tmp_path / "a.mat"
    path.write_bytes(MATLAB_HEADER + struct.pack("<LL", 15, len(packed)) + packed)
    assert "damaged" in told(path, lambda name: read_stored_array(name, settings("mat")))


@pytest.fixture
def settings() -> Any:
    from vsep.recordings.settings import parse_settings

    radar = {
        "start_frequency_hz": 77e9,
        "slope_hz_per_s": 3e13,
        "sample_rate_hz": 1e7,
        "ramp_period_s": 6e-5,
    }
    return lambda kind: parse_settings({"format": kind, **radar})


def test_anchors_in_yaml_are_refused_before_they_multiply(tmp_path: Path) -> None:
    lines = ["a0: &a0 {x: 1}"]
    lines += [f"a{i}: &a{i} {{<<: [{', '.join(['*a' + str(i - 1)] * 9)}]}}" for i in range(1, 40)]
    path = tmp_path / "radar.yaml"
    path.write_text("\n".join(lines))
    assert "refers to parts of itself by *" in told(path, read_settings)


@pytest.mark.parametrize("value", ["0x" + "f" * 20_000, "1" + "0" * 4290, "[" * 50])
@pytest.mark.parametrize("name", ["num_samples", "slope_hz_per_s", "axes"])
def test_numbers_of_thousands_of_digits_are_told(tmp_path: Path, name: str, value: str) -> None:
    path = tmp_path / "radar.yaml"
    path.write_text(
        "format: npy\nstart_frequency_hz: 77e9\nslope_hz_per_s: 3e13\nsample_rate_hz: 1e7\n"
        f"ramp_period_s: 6e-5\n{name}: {value}\n"
    )
    assert len(told(path, read_settings)) < 300


@pytest.mark.parametrize("text", ["[" * 60_000, "{" * 60_000, "- " * 30_000, "x: " + "[" * 3000])
def test_settings_within_settings_are_refused_before_they_take_their_time(
    tmp_path: Path, text: str
) -> None:
    path = tmp_path / "radar.yaml"
    path.write_text(text)
    start = time.process_time()
    assert "groups within groups" in told(path, read_settings)
    assert time.process_time() - start < 5.0


@pytest.mark.parametrize("name", ["sample_rate_hz", "ramp_period_s"])
@pytest.mark.parametrize("value", ["0", "-1", "1e300", "1e-300"])
def test_what_is_divided_by_is_judged_first(tmp_path: Path, name: str, value: str) -> None:
    radar = {"start_frequency_hz": "77e9", "slope_hz_per_s": "3e13", "sample_rate_hz": "1e7"}
    lines = {**radar, "ramp_period_s": "6e-5", "format": "npy", name: value}
    path = tmp_path / "radar.yaml"
    path.write_text("".join(f"{key}: {text}\n" for key, text in lines.items()))
    assert "must lie between" in told(path, read_settings)


@pytest.mark.parametrize("suffix", [".npz", ".npy", ".mat", ".bin", ".yaml", ".jsonl"])
def test_a_pipe_is_refused_and_never_waited_for(tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"pipe{suffix}"
    os.mkfifo(path)
    read = {".yaml": read_settings, ".jsonl": read_rows}.get(suffix)
    if read is None:
        # A raw file says nothing of itself that would have to be read.
        read = read_frame if suffix == ".bin" else lambda name: suggest_settings(name, name)
    if suffix == ".npy":
        read = read_frame
    assert "is a pipe or a device" in told(path, read)


@pytest.mark.skipif(not Path("/dev/zero").exists(), reason="the system has no such device")
def test_a_device_without_an_end_is_refused() -> None:
    for read in (read_frame, read_rows):
        assert "is a pipe or a device" in told(Path("/dev/zero"), read)
