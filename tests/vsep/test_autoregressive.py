import numpy as np
import pytest

from tests.vsep.repair_bench import repair_scene
from vsep.analysis.repair import windowed_error_db
from vsep.mitigation.autoregressive import (
    autoregressive,
    fit_coefficients,
    predicted_gaps,
    prediction_errors,
)
from vsep.mitigation.method import mitigate

NUM_SAMPLES = 60


def lines(*beats):
    """Two ramps of the same lines with different weights."""
    sample = np.arange(NUM_SAMPLES)
    weights = np.array([[1.0, 2.0j, 0.5], [0.3j, 1.0, -1.0]])[:, : len(beats)]
    return weights @ np.exp(-2j * np.pi * np.outer(beats, sample))


def test_the_predictor_of_noiseless_lines_has_their_zeros():
    beats = np.array([0.11, -0.2])
    coefficients = fit_coefficients(lines(*beats), np.zeros((2, NUM_SAMPLES), dtype=bool), 2)
    zeros = np.roots(np.concatenate([[1.0], -coefficients]))
    expected = np.exp(-2j * np.pi * beats)
    # The ridge of 1e-9 moves the coefficients of noiseless lines by some 1e-8.
    np.testing.assert_allclose(np.sort_complex(zeros), np.sort_complex(expected), atol=1e-6)


def test_prediction_errors_of_lines_are_zero_both_ways_and_see_one_wrong_sample():
    signal = lines(0.11, -0.2)
    mask = np.zeros(signal.shape, dtype=bool)
    coefficients = fit_coefficients(signal, mask, 2)
    spoiled = signal.copy()
    spoiled[1, 20] += 1.0
    errors = prediction_errors(spoiled, coefficients)
    assert np.abs(errors.forward[1, 20]) == pytest.approx(1.0, abs=1e-5)
    assert np.abs(errors.backward[1, 20]) == pytest.approx(1.0, abs=1e-5)
    # Forwards it spoils the two samples after it, backwards the two before it.
    assert np.flatnonzero(np.abs(errors.forward[1]) > 1e-5).tolist() == [20, 21, 22]
    assert np.flatnonzero(np.abs(errors.backward[1]) > 1e-5).tolist() == [18, 19, 20]
    assert np.isnan(errors.forward[:, :2]).all()
    assert np.isnan(errors.backward[:, -2:]).all()


def test_gaps_in_noiseless_lines_are_filled_from_both_ramps_model():
    signal = lines(0.11, -0.2, 0.31)
    mask = np.zeros(signal.shape, dtype=bool)
    mask[0, 10:25] = mask[1, 40:] = True
    filled = predicted_gaps(np.where(mask, 7.0, signal), mask, order=3)
    np.testing.assert_allclose(filled, signal, atol=1e-4)


def test_without_a_clean_stretch_the_model_is_nothing():
    mask = np.arange(NUM_SAMPLES) % 3 == 0
    coefficients = fit_coefficients(np.ones((1, NUM_SAMPLES)), mask[None], 4)
    np.testing.assert_array_equal(coefficients, np.zeros(4))


@pytest.mark.scenario
def test_simulation_2_is_repaired_ten_decibels_better_than_by_zeroing():
    # Measured with 30 frames: -20 dB with a standard error of 0.8 dB. Another autoregressive repair
    # came to -11 dB in independent trials, with errors above 0 dB in some frames: not one must be.
    errors = []
    for index in range(24):
        scene = repair_scene(index, tails=False)
        cleaned = mitigate(autoregressive(), scene.received, scene.mask).cleaned
        errors.append(windowed_error_db(scene.objects, cleaned))
    assert np.mean(errors) < -18.0
    assert max(errors) < 0.0
