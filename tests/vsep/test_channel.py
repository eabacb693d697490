"""The channel grid and its candidates against dense products."""

import numpy as np

from tests.vsep.burst_bench import GRID, MODEL, burst, dense_channel, noise


def test_gram_and_projections_by_fft_equal_the_dense_products():
    template, other = burst(0.78, -0.0118), burst(-0.5, 0.0123)
    dense = dense_channel(template)
    residual = noise(1, 1.0)
    bins = np.arange(MODEL.num_grid_bins)
    for second in (template, other):
        lags = GRID.gram_lags(template, second)
        by_lags = lags[(bins[:, None] - bins[None, :]) % MODEL.num_grid_bins]
        expected = dense.conj().T @ dense_channel(second)
        np.testing.assert_allclose(by_lags, expected, atol=1e-13)
    np.testing.assert_allclose(
        GRID.projections(template, residual), dense.conj().T @ residual, atol=1e-12
    )
