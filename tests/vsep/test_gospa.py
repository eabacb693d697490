import itertools

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vsep import InputError
from vsep.analysis.gospa import cell_distances, gospa

ROUNDING = 1e-12  # a few additions and one power of numbers of order one


def gospa_by_enumeration(distances, cutoff, order):
    """The definition: the cheapest of all partial assignments."""
    num_true, num_found = distances.shape
    best = np.inf
    for size in range(min(num_true, num_found) + 1):
        for rows in itertools.combinations(range(num_true), size):
            for columns in itertools.permutations(range(num_found), size):
                cost = np.sum(distances[list(rows), list(columns)] ** order)
                cost += 0.5 * cutoff**order * (num_true + num_found - 2 * size)
                best = min(best, cost)
    return best ** (1.0 / order)


@given(
    seed=st.integers(0, 10_000),
    num_true=st.integers(0, 4),
    num_found=st.integers(0, 4),
    cutoff=st.sampled_from([0.3, 1.0, 2.0]),
    order=st.sampled_from([1.0, 2.0]),
)
def test_the_assignment_is_the_cheapest_of_all(seed, num_true, num_found, cutoff, order):
    distances = np.random.default_rng(seed).uniform(0.0, 2.0, (num_true, num_found))
    result = gospa(distances, cutoff=cutoff, order=order)
    expected = gospa_by_enumeration(distances, cutoff, order)
    assert result.value == pytest.approx(expected, rel=ROUNDING, abs=ROUNDING)
    parts = result.localisation + result.missed + result.false
    assert parts ** (1.0 / order) == pytest.approx(expected, rel=ROUNDING, abs=ROUNDING)


def test_no_pair_is_assigned_at_or_beyond_the_cutoff():
    result = gospa(np.array([[1.0, 3.0], [3.0, 0.25]]))
    assert (result.num_missed, result.num_false) == (1, 1)
    assert result.true_indices.tolist() == [1]
    assert result.found_indices.tolist() == [1]
    assert result.distances.tolist() == [0.25]


def test_it_is_a_metric_between_random_sets():
    rng = np.random.default_rng(3)
    shape = (8, 32)
    for _ in range(200):
        first, second, third = (
            rng.uniform(-0.5, 0.5, (rng.integers(0, 5), 2)) * [0.3, 0.5] for _ in range(3)
        )
        there = gospa(cell_distances(first, second, shape), cutoff=4.0).value
        back = gospa(cell_distances(second, first, shape), cutoff=4.0).value
        detour = gospa(cell_distances(first, third, shape), cutoff=4.0).value
        detour += gospa(cell_distances(third, second, shape), cutoff=4.0).value
        assert there == pytest.approx(back, abs=ROUNDING)
        assert there <= detour + ROUNDING


def test_distances_go_around_the_circle_in_both_dimensions():
    true, found = np.array([[0.499, -0.499]]), np.array([[-0.499, 0.499]])
    distance = cell_distances(true, found, (16, 128))
    assert distance[0, 0] == pytest.approx(0.002 * np.hypot(128, 16), rel=1e-9)


@pytest.mark.parametrize(("cutoff", "order"), [(0.0, 1.0), (np.nan, 1.0), (1.0, 0.5)])
def test_a_senseless_cutoff_or_order_is_refused(cutoff, order):
    with pytest.raises(InputError, match="GOSPA"):
        gospa(np.zeros((1, 1)), cutoff=cutoff, order=order)


@pytest.mark.parametrize("bad", [-1.0, np.nan])
def test_a_senseless_distance_is_refused(bad):
    with pytest.raises(InputError, match="distance"):
        gospa(np.array([[bad]]))
