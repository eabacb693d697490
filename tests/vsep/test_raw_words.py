"""Raw captures, written here word by word from the byte tables of the manufacturer's documents."""

import itertools
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from vsep.errors import InputError
from vsep.recordings.raw_words import read_raw
from vsep.recordings.settings import RecordingSettings

# One letter a word, in the order in which a sample (or a pair of them) leaves the sensor; the digit
# is the receive antenna, +1 the next sample.
FOUR_LANES = {
    ("dca1000-xwr14xx", "complex"): "I0 I1 I2 I3 Q0 Q1 Q2 Q3",
    ("dca1000-xwr14xx", "real"): "I0 I1 I2 I3",
    ("tsw1400", "complex"): "I0 Q0 I1 Q1 I2 Q2 I3 Q3",
    ("tsw1400", "real"): "I0 I1 I2 I3",
    ("tda2", "complex"): "I0 Q0 I1 Q1 I2 Q2 I3 Q3",
}
TWO_LANES = {
    ("dca1000-xwr16xx", "complex"): "I I+1 Q Q+1",
    ("dca1000-xwr16xx", "real"): "I I+1",
    ("tsw1400-xwr16xx", "complex"): "I Q I+1 Q+1",
}
CASES = [
    *[(kind, samples, antennas) for kind, samples in FOUR_LANES for antennas in (1, 3, 4)],
    *[(kind, samples, antennas) for kind, samples in TWO_LANES for antennas in (1, 2, 4)],
]


def settings(kind: str, **changes: Any) -> RecordingSettings:
    radar = {
        "start_frequency_hz": 77e9,
        "slope_hz_per_s": 3e13,
        "sample_rate_hz": 1e7,
        "ramp_period_s": 1e-4,
        "num_samples": 8,
        "num_ramps": 3,
    }
    return RecordingSettings(**({"format": kind} | radar | changes))


def example_words(num_antennas: int, samples: str, bits: int = 16, frames: int = 1) -> Any:
    """Integers (ramps, antennas, samples), complex or real, the extremes among them."""
    rng = np.random.default_rng(8)
    half = 2 ** (bits - 1)
    real, imaginary = rng.integers(-half, half, (2, 3 * frames, num_antennas, 8))
    real[0, 0, :2] = -half, half - 1
    return real if samples == "real" else real + 1j * imaginary


def part(value: complex, letter: str) -> int:
    return int(np.real(value) if letter == "I" else np.imag(value))


def written(path: Path, words: Any, kind: str, samples: str, mask: int = 0xFFFF) -> Path:
    """Write samples as the card does, one word after the other."""
    content = bytearray()

    def put(value: int) -> None:
        word = value + 2**15 if kind.startswith("tsw1400") else value & mask
        content.extend((word & 0xFFFF).to_bytes(2, "little"))

    ramps, antennas, count = words.shape
    for ramp in range(ramps):
        if (kind, samples) in TWO_LANES:
            for antenna, sample in itertools.product(range(antennas), range(0, count, 2)):
                for place in TWO_LANES[kind, samples].split():
                    put(part(words[ramp, antenna, sample + place.endswith("+1")], place[0]))
            continue
        for sample, place in itertools.product(range(count), FOUR_LANES[kind, samples].split()):
            antenna = int(place[1])
            put(part(words[ramp, antenna, sample], place[0]) if antenna < antennas else 0)
    path.write_bytes(content)
    return path


@pytest.mark.parametrize(("kind", "samples", "num_antennas"), CASES)
def test_every_layout_comes_back_exactly(
    tmp_path: Path, kind: str, samples: str, num_antennas: int
) -> None:
    words = example_words(num_antennas, samples)
    path = written(tmp_path / "adc.bin", words, kind, samples)
    chosen = settings(kind, samples=samples, num_antennas=num_antennas)
    read = read_raw(str(path), chosen)
    assert np.array_equal(read.samples * 2**15, words)
    assert read.remarks == ()


@pytest.mark.parametrize("bits", [12, 14])
def test_the_sign_of_a_short_word_is_extended(tmp_path: Path, bits: int) -> None:
    words = example_words(2, "complex", bits)
    path = written(tmp_path / "adc.bin", words, "dca1000-xwr14xx", "complex", 2**bits - 1)
    read = read_raw(str(path), settings("dca1000-xwr14xx", num_antennas=2, adc_bits=bits))
    assert np.array_equal(read.samples * 2 ** (bits - 1), words)


def test_a_frame_is_chosen_and_a_rest_remarked(tmp_path: Path) -> None:
    words = example_words(1, "complex", frames=3)
    path = written(tmp_path / "adc.bin", words, "dca1000-xwr16xx", "complex")
    read = read_raw(str(path), settings("dca1000-xwr16xx", frame=1))
    assert np.array_equal(read.samples * 2**15, words[3:6])
    path.write_bytes(path.read_bytes()[:-7])
    read = read_raw(str(path), settings("dca1000-xwr16xx", frame=1))
    assert np.array_equal(read.samples * 2**15, words[3:6])
    assert "ends with 89 bytes that are no whole frame of 96 bytes" in read.remarks[0]
    with pytest.raises(InputError, match=r"2 whole frames of 3 ramps.*frame 2 is not among them"):
        read_raw(str(path), settings("dca1000-xwr16xx", frame=2))


def test_without_a_number_of_ramps_the_file_is_one_frame(tmp_path: Path) -> None:
    words = example_words(1, "complex", frames=2)
    path = written(tmp_path / "adc.bin", words, "dca1000-xwr16xx", "complex")
    assert read_raw(str(path), settings("dca1000-xwr16xx", num_ramps=None)).samples.shape == (
        6,
        1,
        8,
    )


@pytest.mark.parametrize(
    ("changes", "size", "words"),
    [
        ({"num_ramps": None}, 100, "100 bytes, which is no whole number of ramps of 32 bytes"),
        ({"num_ramps": None}, 0, "0 bytes, which is no whole number"),
        ({"num_ramps": None, "frame": 1}, 96, "num_ramps must be given"),
        ({}, 95, "0 whole frames of 3 ramps"),
        ({"num_samples": 9}, 96, "two lanes need an even number"),
        ({"format": "tsw1400", "num_antennas": 5}, 96, "has 4 lanes"),
        ({"num_samples": 2**20, "num_ramps": 2**20}, 96, "0 whole frames"),
    ],
)
def test_counts_that_do_not_fit_are_told(
    tmp_path: Path, changes: dict[str, Any], size: int, words: str
) -> None:
    path = tmp_path / "adc.bin"
    path.write_bytes(bytes(size))
    with pytest.raises(InputError, match=words):
        read_raw(str(path), settings(**({"kind": "dca1000-xwr16xx"} | changes)))


def test_a_frame_too_large_is_refused_before_it_is_read(tmp_path: Path) -> None:
    path = tmp_path / "adc.bin"
    with path.open("wb") as file:
        file.truncate(2**30)  # holes, which take no room
    with pytest.raises(InputError, match="at most 134217728 are allowed: give num_ramps"):
        read_raw(str(path), settings("dca1000-xwr16xx", num_ramps=None))


@pytest.mark.parametrize(
    ("name", "words"), [("nowhere.bin", "does not exist"), ("nul\0.bin", "cannot be read")]
)
def test_a_file_that_cannot_be_read_is_told(tmp_path: Path, name: str, words: str) -> None:
    with pytest.raises(InputError, match=words):
        read_raw(str(tmp_path / name), settings("tsw1400", num_ramps=None))
