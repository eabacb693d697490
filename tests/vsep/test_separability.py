import numpy as np
import pytest

from vsep.analysis.separability import separability
from vsep.presets.scenes import simulate_preset


def of_preset(name, sir_db, seed=1):
    _, observation = simulate_preset(name, snr_db=60.0, sir_db=sir_db, seed=seed)
    truth = observation.truth
    return separability(truth.beats, truth.dopplers, truth.amplitudes, truth.interference_signal)


def test_both_readings_agree_with_dense_matrices():
    _, observation = simulate_preset("simulation-2-b", snr_db=60.0, sir_db=-3.0, seed=4)
    truth = observation.truth
    ramp, sample = np.mgrid[:16, :128]
    turns = np.multiply.outer(sample, truth.beats) + np.multiply.outer(ramp, truth.dopplers)
    atoms = np.exp(-2j * np.pi * turns).reshape(2048, -1) / np.sqrt(2048)
    own = atoms.conj().T @ (atoms @ truth.amplitudes)
    other = atoms.conj().T @ truth.interference_signal.ravel()
    result = separability(truth.beats, truth.dopplers, truth.amplitudes, truth.interference_signal)
    whole = 20.0 * np.log10(np.linalg.norm(own) / np.linalg.norm(other))
    each = 20.0 * np.log10(np.abs(truth.amplitudes) / np.abs(other))
    # Sums of 2048 terms in double precision.
    assert result.whole_db == pytest.approx(whole, abs=1e-9)
    assert result.object_db == pytest.approx(each, abs=1e-9)
    assert result.weakest_db == pytest.approx(each.min(), abs=1e-9)


def test_simulation_1_meets_equality_at_minus_20_8_db_in_both_readings():
    result = of_preset("simulation-1", sir_db=-20.8)
    # The figure is stated to a tenth of a dB.
    assert result.whole_db == pytest.approx(0.0, abs=0.05)
    assert result.weakest_db == pytest.approx(result.whole_db, abs=1e-9)


def test_ratios_follow_the_interference_level_one_to_one():
    weak, strong = (of_preset("simulation-2-a", sir_db) for sir_db in (10.0, -10.0))
    assert weak.whole_db - strong.whole_db == pytest.approx(20.0, abs=1e-9)
    assert weak.object_db - strong.object_db == pytest.approx(20.0, abs=1e-9)


def test_without_interference_or_objects_there_is_no_ratio():
    lines = np.array([0.1]), np.zeros(1), np.ones(1, dtype=complex)
    silent = separability(*lines, np.zeros((1, 32), dtype=complex))
    assert np.isnan(silent.whole_db)
    assert np.isnan(silent.weakest_db)
    none = np.zeros(0)
    empty = separability(none, none, none.astype(complex), np.ones((1, 32), dtype=complex))
    assert np.isnan(empty.whole_db)
    assert np.isnan(empty.weakest_db)
