import numpy as np
import pytest

from vsep.errors import InputError
from vsep.files.response_file import read_response, write_response
from vsep.signal.receiver_response import ReceiverResponse


def example(num_antennas):
    rng = np.random.default_rng(num_antennas)
    shape = (num_antennas, 21)
    return ReceiverResponse(
        frequency_hz=np.linspace(-3e6, 4e6, 21),
        response=rng.normal(size=shape) + 1j * rng.normal(size=shape),
        coherence=rng.uniform(size=shape),
        slope_difference_hz_per_s=-2e13,
        num_bursts=17,
    )


@pytest.mark.parametrize("beat_sign", [-1, 1])
@pytest.mark.parametrize("num_antennas", [1, 3])
def test_what_is_written_is_read(tmp_path, num_antennas, beat_sign):
    response = example(num_antennas)
    write_response(tmp_path / "r.npz", response, beat_sign=beat_sign, sources=["a.npz", "b.npz"])
    back = read_response(tmp_path / "r.npz")
    for name in ("frequency_hz", "response", "coherence"):
        np.testing.assert_array_equal(getattr(back, name), getattr(response, name))
    assert (back.slope_difference_hz_per_s, back.num_bursts) == (-2e13, 17)


def test_a_file_keeps_the_sign_of_its_recording(tmp_path):
    response = example(1)
    write_response(tmp_path / "r.npz", response, beat_sign=1, sources=["a"])
    with np.load(tmp_path / "r.npz") as stored:
        # A conjugated signal was filtered by conj(G(-f)).
        np.testing.assert_array_equal(stored["filter_frequency_hz"], -response.frequency_hz[::-1])
        np.testing.assert_array_equal(stored["filter_response"], response.response[0, ::-1].conj())
        assert stored["slope_difference_hz_per_s"] == 2e13
        assert str(stored["sources"]) == "a"


@pytest.mark.parametrize(
    ("arrays", "sentence"),
    [
        ({}, "holds no array 'filter_frequency_hz'"),
        ({"filter_frequency_hz": np.arange(5.0)}, "holds no array 'filter_response'"),
        (
            {"filter_frequency_hz": np.array(["a"] * 5), "filter_response": np.ones(5)},
            "filter_frequency_hz has type",
        ),
        (
            {"filter_frequency_hz": np.arange(5.0), "filter_response": np.ones((2, 2, 5))},
            "filter_response has type complex128|filter_response has type float64 and 3 axes",
        ),
        ({"filter_frequency_hz": np.arange(5.0), "filter_response": np.ones(4)}, "one length"),
        (
            {"filter_frequency_hz": np.arange(5.0), "filter_response": np.ones(5), "beat_sign": 2},
            "beat_sign is 2",
        ),
        (
            {
                "filter_frequency_hz": np.arange(5.0),
                "filter_response": np.array([None] * 5, dtype=object),
            },
            "pickled",
        ),
    ],
)
def test_unusable_files_end_in_one_sentence(tmp_path, arrays, sentence):
    np.savez(tmp_path / "r.npz", **arrays)
    with pytest.raises(InputError, match=sentence) as error:
        read_response(tmp_path / "r.npz")
    assert "r.npz" in str(error.value)


def test_another_suffix_is_refused(tmp_path):
    with pytest.raises(InputError, match=r"must end in \.npz"):
        write_response(tmp_path / "r.txt", example(1), beat_sign=-1, sources=[])
