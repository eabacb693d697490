"""Scores of single chirps against dense products."""

import numpy as np

from vsep.kernels.scores import best_centres, polish


def test_best_centres_take_negative_lags_from_the_end():
    rng = np.random.default_rng(2)
    correlations = (rng.standard_normal((3, 16)) + 1j * rng.standard_normal((3, 16))).astype("c8")
    inverse_energy = rng.uniform(0.5, 2.0, (3, 9))
    columns, scores = best_centres(correlations, -4, inverse_energy)
    power = np.abs(correlations[:, np.arange(-4, 5)].astype(complex)) ** 2 * inverse_energy
    np.testing.assert_array_equal(columns, np.argmax(power, axis=1))
    np.testing.assert_allclose(scores, power.max(axis=1), rtol=1e-6)  # single precision


def test_polishing_finds_the_best_of_the_surroundings_and_stops_at_the_edges():
    rng = np.random.default_rng(3)
    kernels = (rng.standard_normal((5, 40)) + 1j * rng.standard_normal((5, 40))).astype("c8")
    residual = (rng.standard_normal((2, 12)) + 1j * rng.standard_normal((2, 12))).astype("c8")
    inverse_energy = rng.uniform(0.5, 2.0, (5, 17))
    first, samples = -2, np.arange(12)
    score = np.empty((5, 17))
    for s in range(5):
        for c in range(17):
            shifted = kernels[s, samples + 20 - first - c].astype(complex)
            power = np.sum(np.abs(residual @ shifted.conj()) ** 2)
            score[s, c] = power * inverse_energy[s, c]
    places = np.array([0, 4]), np.array([0, 16])
    found = polish(residual, kernels, inverse_energy, first, *places, (1, 2))
    tried = np.full(score.shape, -1.0)
    tried[:2, :3], tried[3:, 14:] = score[:2, :3], score[3:, 14:]
    assert found[:2] == np.unravel_index(np.argmax(tried), tried.shape)
    assert abs(found[2] / tried.max() - 1.0) < 1e-5  # single precision
