"""Bursts at expected places: the size of what is searched, and thresholds, against noise."""

import numpy as np
import pytest

from tests.vsep.timing_scenes import MODEL, RADAR
from vsep.errors import InputError
from vsep.inference.bursts.chirp_search import find_single_chirps
from vsep.inference.bursts.expected_bursts import (
    ExpectedBursts,
    expected_scores,
    expected_threshold,
    searched_volume,
)

SLOPE = -19e12 / RADAR.sample_rate_hz**2


def noise(shape, seed):
    draws = np.random.default_rng(seed).standard_normal((2, *shape))
    return (draws[0] + 1j * draws[1]) / np.sqrt(2.0)


def expected(reach=1.0):
    return ExpectedBursts(
        ramps=np.array([0, 2]),
        centres=np.array([100.3, 40.0]),
        slopes=np.full(2, SLOPE),
        reach=reach,
    )


def test_scores_are_those_of_the_definition():
    bursts, rows = expected(), noise((3, 2, 256), 1)
    starts, slopes = bursts.candidates()
    scores = expected_scores(rows, starts, slopes, MODEL)
    template = MODEL.template(starts[1, 2:3], slopes[1, 2:3])[0]
    powers = [abs(np.vdot(template, row)) ** 2 for row in rows[:, 1]]
    assert scores[1, 2] == pytest.approx(sum(powers) / np.vdot(template, template).real)
    alone = [expected_scores(each, starts, slopes, MODEL) for each in rows]
    np.testing.assert_allclose(scores, np.sum(alone, axis=0))


def test_a_burst_at_its_place_scores_its_energy():
    bursts = expected()
    signal = MODEL.template(-SLOPE * np.array([100.8]), np.array([SLOPE]))
    scores = expected_scores(np.repeat(signal, 2, axis=0), *bursts.candidates(), MODEL)
    # Half a sample off the expected centre is a place that is tried.
    assert scores[0].max() == pytest.approx(np.vdot(signal, signal).real, rel=1e-12)


def test_a_burst_beyond_the_ramp_scores_nothing():
    outside = ExpectedBursts(
        ramps=np.zeros(1, dtype=int), centres=np.array([-60.0]), slopes=np.array([SLOPE]), reach=1.0
    )
    assert not expected_scores(noise((1, 256), 2), *outside.candidates(), MODEL).any()


def test_noise_exceeds_the_search_as_often_as_its_volume_says():
    # At a level that noise reaches often enough to count: V T / pi exp(-T) = 0.27 at T = 12.
    level, count = 12.0, 300
    scores = find_single_chirps(noise((count, 256), 3), MODEL).score
    rate = searched_volume(MODEL) * level / np.pi * np.exp(-level)
    share = 1.0 - np.exp(-rate)
    # Five deviations of the count, and a tenth for maxima that lie between points of the grid.
    margin = 5.0 * np.sqrt(share * (1.0 - share) / count) + 0.1 * share
    assert abs(np.mean(scores > level) - share) < margin


@pytest.mark.parametrize("reach", [1.0, 3.0])
def test_noise_exceeds_the_threshold_of_a_place_as_often_as_allowed(reach):
    # Taken at a low threshold of the search, so that a few thousand rows have enough of it.
    rows, search_level = 3000, 15.0
    threshold = expected_threshold(MODEL, search_level, reach)
    places = ExpectedBursts(
        ramps=np.zeros(rows, dtype=int),
        centres=np.full(rows, 120.0),
        slopes=np.full(rows, SLOPE),
        reach=reach,
    )
    scores = expected_scores(noise((rows, 256), 4), *places.candidates(), MODEL).max(axis=1)
    allowed = searched_volume(MODEL) * search_level / np.pi * np.exp(-search_level)
    assert 2.0 < threshold < search_level
    # Maxima of a field above a low level are counted more than once in the formula: it is a bound.
    deviation = np.sqrt(allowed / rows)
    assert np.mean(scores > threshold) < allowed + 5.0 * deviation
    assert np.mean(scores > threshold) > 0.5 * allowed - 5.0 * deviation


def test_a_modelled_burst_takes_its_place_only():
    bursts = expected()
    assert bursts.near(0, 101.0, 1.05 * SLOPE, MODEL)
    assert not bursts.near(0, 101.0, -SLOPE, MODEL)
    assert not bursts.near(1, 101.0, SLOPE, MODEL)
    assert bursts.free(0, np.zeros(0), MODEL).tolist() == [True, False]
    assert bursts.free(0, np.array([98.0]), MODEL).tolist() == [False, False]
    assert bursts.free(2, np.array([98.0]), MODEL).tolist() == [False, True]


def test_lists_that_do_not_fit_are_refused():
    with pytest.raises(InputError, match="of one length"):
        ExpectedBursts(ramps=np.zeros(2), centres=np.zeros(1), slopes=np.ones(2), reach=1.0)
    with pytest.raises(InputError, match="reach is -1 samples"):
        expected(reach=-1.0)
    with pytest.raises(InputError, match="slope"):
        ExpectedBursts(ramps=np.zeros(1), centres=np.zeros(1), slopes=np.zeros(1), reach=1.0)
