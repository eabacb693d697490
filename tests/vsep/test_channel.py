"""The channel grid and its candidates against dense products."""

import numpy as np

from tests.vsep.burst_bench import GRID, MODEL, burst, dense_channel, noise


def test_gram_and_projections_by_fft_equal_the_dense_products():
    template = burst(0.78, -0.0118)
    dense = dense_channel(template)
    residual = noise(1, 1.0)
    lags = GRID.gram_lags(template)
    bins = np.arange(MODEL.num_grid_bins)
    by_lags = lags[(bins[:, None] - bins[None, :]) % MODEL.num_grid_bins]
    np.testing.assert_allclose(by_lags, dense.conj().T @ dense, atol=1e-13)
    np.testing.assert_allclose(
        GRID.projections(template, residual), dense.conj().T @ residual, atol=1e-12
    )
