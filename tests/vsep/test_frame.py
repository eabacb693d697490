import contextlib
import io
import struct
import zipfile
from collections.abc import Callable
from dataclasses import astuple, fields, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vsep.errors import InputError
from vsep.files.frame import Frame, read_frame, write_frame
from vsep.presets.antennas import simulate_preset_antennas
from vsep.signal.filters import ButterworthFilter, MeasuredFilter, NoFilter, RaisedCosineFilter
from vsep.signal.linear_array import UniformLinearArray
from vsep.signal.radar import ChirpSequence
from vsep.signal.scene import GroundTruth, TrueBurst

FrameArrays = Callable[..., dict[str, Any]]


def saved(path: Path, arrays: dict[str, Any]) -> Path:
    np.savez(path, **arrays)
    return path


@pytest.fixture
def broken(tmp_path: Path, frame_arrays: FrameArrays) -> Callable[..., str]:
    """Write a frame with some arrays changed and return what reading it complains about."""

    def sentence(**changes: Any) -> str:
        path = saved(tmp_path / "frame.npz", frame_arrays(**changes))
        with pytest.raises(InputError) as caught:
            read_frame(path)
        text = str(caught.value)
        assert "\n" not in text
        assert "frame.npz" in text
        return text

    return sentence


def example_frame(radar: ChirpSequence, **changes: Any) -> Frame:
    rng = np.random.default_rng(3)
    objects, bursts, noise = rng.normal(size=(3, *radar.shape, 2)) @ np.array([1.0, 1.0j])
    truth = GroundTruth(
        beats=np.array([0.1, -0.2]),
        dopplers=np.array([0.0, 0.3]),
        amplitudes=np.array([1.0 + 2.0j, 0.5]),
        object_signal=objects,
        interference_signal=bursts,
        bursts=(TrueBurst(ramp=2, start_frequency_hz=1e6, slope_hz_per_s=-8e11),),
        noise_precision=7.0,
    )
    settings: dict[str, Any] = {
        "received": objects + bursts + noise,
        "radar": radar,
        "truth": truth,
    }
    return Frame(**(settings | changes))


# What the contract says


def test_contract_scalars_give_the_radar(
    tmp_path: Path, frame_arrays: FrameArrays, small_radar: ChirpSequence
) -> None:
    frame = read_frame(saved(tmp_path / "frame.npz", frame_arrays()))
    assert frame.radar == small_radar
    assert np.array_equal(frame.received, frame_arrays()["received"])
    assert frame.truth is None
    assert frame.name == str(tmp_path / "frame.npz")


def test_a_vector_is_a_single_ramp_and_goes_back_as_one(
    tmp_path: Path, frame_arrays: FrameArrays
) -> None:
    vector = frame_arrays()["received"][0]
    frame = read_frame(saved(tmp_path / "frame.npz", frame_arrays(received=vector)))
    assert frame.received.shape == frame.radar.shape == (1, 32)
    assert np.array_equal(frame.in_file_sign(frame.received), vector)


def test_positive_beat_sign_conjugates_the_signal(
    tmp_path: Path, frame_arrays: FrameArrays
) -> None:
    stored = frame_arrays()["received"]
    frame = read_frame(saved(tmp_path / "frame.npz", frame_arrays(beat_sign=1)))
    assert np.array_equal(frame.received, stored.conj())
    assert np.array_equal(frame.in_file_sign(frame.received), stored)


def test_positive_beat_sign_puts_a_target_at_its_positive_beat(
    tmp_path: Path, frame_arrays: FrameArrays
) -> None:
    sensor = np.exp(2j * np.pi * 0.25 * np.arange(32))
    frame = read_frame(saved(tmp_path / "f.npz", frame_arrays(received=sensor, beat_sign=1)))
    # Beat 0.25 in the paper's sign is bin 8 of 32 of the inverse transform.
    assert np.argmax(np.abs(np.fft.ifft(frame.received[0]))) == 8


def test_single_precision_and_foreign_byte_order_are_accepted(
    tmp_path: Path, frame_arrays: FrameArrays
) -> None:
    stored = frame_arrays()["received"].astype(">c8")
    frame = read_frame(saved(tmp_path / "frame.npz", frame_arrays(received=stored)))
    assert frame.received.dtype == np.complex128
    assert np.array_equal(frame.received, stored)


def test_received_cannot_be_written_to(tmp_path: Path, frame_arrays: FrameArrays) -> None:
    frame = read_frame(saved(tmp_path / "frame.npz", frame_arrays()))
    assert not frame.received.flags.writeable


def test_unknown_arrays_are_ignored(tmp_path: Path, frame_arrays: FrameArrays) -> None:
    arrays = frame_arrays(comment="measured on a rainy day", gps=np.zeros((3, 3, 3)))
    assert read_frame(saved(tmp_path / "frame.npz", arrays)).radar.num_ramps == 4


def test_a_frame_is_read_from_memory_under_its_given_name(frame_arrays: FrameArrays) -> None:
    memory = io.BytesIO()
    np.savez_compressed(memory, **frame_arrays())
    memory.seek(0)
    assert read_frame(memory, name="upload.npz").name == "upload.npz"


# The assumed filter


@pytest.mark.parametrize(
    ("arrays", "expected"),
    [
        ({}, RaisedCosineFilter(cutoff_hz=5.1e6 / 4, rolloff=0.25)),
        ({"filter_kind": "none"}, NoFilter()),
        (
            {"filter_kind": "raised_cosine", "filter_cutoff_hz": 1e6, "filter_rolloff": 0.5},
            RaisedCosineFilter(cutoff_hz=1e6, rolloff=0.5),
        ),
        (
            {"filter_kind": b"raised_cosine", "filter_cutoff_hz": np.array([1e6])},
            RaisedCosineFilter(cutoff_hz=1e6, rolloff=0.25),
        ),
        (
            {"filter_kind": "butterworth", "filter_cutoff_hz": 1000000, "filter_order": 4},
            ButterworthFilter(cutoff_hz=1e6, order=4),
        ),
    ],
    ids=["default", "none", "raised cosine", "default roll-off", "butterworth"],
)
def test_filter_keys_give_the_assumed_filter(
    tmp_path: Path, frame_arrays: FrameArrays, arrays: dict[str, Any], expected: object
) -> None:
    frame = read_frame(saved(tmp_path / "frame.npz", frame_arrays(**arrays)))
    assert frame.assumed_filter == expected
    assert (frame.anti_aliasing_filter is None) == (not arrays)


@pytest.mark.parametrize("beat_sign", [-1, 1])
def test_measured_filter_answers_in_the_sign_of_the_signal(
    tmp_path: Path, frame_arrays: FrameArrays, beat_sign: int
) -> None:
    frequency_hz = np.linspace(-2e6, 2e6, 41)
    response = np.exp(-((frequency_hz - 3e5) ** 2) / 1e12) * np.exp(1e-7j * frequency_hz)
    arrays = frame_arrays(
        beat_sign=beat_sign,
        filter_kind="measured",
        filter_frequency_hz=frequency_hz,
        filter_response=response,
    )
    frame = read_frame(saved(tmp_path / "frame.npz", arrays))
    # A conjugated signal has passed through conj(G(-f)).
    expected = response if beat_sign == -1 else response[::-1].conj()
    assert np.allclose(frame.assumed_filter.response(frequency_hz), expected, rtol=0, atol=1e-12)


def test_measured_filter_survives_writing_in_either_sign(
    tmp_path: Path, small_radar: ChirpSequence
) -> None:
    frequency_hz = np.array([-2e6, -1e6, 0.0, 1.5e6, 2.5e6])
    response = np.array([0.1j, 1.0, 1.0 + 0.5j, 0.3, 0.1])
    measured = MeasuredFilter(frequency_hz=frequency_hz, response=response)
    for beat_sign in (-1, 1):
        frame = example_frame(small_radar, anti_aliasing_filter=measured, beat_sign=beat_sign)
        write_frame(tmp_path / "frame.npz", frame)
        read = read_frame(tmp_path / "frame.npz").anti_aliasing_filter
        assert isinstance(read, MeasuredFilter)
        assert np.array_equal(read.frequency_hz, frequency_hz)
        assert np.array_equal(read.samples, response)


# Writing


@pytest.mark.parametrize("beat_sign", [-1, 1])
def test_a_written_frame_reads_back_the_same(
    tmp_path: Path, small_radar: ChirpSequence, beat_sign: int
) -> None:
    settings = {"preset": "simulation-2-a", "snr_db": "60.0", "sir_db": "-20.25", "seed": "7"}
    frame = example_frame(
        small_radar,
        beat_sign=beat_sign,
        anti_aliasing_filter=ButterworthFilter(cutoff_hz=1e6, order=3),
        settings=settings,
    )
    write_frame(tmp_path / "frame.npz", frame)
    read = read_frame(tmp_path / "frame.npz")
    assert read.radar == frame.radar
    assert read.anti_aliasing_filter == frame.anti_aliasing_filter
    assert read.beat_sign == beat_sign
    assert read.settings == settings
    assert np.array_equal(read.received, frame.received)
    assert read.truth is not None
    assert frame.truth is not None
    for name in ("beats", "dopplers", "amplitudes", "object_signal", "interference_signal"):
        assert np.array_equal(getattr(read.truth, name), getattr(frame.truth, name)), name
    assert read.truth.noise_precision == 7.0
    assert [(b.ramp, b.start_frequency_hz, b.slope_hz_per_s) for b in read.truth.bursts] == [
        (2, 1e6, -8e11)
    ]


def test_signals_of_the_truth_are_stored_in_the_sign_of_the_file(
    tmp_path: Path, small_radar: ChirpSequence
) -> None:
    frame = example_frame(small_radar, beat_sign=1)
    write_frame(tmp_path / "frame.npz", frame)
    assert frame.truth is not None
    with np.load(tmp_path / "frame.npz", allow_pickle=False) as stored:
        assert np.array_equal(stored["truth_object_signal"], frame.truth.object_signal.conj())


def test_the_largest_seed_survives_writing(tmp_path: Path, small_radar: ChirpSequence) -> None:
    frame = example_frame(small_radar, settings={"seed": str(2**63 - 1)})
    write_frame(tmp_path / "frame.npz", frame)
    assert read_frame(tmp_path / "frame.npz").settings["seed"] == str(2**63 - 1)


def test_the_same_frame_gives_the_same_bytes(tmp_path: Path, small_radar: ChirpSequence) -> None:
    for name in ("a.npz", "b.npz"):
        write_frame(tmp_path / name, example_frame(small_radar))
    assert (tmp_path / "a.npz").read_bytes() == (tmp_path / "b.npz").read_bytes()


def test_a_frame_file_must_be_named_npz(tmp_path: Path, small_radar: ChirpSequence) -> None:
    with pytest.raises(InputError, match=r"must end in \.npz"):
        write_frame(tmp_path / "frame.txt", example_frame(small_radar))
    assert not list(tmp_path.iterdir())


def test_an_incomplete_truth_is_no_truth(tmp_path: Path, frame_arrays: FrameArrays) -> None:
    frame = read_frame(saved(tmp_path / "f.npz", frame_arrays(truth_beat=np.array([0.2]))))
    assert frame.truth is None


# What cannot be used


def test_an_absent_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"nothing\.npz does not exist"):
        read_frame(tmp_path / "nothing.npz")


def test_a_directory_is_no_frame(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="is a directory"):
        read_frame(tmp_path)


@pytest.mark.parametrize("content", [b"", b"received = 1, 2, 3\n", b"PK\x03\x04", b"\x93NUMPY"])
def test_other_files_are_no_frames(tmp_path: Path, content: bytes) -> None:
    (tmp_path / "frame.npz").write_bytes(content)
    with pytest.raises(InputError, match="not a frame file"):
        read_frame(tmp_path / "frame.npz")


def test_an_archive_of_an_unknown_zip_version_is_no_frame(
    tmp_path: Path, frame_arrays: FrameArrays
) -> None:
    path = saved(tmp_path / "frame.npz", frame_arrays())
    content = bytearray(path.read_bytes())
    # The directory entry's version needed to extract stands six bytes after its signature.
    content[content.index(b"PK\x01\x02") + 6] = 250
    path.write_bytes(content)
    with pytest.raises(InputError, match="not a frame file"):
        read_frame(path)


def test_a_single_array_file_is_no_frame(tmp_path: Path) -> None:
    np.save(tmp_path / "frame.npy", np.ones((4, 32), dtype=complex))
    with pytest.raises(InputError, match="not a frame file"):
        read_frame(tmp_path / "frame.npy")


def test_pickled_objects_are_never_loaded(broken: Callable[..., str]) -> None:
    assert "pickled objects" in broken(received=np.array([[1j, None]], dtype=object))
    assert "pickled objects" in broken(slope_hz_per_s=np.array({"a": 1}, dtype=object))


@pytest.mark.parametrize(
    "key", ["received", "sample_rate_hz", "slope_hz_per_s", "start_frequency_hz", "ramp_period_s"]
)
def test_a_missing_array_is_named(broken: Callable[..., str], key: str) -> None:
    assert key in broken(**{key: None})


@pytest.mark.parametrize(
    ("received", "words"),
    [
        (np.array(1j), "shape ()"),
        (np.ones((2, 2, 4, 32), dtype=complex), "shape (2, 2, 4, 32)"),
        (np.ones((0, 4, 32), dtype=complex), "holds no antenna"),
        (np.ones((4, 32)), "complex samples"),
        (np.ones((4, 32), dtype=int), "complex samples"),
        (np.full((4, 32), "a"), "complex samples"),
        (np.zeros((4, 32), dtype=[("i", "i2"), ("q", "i2")]), "complex samples"),
        (np.ones((4, 0), dtype=complex), "num_samples is 0"),
        (np.ones((0, 32), dtype=complex), "num_ramps is 0"),
        (np.ones((4, 7), dtype=complex), "num_samples is 7"),
        (np.ones((1, 65537), dtype=complex), "num_samples is 65537"),
        (np.zeros((4, 32), dtype=complex), "zero everywhere"),
        (np.full((4, 32), np.nan + 0j), "128 of 128 samples"),
        (np.full((4, 32), 1.01e60 + 0j), "largest magnitude"),
        (np.full((4, 32), 0.99e-60 + 0j), "largest magnitude"),
    ],
)
def test_an_unusable_signal_is_described(
    broken: Callable[..., str], received: np.ndarray[Any, Any], words: str
) -> None:
    assert words in broken(received=received)


def test_one_infinite_sample_is_counted(
    broken: Callable[..., str], frame_arrays: FrameArrays
) -> None:
    received = frame_arrays()["received"]
    received[2, 5] = complex(0.0, np.inf)
    assert "1 of 128 samples" in broken(received=received)


@pytest.mark.parametrize(
    ("key", "value", "words"),
    [
        ("sample_rate_hz", np.nan, "sample_rate_hz is nan Hz"),
        ("sample_rate_hz", -5e6, "sample_rate_hz is -5e+06 Hz"),
        ("slope_hz_per_s", 0.0, "slope_hz_per_s) is 0"),
        ("start_frequency_hz", 1e300, "start_frequency_hz is 1e+300 Hz"),
        ("ramp_period_s", np.inf, "ramp_period_s is inf s"),
        ("sample_rate_hz", "fast", "one real number"),
        ("sample_rate_hz", 5e6 + 1j, "one real number"),
        ("sample_rate_hz", np.ones(2), "at most 1 element is allowed"),
        ("sample_rate_hz", np.ones(0), "one real number"),
        ("beat_sign", 0, "beat_sign is 0"),
        ("beat_sign", np.nan, "beat_sign is nan"),
        ("lowest_beat", 0.5, "lowest_beat is 0.5"),
        ("filter_kind", "chebyshev", "'chebyshev'; it must be one of raised_cosine"),
        ("filter_kind", 3, "one text"),
        ("filter_kind", "x" * 5000, "over 4096 characters"),
        ("filter_kind", "butterworth", "'filter_cutoff_hz'"),
        ("filter_kind", "measured", "'filter_frequency_hz'"),
        ("filter_cutoff_hz", 1e6, "no filter_kind"),
        ("seed", np.ones(3), "at most 1 element is allowed"),
    ],
)
def test_an_absurd_value_is_named(
    broken: Callable[..., str], key: str, value: object, words: str
) -> None:
    assert words in broken(**{key: value})


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        (
            {"filter_kind": "butterworth", "filter_order": 2.5},
            "filter_order is 2.5; a whole number",
        ),
        ({"filter_kind": "butterworth", "filter_order": 99}, "filter order is 99"),
        ({"filter_kind": "raised_cosine", "filter_rolloff": 2.0}, "filter rolloff is 2"),
        (
            {
                "filter_kind": "measured",
                "filter_frequency_hz": np.ones((2, 2)),
                "filter_response": np.ones(4),
            },
            "filter_frequency_hz has type float64 and 2 axes",
        ),
    ],
)
def test_an_absurd_filter_is_described(
    broken: Callable[..., str], changes: dict[str, Any], words: str
) -> None:
    assert words in broken(filter_cutoff_hz=1e6, **changes)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"truth_beat": np.zeros(2)}, "2, 1 and 1 entries"),
        ({"truth_beat": np.array([np.nan])}, "truth_beat holds NaN"),
        ({"truth_amplitude": np.array([[1j]])}, "truth_amplitude has type complex128 and 2 axes"),
        ({"truth_object_signal": np.zeros((4, 31))}, "truth_object_signal has shape (4, 31)"),
        ({"truth_bursts": np.zeros(3)}, "truth_bursts has shape (3,)"),
        ({"truth_bursts": np.array([[4.0, 0.0, 1e12]])}, "ramps are 0 to 3"),
    ],
)
def test_an_absurd_truth_is_described(
    broken: Callable[..., str], changes: dict[str, Any], words: str
) -> None:
    truth: dict[str, Any] = {
        "truth_beat": np.array([0.2]),
        "truth_doppler": np.array([0.1]),
        "truth_amplitude": np.array([1j]),
        "truth_object_signal": np.zeros((4, 32), dtype=complex),
        "truth_interference_signal": np.zeros((4, 32), dtype=complex),
    }
    assert words in broken(**(truth | changes))


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"truth_amplitude": np.ones((1, 3))}, "one for each of 2 antennas in a row"),
        ({"truth_amplitude": np.array([[1.0, np.inf]])}, "truth_amplitude holds NaN"),
        ({"truth_object_signal": np.zeros((4, 32))}, "it must be that of received, (2, 4, 32)"),
        ({"truth_angle_deg": np.zeros(2)}, "truth_angle_deg has 2 entries; it must have 1"),
        ({"truth_interferer_angle_deg": np.array([np.nan])}, "truth_interferer_angle_deg holds"),
    ],
)
def test_an_absurd_truth_of_antennas_is_described(
    broken: Callable[..., str], changes: dict[str, Any], words: str
) -> None:
    signals = np.zeros((2, 4, 32), dtype=complex)
    truth: dict[str, Any] = {
        "received": signals + 1.0,
        "truth_beat": np.array([0.2]),
        "truth_doppler": np.array([0.1]),
        "truth_amplitude": np.array([[1j, 1.0]]),
        "truth_object_signal": signals,
        "truth_interference_signal": signals,
    }
    assert words in broken(**(truth | changes))


def npy_bytes(shape: str, data: bytes = b"", descr: str = "<c16") -> bytes:
    """Write an array file by hand, whose header may lie."""
    header = f"{{'descr': '{descr}', 'fortran_order': False, 'shape': {shape}, }}".encode()
    header += b" " * (-(len(header) + 11) % 64) + b"\n"
    return b"\x93NUMPY\x01\x00" + struct.pack("<H", len(header)) + header + data


@pytest.mark.parametrize(
    ("member", "words"),
    [
        (npy_bytes("(9999999, 9999999)"), "9999999 x 9999999; at most 67108864 elements"),
        # The product overflows 64 bits to zero.
        (npy_bytes("(4294967296, 4294967296)"), "at most 67108864 elements"),
        (npy_bytes("(4, 32)", b"\0" * 16), "declares the shape 4 x 32 of complex128 but holds 16"),
        (npy_bytes("(-4, 32)", b"\0" * 16), "damaged or cut off"),
        (npy_bytes("(4, 32", b"\0" * 16), "damaged or cut off"),
        (npy_bytes("(" * 3000 + "4" + ")" * 3000), "damaged or cut off"),
        (npy_bytes("(4,)", b"\0" * 16, descr="nonsense"), "damaged or cut off"),
        (b"\x93NUMPY\x09\x00", "damaged or cut off"),
        (b"", "damaged or cut off"),
        (b"hello, this is a text", "damaged or cut off"),
    ],
)
def test_lying_headers_are_refused_before_their_data_are_read(
    tmp_path: Path, member: bytes, words: str
) -> None:
    with zipfile.ZipFile(tmp_path / "frame.npz", "w") as archive:
        archive.writestr("received.npy", member)
    with pytest.raises(InputError) as caught:
        read_frame(tmp_path / "frame.npz")
    assert words in str(caught.value)


def test_a_bomb_is_refused_without_expanding_it(tmp_path: Path, frame_arrays: FrameArrays) -> None:
    path = saved(tmp_path / "frame.npz", frame_arrays(received=None))
    num_bytes = 2**21
    declared = npy_bytes(f"({num_bytes // 8},)", b"\0" * num_bytes, descr="<f8")
    with zipfile.ZipFile(path, "a", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("received.npy", npy_bytes("(70000, 1000)", b"\0" * num_bytes))
        archive.writestr("lowest_beat.npy", declared)
    with pytest.raises(InputError, match="at most 67108864 elements"):
        read_frame(path)


@given(st.data())
def test_no_damage_raises_anything_but_an_input_error(
    tmp_path_factory: pytest.TempPathFactory, small_radar: ChirpSequence, data: st.DataObject
) -> None:
    path = tmp_path_factory.getbasetemp() / "damaged.npz"
    radar = replace(small_radar, num_samples=8, num_ramps=2)
    write_frame(path, example_frame(radar, truth=None))
    content = bytearray(path.read_bytes())
    if data.draw(st.booleans(), label="cut"):
        content = content[: data.draw(st.integers(0, len(content) - 1), label="length")]
    else:
        position = data.draw(st.integers(0, len(content) - 1), label="position")
        content[position] ^= data.draw(st.integers(1, 255), label="flip")
    path.write_bytes(content)
    # Damage to padding or to a name of an unneeded array may go unnoticed; anything else than an
    # InputError escapes and fails the test.
    with contextlib.suppress(InputError):
        read_frame(path)


# The record


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"received": np.ones((3, 32), dtype=complex)}, "shape \\(3, 32\\)"),
        ({"beat_sign": 2}, "beat_sign is 2"),
        ({"is_vector": True}, "one ramp, not 4"),
    ],
)
def test_a_frame_checks_itself(
    small_radar: ChirpSequence, changes: dict[str, Any], words: str
) -> None:
    with pytest.raises(InputError, match=words):
        example_frame(small_radar, **changes)


def test_the_shipped_frame_is_a_frame(repository: Path) -> None:
    frame = read_frame(repository / "assets/frames/openradar_doppler_example_1.npz")
    assert frame.radar.shape == (128, 128)
    assert frame.beat_sign == 1
    # 60 MHz/us at 2.5 MHz: 2.5e6 / 60e12 s of delay, 6.25 m, counted from zero.
    assert frame.radar.lowest_beat == 0.0
    assert frame.radar.range_from_beat(np.array(-0.5)) == pytest.approx(3.12, abs=0.01)


# Several antennas


def test_every_antenna_is_kept_and_one_is_received(
    tmp_path: Path, frame_arrays: FrameArrays
) -> None:
    one = frame_arrays()["received"]
    stored = np.stack([one, 1j * one, -2.0 * one])
    arrays = frame_arrays(received=stored, beat_sign=1, antenna_spacing_wavelengths=0.5)
    frame = read_frame(saved(tmp_path / "frame.npz", arrays), antenna=2)
    assert np.array_equal(frame.received, stored[2].conj())
    assert (frame.num_antennas, frame.antenna) == (3, 2)
    assert frame.antenna_spacing_wavelengths == 0.5
    write_frame(tmp_path / "again.npz", frame)
    with np.load(tmp_path / "again.npz") as again:
        assert np.array_equal(again["received"], stored)
        assert again["antenna_spacing_wavelengths"] == 0.5


@pytest.mark.parametrize("beat_sign", [-1, 1])
def test_the_truth_of_all_antennas_survives_writing(tmp_path: Path, beat_sign: int) -> None:
    line = UniformLinearArray(num_antennas=3)
    scenario, observation = simulate_preset_antennas(
        "simulation-1", line, snr_db=30.0, sir_db=-10.0, seed=2
    )
    truth = observation.truth
    assert truth is not None
    frame = Frame(
        received=observation.received[1],
        radar=scenario.radar,
        truth=truth.of_antenna(1),
        beat_sign=beat_sign,
        antennas=observation.received,
        antenna=1,
        antennas_truth=truth,
    )
    write_frame(tmp_path / "frame.npz", frame)
    back = read_frame(tmp_path / "frame.npz", antenna=2)
    assert back.antennas_truth is not None
    assert back.truth is not None
    for field in fields(GroundTruth):
        written, stored = (getattr(each, field.name) for each in (truth, back.antennas_truth))
        if field.name == "bursts":
            written, stored = ([astuple(burst) for burst in bursts] for bursts in (written, stored))
        assert np.array_equal(written, stored), field.name
    assert np.array_equal(back.truth.object_signal, truth.object_signal[2])
    with pytest.raises(InputError, match=r"antennas_truth is that of \(3,\) antennas"):
        replace(frame, antennas=None, antenna=0)


@pytest.mark.parametrize("antenna", [-1, 2])
def test_an_antenna_that_is_not_there_is_refused(
    tmp_path: Path, frame_arrays: FrameArrays, antenna: int
) -> None:
    stored = np.stack([frame_arrays()["received"]] * 2)
    path = saved(tmp_path / "frame.npz", frame_arrays(received=stored))
    with pytest.raises(InputError, match=rf"antenna is {antenna}; it must lie between 0 and 1"):
        read_frame(path, antenna=antenna)


def test_a_bad_sample_of_another_antenna_is_found(
    broken: Callable[..., str], frame_arrays: FrameArrays
) -> None:
    stored = np.stack([frame_arrays()["received"]] * 2)
    stored[1, 2, 3] = np.nan
    assert "1 of 128 samples" in broken(received=stored)


@pytest.mark.parametrize("spacing", [0.0, -0.5, np.nan, np.inf])
def test_an_impossible_antenna_spacing_is_refused(
    broken: Callable[..., str], spacing: float
) -> None:
    assert "antenna_spacing_wavelengths" in broken(antenna_spacing_wavelengths=spacing)


def test_received_must_be_the_signal_of_its_antenna(small_radar: ChirpSequence) -> None:
    one = example_frame(small_radar).received
    with pytest.raises(InputError, match="not the signal of antenna 1"):
        example_frame(small_radar, received=one, antennas=np.stack([one, 2.0 * one]), antenna=1)
    with pytest.raises(InputError, match="antennas have shape"):
        example_frame(small_radar, received=one, antennas=one)
