import json
from pathlib import Path

import numpy as np
import pytest

from vsep.files.frame import Frame
from vsep.files.results import as_json, result_line, separated_signals
from vsep.inference.state import (
    BurstComponents,
    ObjectComponents,
    SeparationState,
    Solution,
    Termination,
)
from vsep.signal.radar import SPEED_OF_LIGHT_MPS, ChirpSequence

OBJECT_KEYS = {
    "beat",
    "doppler",
    "beat_std",
    "doppler_std",
    "delay_s",
    "range_m",
    "doppler_hz",
    "velocity_mps",
    "amplitude",
    "component_snr_db",
}
LINE_KEYS = {
    "file",
    "radar",
    "objects",
    "interference",
    "noise_precision",
    "iterations",
    "termination",
    "seconds",
}


def example_solution(shape: tuple[int, int], beats: list[float]) -> Solution:
    """A solution made by hand: no estimator, so every number of the line can be told in advance."""
    count = len(beats)
    burst = BurstComponents(
        ramp=shape[0] - 1,
        start_frequency=0.5,
        slope=-0.02,
        active_bins=np.arange(3),
        amplitudes=np.ones(3, dtype=complex),
        covariance=np.eye(3, dtype=complex),
        precisions=np.ones(3),
        energy=25.0,
    )
    interference = np.zeros(shape, dtype=complex)
    interference[-1, :5] = 2.0 + 1.0j
    return Solution(
        state=SeparationState(
            iteration=12,
            objects=ObjectComponents(
                component_ids=np.arange(count),
                beats=np.array(beats),
                dopplers=np.full(count, 0.25 if shape[0] > 1 else 0.0),
                amplitudes=np.full(count, 3.0 - 4.0j),
                # With gamma = 0 the component SNR is |alpha|^2 / variance - 1.
                covariance=np.eye(count, dtype=complex) * 0.25,
                precisions=np.zeros(count),
            ),
            bursts=(burst,),
            noise_precision=4.0,
            object_signal=np.full(shape, 1.0j),
            interference_signal=interference,
            next_component_id=count,
        ),
        termination=Termination.CONVERGED,
        infos=(),
        seconds=0.125,
    )


def test_a_line_has_the_keys_of_the_contract(small_radar: ChirpSequence) -> None:
    line = result_line("a.npz", example_solution(small_radar.shape, [0.1, 0.3]), small_radar)
    assert set(line) == LINE_KEYS
    assert [set(entry) for entry in line["objects"]] == [OBJECT_KEYS, OBJECT_KEYS]
    assert line["file"] == "a.npz"
    assert line["noise_precision"] == 4.0
    assert line["iterations"] == 12
    assert line["termination"] == "converged"
    assert line["seconds"] == 0.125


def test_an_object_is_given_in_normalised_and_in_physical_units(
    small_radar: ChirpSequence,
) -> None:
    entry = result_line("a", example_solution(small_radar.shape, [0.2]), small_radar)["objects"][0]
    assert entry["beat"] == 0.2
    assert entry["doppler"] == 0.25
    # beat = slope * delay / rate; Doppler frequency = doppler / period.
    assert entry["delay_s"] == pytest.approx(0.2 * 5.1e6 / 1e13)
    assert entry["range_m"] == pytest.approx(0.2 * 5.1e6 / 1e13 * SPEED_OF_LIGHT_MPS / 2)
    assert entry["doppler_hz"] == pytest.approx(0.25 / 25e-6)
    assert entry["velocity_mps"] == pytest.approx(10e3 * SPEED_OF_LIGHT_MPS / (2 * 79e9))
    assert entry["amplitude"] == [3.0, -4.0]
    assert entry["component_snr_db"] == pytest.approx(10 * np.log10(25.0 / 0.25 - 1.0))
    assert 0.0 < entry["beat_std"] < 1.0 / 32
    assert 0.0 < entry["doppler_std"] < 1.0 / 4


def test_a_burst_is_given_in_hertz_with_its_energy(small_radar: ChirpSequence) -> None:
    line = result_line("a", example_solution(small_radar.shape, []), small_radar)
    (entry,) = line["interference"]
    assert entry["ramp"] == 3
    assert entry["start_frequency_hz"] == pytest.approx(0.5 * 5.1e6)
    assert entry["slope_hz_per_s"] == pytest.approx(-0.02 * 5.1e6**2)
    assert entry["num_components"] == 3
    assert entry["energy"] == pytest.approx(5 * 5.0)


def test_a_frame_without_objects_has_an_empty_list(small_radar: ChirpSequence) -> None:
    line = result_line("a", example_solution(small_radar.shape, []), small_radar)
    assert line["objects"] == []


def test_a_single_ramp_has_no_doppler_deviation() -> None:
    radar = ChirpSequence(
        start_frequency_hz=79e9,
        slope_hz_per_s=1e13,
        sample_rate_hz=5.1e6,
        ramp_period_s=25e-6,
        num_samples=32,
        num_ramps=1,
    )
    text = as_json(result_line("a", example_solution((1, 32), [0.1]), radar))
    assert json.loads(text)["objects"][0]["doppler_std"] is None


def test_json_is_one_line_that_reads_back_exactly(small_radar: ChirpSequence) -> None:
    line = result_line("ünïcode\n.npz", example_solution(small_radar.shape, [1 / 3]), small_radar)
    text = as_json(line)
    assert "\n" not in text
    assert json.loads(text) == line


def test_json_keeps_a_name_that_is_no_unicode() -> None:
    text = as_json({"file": "a\udcff.npz"})
    assert text.encode("utf-8")
    assert json.loads(text)["file"] == "a\udcff.npz"


def test_json_has_null_for_what_is_no_number() -> None:
    values = {"a": float("nan"), "b": [float("inf"), {"c": -float("inf")}], "d": 1.5}
    assert json.loads(as_json(values)) == {"a": None, "b": [None, {"c": None}], "d": 1.5}


@pytest.mark.parametrize("beat_sign", [-1, 1])
def test_signals_add_up_in_the_sign_of_the_file(
    small_radar: ChirpSequence, beat_sign: int, tmp_path: Path
) -> None:
    rng = np.random.default_rng(1)
    stored = rng.normal(size=(4, 32)) + 1j * rng.normal(size=(4, 32))
    received = stored if beat_sign == -1 else stored.conj()
    frame = Frame(received=received, radar=small_radar, beat_sign=beat_sign)
    solution = example_solution(small_radar.shape, [])
    np.savez(tmp_path / "signals.npz", **separated_signals(frame, solution))
    with np.load(tmp_path / "signals.npz", allow_pickle=False) as signals:
        assert set(signals) == {"object_signal", "interference_signal", "cleaned"}
        assert np.array_equal(signals["cleaned"], stored - signals["interference_signal"])
        assert np.array_equal(signals["object_signal"], np.full((4, 32), -1.0j * beat_sign))
