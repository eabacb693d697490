"""The channel grid and its candidates against dense products."""

import numpy as np

from tests.vsep.burst_bench import GRID, MODEL, burst, dense_channel, noise


def test_products_by_fft_equal_the_dense_products():
    templates = np.stack([burst(0.78, -0.0118), burst(-0.5, 0.0123)])
    dense = [dense_channel(template) for template in templates]
    residual = noise(1, 1.0)
    products = GRID.products(templates, residual)
    bins = np.arange(MODEL.num_grid_bins)
    differences = (bins[:, None] - bins[None, :]) % MODEL.num_grid_bins
    for i in range(2):
        for j in range(2):
            expected = dense[i].conj().T @ dense[j]
            np.testing.assert_allclose(products[i, j][differences], expected, atol=1e-13)
        projections = dense[i].conj().T @ residual
        np.testing.assert_allclose(products[i, 2], projections, atol=1e-12)
