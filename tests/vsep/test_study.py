import pickle

import numpy as np
import pytest

from vsep import InputError
from vsep.studies.study import Point, Study, TrialSettings


def point(**changes):
    return Point(
        **({"panel": "a", "scene": "simulation-1", "snr_db": 30.0, "sir_db": 0.0} | changes)
    )


def study(**changes):
    values = {
        "name": "test",
        "title": "Test",
        "points": (point(), point(sir_db=-20.0)),
        "realizations": 3,
        "methods": ("factorised", "no-interference"),
    }
    return Study(**(values | changes))


def test_a_trials_randomness_depends_on_seed_point_and_realization_only():
    first = study().trial(1, 2)
    again = study(realizations=9, methods=("object-only",), selected=(0,)).trial(1, 2)
    assert np.array_equal(
        first.seed_sequence.generate_state(8), again.seed_sequence.generate_state(8)
    )
    others = [
        study().trial(0, 2),
        study().trial(1, 1),
        study(settings=TrialSettings(seed=2)).trial(1, 2),
    ]
    for other in others:
        assert not np.array_equal(
            first.seed_sequence.generate_state(8), other.seed_sequence.generate_state(8)
        )


def test_a_trial_can_be_sent_and_looked_up():
    trial = study().trial(0, 0)
    assert pickle.loads(pickle.dumps(trial)) == trial
    assert {trial: 1}[study().trial(0, 0)] == 1


def test_a_selection_changes_what_is_run_and_not_what_a_trial_is():
    part = study(selected=(1,))
    assert part.point_indices == (1,)
    assert part.num_rows == 6
    assert study().num_rows == 12
    assert part.trial(1, 0) == study().trial(1, 0)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: point(scene="nowhere"), "scene is 'nowhere'"),
        (lambda: point(interference_model="none"), "interference_model is 'none'"),
        (lambda: point(num_interferers=3), "num_interferers is 3"),
        (lambda: point(num_second_crossings=2), "num_second_crossings is 2"),
        (lambda: point(butterworth_order=-1), "butterworth_order is -1"),
        (lambda: TrialSettings(seed=-1), "seed is -1"),
        (lambda: TrialSettings(schedule="mine"), "schedule"),
        (lambda: TrialSettings(gospa_cutoff=0.0), "cutoff is 0"),
        (lambda: TrialSettings(gospa_order=0.5), "order is 0.5"),
        (lambda: study(realizations=0), "realizations is 0"),
        (lambda: study(selected=(2,)), "point is 2"),
        (lambda: study().trial(2, 0), "point is 2"),
        (lambda: study().trial(0, -1), "realization is -1"),
    ],
)
def test_what_cannot_be_is_refused_by_name_and_value(make, message):
    with pytest.raises(InputError, match=message):
        make()
