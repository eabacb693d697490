"""Raw captures whose words, packets or receivers are not what was said."""

import struct
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from vsep.errors import InputError
from vsep.recordings.convert import convert_recording
from vsep.recordings.raw_words import read_raw
from vsep.recordings.settings import RecordingSettings

NUM_RAMPS, NUM_ANTENNAS, NUM_SAMPLES = 16, 4, 64
WORDS_PER_RAMP = 2 * NUM_ANTENNAS * NUM_SAMPLES
RADAR = {
    "format": "dca1000-xwr16xx",
    "start_frequency_hz": 77e9,
    "slope_hz_per_s": 2e13,
    "sample_rate_hz": 1e7,
    "ramp_period_s": 4e-5,
    "num_samples": NUM_SAMPLES,
    "num_antennas": NUM_ANTENNAS,
}


def samples(seed: int = 1, scale: float = 900.0) -> Any:
    """Whole numbers (ramps, antennas, samples): two lines, one of them moving, and noise."""
    rng = np.random.default_rng(seed)
    ramp, antenna, time = np.ogrid[:NUM_RAMPS, :NUM_ANTENNAS, :NUM_SAMPLES]
    still = np.exp(2j * np.pi * (0.11 * time + 0.2 * antenna))
    moving = 0.3 * np.exp(2j * np.pi * (0.31 * time + 0.13 * ramp + 0.4 * antenna))
    noise = rng.normal(size=(NUM_RAMPS, NUM_ANTENNAS, NUM_SAMPLES, 2)) @ np.array([1.0, 1.0j])
    whole = np.rint(scale * (still + moving + 0.01 * noise))
    return whole


def two_lanes(whole: Any) -> Any:
    """Words I I Q Q, one receiver after the other."""
    pairs = whole.reshape(*whole.shape[:-1], -1, 2)
    return np.stack([pairs.real, pairs.imag], axis=-2).astype("<i2").reshape(-1)


def four_lanes(whole: Any) -> Any:
    """Words I1 Q1 I2 Q2 ... of every sample."""
    parts = np.stack([whole.real, whole.imag], axis=-1)
    return np.moveaxis(parts, 1, 2).astype("<i2").reshape(-1)


def read(tmp_path: Path, words: Any, **changes: Any) -> Any:
    (tmp_path / "adc.bin").write_bytes(words.tobytes())
    return read_raw(str(tmp_path / "adc.bin"), RecordingSettings(**(RADAR | changes)))


def converted(tmp_path: Path, words: Any, **changes: Any) -> Any:
    (tmp_path / "adc.bin").write_bytes(words.tobytes())
    return convert_recording(str(tmp_path / "adc.bin"), RecordingSettings(**(RADAR | changes)))


def test_signed_words_read_as_unsigned_are_taken_as_signed(tmp_path: Path) -> None:
    whole = samples()
    found = read(tmp_path, four_lanes(whole), format="tsw1400")
    assert np.array_equal(found.samples * 2**15, whole)
    assert "Read as unsigned words" in found.remarks[0]


def test_unsigned_words_read_as_signed_are_taken_as_unsigned(tmp_path: Path) -> None:
    whole = samples()
    words = (four_lanes(whole).astype(np.int32) + 2**15).astype("<u2")
    found = read(tmp_path, words, format="tda2")
    assert np.array_equal(found.samples * 2**15, whole)
    assert "taken as unsigned" in found.remarks[0]


@pytest.mark.parametrize("bits", [12, 14])
def test_words_whose_sign_is_not_extended_are_recognised(tmp_path: Path, bits: int) -> None:
    whole = samples()
    words = (two_lanes(whole) & (2**bits - 1)).astype("<u2")
    found = read(tmp_path, words)
    assert np.array_equal(found.samples * 2 ** (bits - 1), whole)
    assert f"taken as adc_bits: {bits}" in found.remarks[0]


def test_words_wider_than_was_said_are_remarked(tmp_path: Path) -> None:
    whole = samples(scale=9000.0)
    found = read(tmp_path, two_lanes(whole), adc_bits=12)
    assert np.array_equal(found.samples * 2**15, whole)
    assert "adc_bits is 12, but the words reach" in found.remarks[0]


def test_swapped_bytes_are_put_right(tmp_path: Path) -> None:
    whole = samples()
    found = read(tmp_path, two_lanes(whole).byteswap())
    assert np.array_equal(found.samples * 2**15, whole)
    assert "bytes of the words are swapped" in found.remarks[0]


@pytest.mark.parametrize("wrong", ["dca1000-xwr14xx", "dca1000-xwr16xx", "tsw1400-xwr16xx"])
def test_another_order_of_words_is_named(tmp_path: Path, wrong: str) -> None:
    found = read(tmp_path, four_lanes(samples()), format=wrong)
    assert any("say format: tda2" in remark for remark in found.remarks)
    right = read(tmp_path, four_lanes(samples()), format="tda2")
    assert right.remarks == ()


def test_words_that_are_as_said_are_not_remarked(tmp_path: Path) -> None:
    found = read(tmp_path, two_lanes(samples()))
    assert np.array_equal(found.samples * 2**15, samples())
    assert found.remarks == ()
    assert found.missing is None


# Lost packets


def test_packets_of_zeros_are_missing(tmp_path: Path) -> None:
    words = two_lanes(samples())
    words[1456:2184] = 0
    frame, remarks = converted(tmp_path, words)
    lost = np.zeros(words.size, dtype=bool)
    lost[1456:2184] = True
    expected = lost.reshape(NUM_RAMPS, NUM_ANTENNAS, NUM_SAMPLES // 2, 2, 2).any(axis=3)
    expected = np.moveaxis(expected.reshape(NUM_RAMPS, NUM_ANTENNAS, NUM_SAMPLES), 1, 0)
    assert np.array_equal(frame.missing, expected)
    assert "364 samples (8.9%)" in remarks[0]


def test_zeros_before_the_first_frame_are_skipped(tmp_path: Path) -> None:
    words = np.concatenate([np.zeros(2912, "<i2"), two_lanes(samples())])
    found = read(tmp_path, words, num_ramps=NUM_RAMPS)
    assert np.array_equal(found.samples * 2**15, samples())
    assert "skip_bytes: 5824" in found.remarks[0]
    assert read(tmp_path, words).samples.shape == found.samples.shape


def test_ramps_that_begin_later_are_told_and_put_right(tmp_path: Path) -> None:
    whole = samples()[:, :1]
    words = two_lanes(whole)
    shifted = words[2 * 40 :]
    found = read(tmp_path, shifted, num_antennas=1, num_ramps=NUM_RAMPS - 1)
    told = [remark for remark in found.remarks if "skip_bytes: 96" in remark]
    assert len(told) == 1
    again = read(tmp_path, shifted, num_antennas=1, num_ramps=NUM_RAMPS - 1, skip_bytes=96)
    assert np.array_equal(again.samples * 2**15, whole[1:])


def packets(words: Any, header: int) -> list[bytes]:
    content = words.tobytes()
    made = []
    for number, first in enumerate(range(0, len(content), 1456)):
        payload = content[first : first + 1456]
        length = struct.pack("<I", len(payload)) if header == 14 else b""
        made.append(struct.pack("<I", number + 1) + length + first.to_bytes(6, "little") + payload)
    return made


@pytest.mark.parametrize("header", [10, 14])
def test_headers_of_packets_are_sorted_by_and_stripped(tmp_path: Path, header: int) -> None:
    made = packets(two_lanes(samples()), header)
    made[3], made[4] = made[4], made[3]
    lost = made.pop(6)
    found = read(tmp_path, np.frombuffer(b"".join(made), np.uint8))
    assert f"the {header}-byte headers of {len(made)} packets" in found.remarks[0]
    assert "1 came out of turn and 1 are lost" in found.remarks[0]
    kept = ~found.missing
    assert np.array_equal((found.samples * 2**15)[kept], samples()[kept])
    assert np.count_nonzero(found.missing) == (len(lost) - header) // 4


# Files of another kind


@pytest.mark.parametrize(
    ("start", "words"),
    [
        (b"\x93NUMPY\x01\x00", "a NumPy array; say format: npy"),
        (b"PK\x03\x04", "a ZIP archive"),
        (b"MATLAB 5.0 MAT-file, Platform", "a MATLAB file; say format: mat"),
        (b"MATLAB 7.3 MAT-file, Platform", "version 7.3; say format: mat"),
        (b"\x89HDF\r\n\x1a\n", "an HDF5 file"),
    ],
)
def test_files_of_another_kind_are_refused(tmp_path: Path, start: bytes, words: str) -> None:
    with pytest.raises(InputError, match=words) as caught:
        read(tmp_path, np.frombuffer(start + bytes(4 * 512), np.uint8))
    assert "\n" not in str(caught.value)


def test_an_order_of_words_is_doubted_whatever_the_number_of_receivers(tmp_path: Path) -> None:
    whole = samples()[:, :2]
    assert converted(tmp_path, two_lanes(whole), num_antennas=2)[1] == ()
    _, remarks = converted(tmp_path, two_lanes(whole), num_antennas=2, format="tsw1400-xwr16xx")
    assert any("say format: dca1000-xwr16xx" in remark for remark in remarks)
    _, remarks = converted(
        tmp_path, four_lanes(samples()), num_antennas=2, format="dca1000-xwr14xx"
    )
    assert any("say format: tda2" in remark for remark in remarks)


# Receivers


def test_dead_receivers_are_left_out(tmp_path: Path) -> None:
    whole = samples()
    whole[:, [1, 3]] = 0
    frame, remarks = converted(
        tmp_path, four_lanes(whole), format="tda2", antenna_spacing_wavelengths=0.5
    )
    assert frame.num_antennas == 2
    kept = np.moveaxis(whole[:, [0, 2]], 1, 0)
    assert np.array_equal(frame.in_file_sign(frame.antennas) * 2**15, kept)
    assert frame.antenna_spacing_wavelengths == 1.0
    assert remarks[0].startswith("Receivers 1, 3 of 0 to 3 are constant")
    chosen, remarks = converted(tmp_path, four_lanes(whole), format="tda2", antennas="1,2")
    assert chosen.num_antennas == 1
    assert remarks[0].startswith("Receivers 1 of 0 to 3 are constant")


def test_equal_samples_are_no_recording(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="all samples are equal; a recording is needed"):
        converted(tmp_path, np.full(16 * WORDS_PER_RAMP, 7, np.int16))


def test_receivers_are_chosen(tmp_path: Path) -> None:
    whole = samples()
    frame, remarks = converted(tmp_path, two_lanes(whole), antennas="2, 0")
    chosen = np.moveaxis(whole[:, [2, 0]], 1, 0)
    assert np.array_equal(frame.in_file_sign(frame.antennas) * 2**15, chosen)
    assert remarks == ()
    with pytest.raises(InputError, match=r"antennas is 4, but .* holds 4 receivers, 0 to 3"):
        converted(tmp_path, two_lanes(whole), antennas="4")
    with pytest.raises(InputError, match="antennas is '0,x'; it must be different whole numbers"):
        RecordingSettings(**(RADAR | {"antennas": "0,x"}))
