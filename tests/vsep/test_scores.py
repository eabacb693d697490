"""Scores of single chirps against dense products."""

import numpy as np
import pytest

from vsep.kernels.scores import (
    ChirpGrid,
    best_chirps,
    coarse_scores,
    correlation_spectra,
    polish,
)

SLOPES, CENTRES, REACH, NUM_SAMPLES, FIRST, SIZE = 11, 17, 20, 12, -2, 40


def random_complex(rng, *shape):
    return (rng.standard_normal(shape) + 1j * rng.standard_normal(shape)).astype("c8")


def random_grid(seed, close_share=0.6):
    """Kernels without any structure, every third correlated everywhere, and their dense form."""
    rng = np.random.default_rng(seed)
    kernels = random_complex(rng, SLOPES, 2 * REACH)
    inverse_energy = rng.uniform(0.5, 2.0, (SLOPES, CENTRES)).astype("f4")
    inverse_energy[:, -3:] = 0.0
    coarse = np.arange(1, SLOPES, 3)
    samples = np.arange(NUM_SAMPLES) - FIRST - np.arange(CENTRES)[:, None]
    dense = kernels[:, samples + REACH].astype(complex)  # (S, C, N)
    padded = np.zeros((len(coarse), CENTRES, SIZE), dtype=complex)
    padded[:, :, :NUM_SAMPLES] = dense[coarse]
    grid = ChirpGrid(
        kernels=np.stack([kernels.real, kernels.imag], axis=1),
        inverse_energy=inverse_energy,
        first=FIRST,
        coarse=coarse,
        spectra=random_complex(rng, len(coarse), SIZE),
        reach=(1, 2),
        close_share=close_share,
    )
    return grid, dense


def dense_scores(rows, dense, grid):
    """(P, S, C) of rows (A, P, N)."""
    products = np.einsum("apn,scn->apsc", rows, dense.conj())
    return np.sum(np.abs(products) ** 2, axis=0) * grid.inverse_energy


def dense_correlations(rows, dense, grid):
    """(A, P, M, SIZE), of which only the centres are of meaning."""
    correlations = np.full((*rows.shape[:2], len(grid.coarse), SIZE), 1e3, dtype="c8")
    correlations[..., :CENTRES] = np.einsum("apn,scn->apsc", rows, dense[grid.coarse].conj())
    return correlations


def test_spectra_are_multiplied_for_some_ramps():
    rng = np.random.default_rng(1)
    spectra, kernels = random_complex(rng, 2, 5, 16), random_complex(rng, 3, 16)
    products = correlation_spectra(spectra, kernels, (1, 4))
    expected = spectra[:, 1:4, None] * kernels
    np.testing.assert_allclose(products, expected, rtol=1e-5, atol=1e-5)  # single precision


@pytest.mark.parametrize(
    ("place", "tried"), [((0, 0), (2, 3)), ((10, 16), (2, 3)), ((4, 6), (3, 5))]
)
def test_polishing_finds_the_best_of_the_surroundings_and_stops_at_the_edges(place, tried):
    grid, dense = random_grid(3)
    rows = random_complex(np.random.default_rng(4), 2, 1, NUM_SAMPLES)
    scores = dense_scores(rows, dense, grid)[0]
    around = np.full(scores.shape, -1.0)
    slopes, centres = (
        slice(max(place[0] - 1, 0), place[0] + 2),
        slice(max(place[1] - 2, 0), place[1] + 3),
    )
    around[slopes, centres] = scores[slopes, centres]
    assert around[slopes, centres].shape == tried
    parts = np.stack([rows[:, 0].real, rows[:, 0].imag], axis=1)
    found = polish(parts, grid, *place)
    assert found[2] == pytest.approx(around.max(), rel=1e-5)  # single precision
    if around.max() > 0.0:
        assert found[:2] == np.unravel_index(np.argmax(around), around.shape)


@pytest.mark.parametrize("close_share", [0.3, 0.6, 1.0])
@pytest.mark.parametrize("num_antennas", [1, 3])
def test_best_chirps_are_those_around_the_good_coarse_places(num_antennas, close_share):
    grid, dense = random_grid(5, close_share)
    rows = random_complex(np.random.default_rng(6), num_antennas, 7, NUM_SAMPLES)
    correlations = dense_correlations(rows, dense, grid)[:, 2:].copy()
    worthwhile = np.array([0.0, 0.0, 0.0, 1e9, 0.0, 1e9, 0.0])
    places = np.empty((5, len(grid.coarse), CENTRES), dtype="f4")
    best = np.empty(places.shape[:2], dtype="f4")
    for begin in range(0, len(grid.coarse), 3):  # some slopes at a time
        part = correlations[:, :, begin : begin + 3].copy()
        coarse_scores(part, grid, begin, places, best)
    found = best_chirps(places, best, rows, 2, grid, worthwhile)
    for number, scores in enumerate(dense_scores(rows, dense, grid)[2:]):
        coarse = np.full(scores.shape, -1.0)
        coarse[grid.coarse] = scores[grid.coarse]
        tried = coarse
        if worthwhile[2 + number] == 0.0:
            tried = np.full(scores.shape, -1.0)
            for s in grid.coarse[coarse[grid.coarse].max(axis=1) >= close_share * coarse.max()]:
                c = int(np.argmax(coarse[s]))
                around = slice(s - 1, s + 2), slice(max(c - 2, 0), c + 3)
                tried[around] = scores[around]
        place = np.unravel_index(np.argmax(tried), tried.shape)
        assert (found[0][number], found[1][number]) == place
        assert found[2][number] == pytest.approx(tried[place], rel=1e-5)  # single precision
