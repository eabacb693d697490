from types import SimpleNamespace

import numpy as np
import pytest
from vsep_app.jobs.tasks import compose
from vsep_app.model.score import score_of


@pytest.fixture
def score(small_radar):
    """Return the score of estimates, in cells of 1/N and 1/P, against true objects."""
    num_ramps, num_samples = small_radar.shape

    def judge(true, found):
        lines = [np.array(each, dtype=float).reshape(-1, 2) for each in (true, found)]
        truth, objects = (
            SimpleNamespace(beats=each[:, 0] / num_samples, dopplers=each[:, 1] / num_ramps)
            for each in lines
        )
        observation = SimpleNamespace(truth=truth)
        return score_of(SimpleNamespace(radar=small_radar, observation=observation), objects)

    return judge


def test_an_estimate_within_a_cell_is_found_and_one_beyond_is_false(score):
    near, far = score([(3, 0)], [(3.9, 0)]), score([(3, 0)], [(4.1, 0)])
    assert (near.num_found, near.num_false, near.missed.tolist()) == (1, 0, [])
    assert (far.num_found, far.num_false, far.missed.tolist()) == (0, 1, [0])
    assert far.nearest.tolist() == [0]
    assert near.text == "1 of 1 found, 0 false"


def test_the_velocity_counts_and_wraps(score, small_radar):
    half = small_radar.num_ramps / 2
    assert score([(3, 0)], [(3, 1.5)]).num_found == 0
    assert score([(3, -half)], [(3, half)]).num_found == 1


def test_each_object_has_at_most_one_estimate(score):
    both = score([(3, 0)], [(3, 0.1), (3, 0.2)])
    assert both.partners == {0: 0}
    assert both.found.tolist() == [True, False]


def test_without_an_estimate_a_miss_has_no_nearest_one(score):
    assert score([(3, 0)], []).nearest.tolist() == [-1]


def test_nothing_is_judged_where_the_objects_are_not_known(score):
    assert score([], [(3, 0)]) is None


def test_the_run_of_table_i_ends_with_all_objects_and_no_false_one(many_ramps):
    picture = compose(many_ramps.snapshot(), 0, "level")
    assert picture.score.text == "10 of 10 found, 0 false"
