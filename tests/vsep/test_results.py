import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from vsep.files.frame import Frame
from vsep.files.results import as_json, result_line, separated_signals
from vsep.inference.core.progress import Solution, Termination
from vsep.inference.core.receiver import PhasePrior, no_errors
from vsep.inference.core.state import BurstComponents, ObjectComponents, SeparationState
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
    "interferers",
    "noise_precision",
    "iterations",
    "termination",
    "seconds",
    "version",
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


def test_an_object_is_given_in_normalised_and_in_physical_units(small_radar: ChirpSequence) -> None:
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


def test_errors_of_the_receiver_are_given_where_there_are_any(small_radar: ChirpSequence) -> None:
    solution = example_solution(small_radar.shape, [0.1])
    assert "receiver" not in result_line("a.npz", solution, small_radar)
    errors = replace(
        no_errors(small_radar.num_ramps, 2),
        prior=PhasePrior(jitter_std=0.005),
        image_factors=np.array([0.0, 0.02j]),
    )
    line = result_line(
        "a.npz",
        replace(solution, state=replace(solution.state, receiver=errors)),
        small_radar,
    )
    assert line["receiver"] == {
        "phase_jitter_rad": 0.005,
        "iq_gain_db": [0.0, 0.0],
        "iq_phase_deg": [0.0, 2.292],
    }
    assert (
        line["objects"][0]["doppler_std"]
        > result_line("a.npz", solution, small_radar)["objects"][0]["doppler_std"]
    )


def test_a_frame_without_objects_has_an_empty_list(small_radar: ChirpSequence) -> None:
    line = result_line("a", example_solution(small_radar.shape, []), small_radar)
    assert line["objects"] == []


def test_a_single_ramp_has_no_doppler_deviation(small_radar: ChirpSequence) -> None:
    radar = replace(small_radar, num_ramps=1)
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


def solution_of_antennas(shape: tuple[int, int], num_antennas: int) -> Solution:
    """One object at 30 degrees for half a wavelength, and one burst that all antennas receive."""
    one = example_solution(shape, [0.1])
    amplitudes = 5.0 * np.exp(2j * np.pi * 0.25 * np.arange(num_antennas))[None]
    bursts = tuple(replace(one.state.bursts[0], antenna=a) for a in range(num_antennas))
    rows = np.tile(one.state.interference_signal, (num_antennas, 1))
    state = replace(
        one.state,
        objects=replace(one.state.objects, amplitudes=amplitudes),
        bursts=bursts,
        object_signal=np.ones_like(rows),
        interference_signal=rows,
    )
    return replace(one, state=state)


def test_an_object_of_several_antennas_has_an_angle_where_their_spacing_is_known(
    small_radar: ChirpSequence,
) -> None:
    solution = solution_of_antennas(small_radar.shape, 4)
    entry = result_line("a", solution, small_radar, 0.5)["objects"][0]
    assert set(entry) == OBJECT_KEYS | {"angle_deg", "angle_std_deg"}
    assert entry["angle_deg"] == pytest.approx(30.0, abs=1e-6)
    # sqrt(6 / (snr A (A^2 - 1))) / (2 pi d cos(theta)) at snr = 25 / 0.25.
    turns = np.sqrt(6.0 / (100.0 * 60.0)) / (2 * np.pi * 0.5 * np.cos(np.pi / 6))
    assert entry["angle_std_deg"] == pytest.approx(np.degrees(turns))
    assert np.shape(entry["amplitude"]) == (4, 2)
    assert entry["component_snr_db"] == pytest.approx(10 * np.log10(25.0 / 0.25 - 1.0))
    alone = result_line("a", example_solution(small_radar.shape, [0.1]), small_radar)["objects"][0]
    assert entry["beat_std"] == pytest.approx(alone["beat_std"] / 2.0)
    assert set(result_line("a", solution, small_radar)["objects"][0]) == OBJECT_KEYS


def test_a_burst_of_several_antennas_is_one_entry(small_radar: ChirpSequence) -> None:
    solution = solution_of_antennas(small_radar.shape, 3)
    (entry,) = result_line("a", solution, small_radar)["interference"]
    assert (entry["ramp"], entry["num_components"], entry["energy"]) == (3, 9, 75.0)


def test_signals_of_several_antennas_come_back_in_the_shape_of_the_file(
    small_radar: ChirpSequence,
) -> None:
    antennas = np.arange(2 * 4 * 32).reshape(2, 4, 32) + 1j
    frame = Frame(received=antennas[0], radar=small_radar, antennas=antennas)
    signals = separated_signals(frame, solution_of_antennas(small_radar.shape, 2))
    interference = signals["interference_signal"]
    assert interference.shape == signals["object_signal"].shape == (2, 4, 32)
    np.testing.assert_array_equal(signals["cleaned"], antennas - interference)
    # Of one antenna that was separated alone.
    one = separated_signals(frame, example_solution(small_radar.shape, [0.1]))
    np.testing.assert_array_equal(one["cleaned"], antennas[0] - one["interference_signal"])
