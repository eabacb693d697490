"""The channel grid and its candidates against dense products."""

import numpy as np

from vsep.inference.channel import ChannelGrid
from vsep.signal.filters import RaisedCosineFilter
from vsep.signal.template import SignalModel

NUM_SAMPLES = 128
RATE = 5.1e6
MODEL = SignalModel(
    num_ramps=3,
    num_samples=NUM_SAMPLES,
    sample_rate_hz=RATE,
    anti_aliasing_filter=RaisedCosineFilter(cutoff_hz=RATE / 4, rolloff=0.25),
)
GRID = ChannelGrid(NUM_SAMPLES, MODEL.num_grid_bins)


def burst(start, slope):
    return MODEL.template(np.array([start]), np.array([slope]))[0]


def noise(seed, level):
    rng = np.random.default_rng(seed)
    values = rng.standard_normal(NUM_SAMPLES) + 1j * rng.standard_normal(NUM_SAMPLES)
    return level * values


def dense_channel(template):
    bins = np.arange(MODEL.num_grid_bins)
    turns = np.outer(np.arange(NUM_SAMPLES), bins) / MODEL.num_grid_bins
    return template[:, None] * np.exp(-2j * np.pi * turns) / np.sqrt(NUM_SAMPLES)


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
