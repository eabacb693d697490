"""Burst search and refinement of (71) against dense formulas and known bursts."""

import numpy as np
import pytest

from vsep.inference.chirps import (
    ChannelGrid,
    channel_posterior,
    chirp_cost,
    chirp_cost_slopes,
    find_single_chirps,
    refine_chirp,
    slope_bank,
)
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
BINS = np.array([0, 1, 7])


def burst(start, slope):
    return MODEL.template(np.array([start]), np.array([slope]))[0]


def dense_channel(template):
    bins = np.arange(MODEL.num_grid_bins)
    turns = np.outer(np.arange(NUM_SAMPLES), bins) / MODEL.num_grid_bins
    return template[:, None] * np.exp(-2j * np.pi * turns) / np.sqrt(NUM_SAMPLES)


def noise(seed, level):
    rng = np.random.default_rng(seed)
    values = rng.standard_normal(NUM_SAMPLES) + 1j * rng.standard_normal(NUM_SAMPLES)
    return level * values


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


def test_cost_is_the_dense_expression_71_up_to_the_weights_it_names():
    template, precisions, noise_precision = burst(0.78, -0.0118), np.array([0.2, 0.5, 1.0]), 30.0
    residual = template * 2.0 + noise(2, 0.1)
    active = channel_posterior(GRID, template, residual, BINS, precisions, noise_precision)
    atoms = dense_channel(template)[:, BINS]
    covariance = np.linalg.inv(noise_precision * atoms.conj().T @ atoms + np.diag(precisions))
    projected = atoms.conj().T @ residual
    fit = noise_precision**2 * (projected.conj() @ covariance @ projected).real
    expected = np.linalg.slogdet(covariance)[1] + fit
    assert chirp_cost(active) == pytest.approx(expected, rel=1e-11)


def test_gradient_equals_finite_differences():
    start, slope, reference = 0.781, -0.01175, 66.0
    precisions, noise_precision = np.array([0.2, 0.5, 1.0]), 30.0
    residual = burst(0.78, -0.0118) * (2.0 + 0.4j) + noise(3, 0.1)

    def cost(frequency_step, slope_step):
        template = burst(start + frequency_step - slope_step * reference, slope + slope_step)
        return chirp_cost(
            channel_posterior(GRID, template, residual, BINS, precisions, noise_precision)
        )

    template, derivatives = MODEL.template_jet(start, slope, reference)
    active = channel_posterior(GRID, template, residual, BINS, precisions, noise_precision)
    gradient, curvature = chirp_cost_slopes(
        template, derivatives, GRID.atoms(BINS), active, residual
    )
    steps = (1e-6, 1e-8)
    differences = [
        (cost(steps[0], 0.0) - cost(-steps[0], 0.0)) / (2 * steps[0]),
        (cost(0.0, steps[1]) - cost(0.0, -steps[1])) / (2 * steps[1]),
    ]
    # Rounding of a cost near 1e4 over the step and the third derivative both stay below 1e-5.
    np.testing.assert_allclose(gradient, differences, rtol=1e-4)
    assert np.all(np.linalg.eigvalsh(curvature) > 0)


@pytest.mark.parametrize(
    ("centre", "slope"),
    [(60.3, 0.00646), (40.7, -0.011065), (95.2, 0.023357), (10.4, -0.05), (118.0, 0.03)],
)
def test_search_and_refinement_find_a_burst_exactly(centre, slope):
    residual = np.zeros((3, NUM_SAMPLES), dtype=complex)
    residual[1] = (3.0 - 1j) * burst(-slope * centre, slope)
    residual += noise(4, 1e-4)
    found = find_single_chirps(residual, MODEL)
    length = 2 * MODEL.normalised_cutoff / abs(found.slope[1])
    assert abs(-found.start_frequency[1] / found.slope[1] - centre) < 0.1 * length
    assert abs(found.slope[1] / slope - 1) < 0.15
    bins = np.zeros(1, dtype=np.int64)
    refined = refine_chirp(
        (found.start_frequency[1], found.slope[1]),
        MODEL,
        GRID,
        residual[1],
        bins,
        np.zeros(1),
        0.5e8,
        max_steps=20,
    )
    # Noise 80 dB below the burst: deviations of the parameters are below 1e-6 of their values.
    assert -refined[0] / refined[1] == pytest.approx(centre, abs=1e-3)
    assert refined[1] == pytest.approx(slope, rel=1e-4)


def test_best_chirp_in_pure_noise_scores_about_ten_db():
    rng = np.random.default_rng(6)
    shape = (60, NUM_SAMPLES)
    frame = (rng.standard_normal(shape) + 1j * rng.standard_normal(shape)) / np.sqrt(2)
    model = SignalModel(
        num_ramps=60,
        num_samples=NUM_SAMPLES,
        sample_rate_hz=RATE,
        anti_aliasing_filter=MODEL.anti_aliasing_filter,
    )
    level_db = 10 * np.log10(find_single_chirps(frame, model).score)
    # The largest of about 5000 half-independent exponentials: ln 5000 = 8.5, i.e. 9.3 dB.
    assert 8.5 < np.median(level_db) < 10.5
    assert level_db.max() < 13.0


def test_refinement_never_lowers_the_cost():
    rng = np.random.default_rng(9)
    residual = burst(0.78, -0.0118) + noise(5, 0.3)
    precisions, noise_precision = np.full(3, 0.5), 5.0
    for _ in range(20):
        start = rng.uniform(0.5, 1.0)
        slope = -start / rng.uniform(20.0, 110.0)
        before = channel_posterior(
            GRID, burst(start, slope), residual, BINS, precisions, noise_precision
        )
        moved = refine_chirp(
            (start, slope), MODEL, GRID, residual, BINS, precisions, noise_precision
        )
        after = channel_posterior(GRID, burst(*moved), residual, BINS, precisions, noise_precision)
        assert chirp_cost(after) >= chirp_cost(before)


def test_bank_is_made_once_for_equal_models():
    again = SignalModel(
        num_ramps=3,
        num_samples=NUM_SAMPLES,
        sample_rate_hz=RATE,
        anti_aliasing_filter=RaisedCosineFilter(cutoff_hz=RATE / 4, rolloff=0.25),
    )
    assert slope_bank(again) is slope_bank(MODEL)
