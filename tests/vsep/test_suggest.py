"""`vsep.recordings.suggest`: what files say of themselves."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.io import savemat

from tests.conftest import FrameArrays
from vsep.errors import InputError
from vsep.files.frame import read_frame
from vsep.recordings.convert import convert_recording
from vsep.recordings.settings import parse_settings
from vsep.recordings.suggest import is_frame_file, suggest_settings

NEEDED = {
    "start_frequency_hz": None,
    "slope_hz_per_s": None,
    "sample_rate_hz": None,
    "ramp_period_s": None,
}


def suggested(path: Path) -> dict[str, Any]:
    return suggest_settings(str(path), path.name)


@pytest.mark.parametrize("beat_sign", [-1, 1])
def test_a_frame_file_says_all(tmp_path: Path, frame_arrays: FrameArrays, beat_sign: int) -> None:
    path = tmp_path / "own.npz"
    arrays = frame_arrays(beat_sign=beat_sign, lowest_beat=-1.0)
    np.savez(path, **arrays)
    assert is_frame_file(str(path), path.name)
    frame, _ = convert_recording(str(path), parse_settings(suggested(path)))
    own = read_frame(path)
    assert frame.radar == own.radar
    assert frame.beat_sign == own.beat_sign
    assert np.array_equal(frame.received, own.received)


def test_an_archive_says_its_largest_array_and_values_by_name(tmp_path: Path) -> None:
    path = tmp_path / "adc.NPZ"
    meta = json.dumps(
        {"slope_hz_per_s": 3e13, "device": "AWR", "adc_start_s": 1e-6, "axes": "x[rx, n]"}
    )
    arrays = {"mask": np.zeros((4, 8), bool), "x": np.ones((4, 8), complex), "meta": meta}
    np.savez(path.with_suffix(".npz"), **arrays, sample_rate_hz=2e7, frame=np.arange(3))
    path.with_suffix(".npz").rename(path)
    found = {"format": "npz", "slope_hz_per_s": 3e13, "sample_rate_hz": 2e7}
    found |= {"adc_start_s": 1e-6, "key": "x"}
    assert suggested(path) == NEEDED | found
    assert not is_frame_file(str(path), path.name)


def test_a_matlab_file_says_the_same(tmp_path: Path) -> None:
    path = tmp_path / "adc.mat"
    savemat(path, {"adc": np.ones((8, 4), complex), "ramp_period_s": 3e-5, "note": "by night"})
    assert suggested(path) == NEEDED | {"format": "mat", "ramp_period_s": 3e-5, "key": "adc"}


@pytest.mark.parametrize("suffix", ["npz", "mat"])
def test_i_and_q_that_lie_apart_are_one_recording(tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"adc.{suffix}"
    parts = {"t": np.zeros(3), "Q": np.ones((4, 8)), "I": 2.0 * np.ones((4, 8))}
    np.savez(path, **parts) if suffix == "npz" else savemat(path, parts)
    assert suggested(path)["key"] == "I,Q"


def test_others_say_their_kind_at_most(tmp_path: Path) -> None:
    for name, kind in (("a.npy", {"format": "npy"}), ("a.bin", {"format": "dca1000-xwr16xx"})):
        (tmp_path / name).write_bytes(b"anything")
        raw = {} if name == "a.npy" else {"num_samples": None}
        assert suggested(tmp_path / name) == kind | NEEDED | raw
        assert not is_frame_file(str(tmp_path / name), name)


@pytest.mark.parametrize("name", ["a.npz", "a.mat"])
def test_a_file_that_is_not_what_it_says_is_one_sentence(tmp_path: Path, name: str) -> None:
    (tmp_path / name).write_bytes(b"nothing of the kind" * 50)
    with pytest.raises(InputError, match=rf"^{name} is "):
        suggested(tmp_path / name)
