"""Burst search against known bursts and pure noise."""

from dataclasses import replace

import numpy as np
import pytest

from tests.vsep.burst_bench import GRID, MODEL, NUM_SAMPLES, RATE, burst, noise
from vsep.inference.bursts.chirp_refinement import ChannelCosts, place_chirps, refine_chirps
from vsep.inference.bursts.chirp_search import find_single_chirps, slope_bank
from vsep.inference.bursts.search import BurstSearch
from vsep.inference.factorised import FactorisedSeparator
from vsep.kernels.ramps import FlatRamps
from vsep.signal.filters import RaisedCosineFilter
from vsep.signal.template import SignalModel


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
    start = place_chirps(found.start_frequency[1:2], found.slope[1:2], MODEL)
    zero = np.zeros(1)
    none, ends = zero.astype(int), np.array([0, 1])
    columns = FlatRamps(start.templates, ends, none, none, zero, ends, GRID.twiddle)
    cost = ChannelCosts(
        ramps=columns, moving=none, shared=none, residual=residual[1:2], noise_precision=0.5e8
    )
    refined = refine_chirps(start, MODEL, cost, max_steps=20)
    # Noise 80 dB below the burst: deviations of the parameters are below 1e-6 of their values.
    assert -refined.start_frequency[0] / refined.slope[0] == pytest.approx(centre, abs=1e-3)
    assert refined.slope[0] == pytest.approx(slope, rel=1e-4)


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


@pytest.mark.parametrize("share", [1.03, 1.37, 1.71, 1.93])  # of the ramp
def test_a_burst_longer_than_a_long_ramp_is_found(share):
    model = SignalModel(
        num_ramps=1,
        num_samples=512,
        sample_rate_hz=RATE,
        anti_aliasing_filter=MODEL.anti_aliasing_filter,
    )
    slope = 2.0 * model.normalised_cutoff / (share * model.num_samples)
    for centre in (-40.0, 101.3, 256.5, 480.7):
        template = model.template(np.array([-slope * centre]), np.array([slope]))
        found = find_single_chirps(template, model)
        # A quarter of a half-turn at the ends of what is seen costs 5 %, half a sample 19 %.
        assert found.score[0] > 0.77 * np.sum(np.abs(template) ** 2)


def test_bank_is_made_once_for_equal_models():
    again = SignalModel(
        num_ramps=3,
        num_samples=NUM_SAMPLES,
        sample_rate_hz=RATE,
        anti_aliasing_filter=RaisedCosineFilter(cutoff_hz=RATE / 4, rolloff=0.25),
    )
    assert slope_bank(again) is slope_bank(MODEL)


def test_antennas_are_searched_together():
    rng = np.random.default_rng(3)
    start, slope = 0.6, -0.01
    burst = MODEL.template(np.array([start]), np.array([slope]))[0]
    shape = (4, 2, MODEL.num_samples)
    noise = rng.standard_normal((2, *shape)) * np.sqrt(0.5)
    rows = noise[0] + 1j * noise[1]
    # 9 dB at each antenna is lost in noise, whose best chirp has 10; 15 dB at all four is not.
    level = np.sqrt(10**0.9 / np.sum(np.abs(burst) ** 2))
    rows[:, 1] += level * np.exp(2j * np.pi * rng.random((4, 1))) * burst
    found = find_single_chirps(rows, MODEL)
    assert -found.start_frequency[1] / found.slope[1] == pytest.approx(start / -slope, abs=4.0)
    assert found.slope[1] == pytest.approx(slope, rel=0.15)
    alone = [find_single_chirps(rows[a], MODEL) for a in range(4)]
    best = np.sum([each.score for each in alone], axis=0)
    assert np.all(found.score <= best * (1 + 1e-5))  # each antenna alone takes its own best place
    assert found.score[1] > max(each.score[1] for each in alone)
    # One antenna of a list is one antenna.
    single = find_single_chirps(rows[:1], MODEL)
    np.testing.assert_allclose(single.score, alone[0].score, rtol=1e-4)  # single precision
    np.testing.assert_array_equal(single.tone_score, alone[0].tone_score)


def test_next_to_a_known_slope_the_same_burst_is_found():
    centre, slope = 40.7, -0.011065
    residual = 3.0 * burst(-slope * centre, slope)[None] + noise(1, 1e-2)
    everywhere = find_single_chirps(residual, MODEL)
    nearby = find_single_chirps(residual, MODEL, known_slopes=np.array([0.03, 1.02 * slope]))
    assert nearby.slope == everywhere.slope
    assert nearby.start_frequency == everywhere.start_frequency
    assert nearby.score == everywhere.score


def test_a_burst_of_an_unknown_slope_begins_as_well():
    chirps = [(60.3, 0.00646), (40.7, -0.03)]
    residual = np.concatenate([3.0 * burst(-k * centre, k)[None] for centre, k in chirps])
    residual = residual + noise(2, 1e-2)
    separator = FactorisedSeparator(model=replace(MODEL, num_ramps=2))
    work = separator.interference_workspace(separator.init(residual))
    work.known_slopes = np.array([0.00646])
    BurstSearch(work, residual, 1e2, weakest_share=1e-3).run()
    slopes = work.table.chirps.slope[np.argsort(work.table.rows)]
    np.testing.assert_allclose(slopes, [slope for _, slope in chirps], rtol=1e-2)
