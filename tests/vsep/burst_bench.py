"""What the tests of bursts and channels share: one small model, its grid, a burst and noise."""

import numpy as np

from vsep.inference.bursts.channel import ChannelGrid
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
    """Template (N,) of one burst."""
    return MODEL.template(np.array([start]), np.array([slope]))[0]


def noise(seed, level):
    """Complex noise (N,), standard deviation `level` in each part."""
    rng = np.random.default_rng(seed)
    values = rng.standard_normal(NUM_SAMPLES) + 1j * rng.standard_normal(NUM_SAMPLES)
    return level * values


def dense_channel(template):
    """(N, K) all columns of U Psi."""
    bins = np.arange(MODEL.num_grid_bins)
    turns = np.outer(np.arange(NUM_SAMPLES), bins) / MODEL.num_grid_bins
    return template[:, None] * np.exp(-2j * np.pi * turns) / np.sqrt(NUM_SAMPLES)
