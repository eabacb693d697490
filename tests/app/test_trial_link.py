import numpy as np
import pytest
from vsep_app.jobs.tasks import advance, prepare
from vsep_app.model.settings import LOADED_FRAME, Settings
from vsep_app.model.trial_link import open_trial, trial_link, trial_of_query

from vsep import InputError
from vsep.inference.core.progress import Termination
from vsep.separability.axes import parse_axis
from vsep.separability.map_spec import MapSpec
from vsep.separability.trial_word import trial_word
from vsep.studies.catalogue import make_study
from vsep.studies.rows import trial_of_row
from vsep.studies.study import TrialSettings
from vsep.studies.trial import failed_rows, run_trial, separate
from vsep.studies.trial_scenario import simulate_trial


def live_run(link):
    """What the live view of a link ends with."""
    trial = open_trial(link)
    settings = Settings(**trial.values)
    settings.choose_preset(LOADED_FRAME)
    prepared = prepare(settings.plan(), trial.frame)
    step = advance(prepared, prepared.initial_state)
    while step.termination is Termination.RUNNING:
        step = advance(prepared, step.state)
    return step


@pytest.mark.parametrize(
    ("study", "index", "method", "options"),
    [
        ("fig-3", 20, "factorised", {}),
        ("fig-3", 20, "joint", {}),
        ("fig-3", 20, "no-interference", {}),
        # Another filter than the one that is assumed, the paper's schedule, another seed.
        ("fig-3", 45, "factorised", {"settings": TrialSettings(seed=3, schedule="paper")}),
        ("fig-5", 5, "object-only", {}),
        ("fig-6", 0, "factorised", {"object_threshold_db": 13.3}),
        ("false-alarms", 2, "object-only", {}),
    ],
)
def test_the_live_view_ends_to_the_bit_as_the_trial_did(study, index, method, options):
    (row,) = run_trial(make_study(study, methods=(method,), **options).trial(index, 4))
    step = live_run(trial_link(row))
    trial = trial_of_row(row)
    _, solution = separate(trial, method, simulate_trial(trial))
    objects = step.state.objects
    assert step.state.iteration == row["iterations"] == solution.iterations
    assert step.termination.name.lower() == row["termination"]
    assert objects.num_components == row["num_objects"]
    for name in ("beats", "dopplers", "amplitudes", "covariance"):
        np.testing.assert_array_equal(getattr(objects, name), getattr(solution.objects, name))
    assert step.state.noise_precision == solution.state.noise_precision


def test_a_row_that_cannot_be_repeated_live_has_no_link():
    trial = make_study("fig-3", methods=("object-only",)).trial(3, 0)
    (row,) = run_trial(trial)
    assert trial_link(row) == "fig-3/3/0/object-only/1/robust"
    moved = {**row["point"], "snr_db": row["point"]["snr_db"] + 1.0}
    assert trial_link({**row, "point": moved}) == ""
    assert trial_link({**row, "method": "a rival"}) == ""
    assert trial_link({**row, "point_index": 999}) == ""
    assert trial_link(failed_rows(trial, "on purpose")[0]) == ""


@pytest.mark.parametrize(
    "link",
    [
        "fig-3",
        "fig-3/a/0/factorised/1/robust",
        "fig-3/²/0/factorised/1/robust",
        "fig-9/0/0/factorised/1/robust",
        "fig-3/999/0/factorised/1/robust",
        "fig-3/0/0/magic/1/robust",
        "fig-3/0/0/factorised/1/wild",
        "fig-3/0/99999999999/factorised/1/robust",
        "fig-3/0/0/factorised/" + "9" * 5000 + "/robust",
        "fig-3/0/0/factorised/1/robust/9..",
        "fig-3/0/0/factorised/1/robust/1000",
    ],
)
def test_a_link_that_names_no_trial_is_one_sentence(link):
    with pytest.raises(InputError):
        open_trial(link)
    trial, rest, errors = trial_of_query({"trial": link, "speed": 30})
    assert (trial, rest, len(errors)) == (None, {"speed": 30}, 1)


def test_a_query_without_a_trial_stays_as_it_is():
    query = {"preset": "simulation-2-a"}
    assert trial_of_query(query) == (None, query, [])


def test_the_trial_brings_the_loaded_frame_of_its_query():
    query = {"trial": "fig-3/20/17/factorised/1/robust", "preset": LOADED_FRAME}
    trial, rest, errors = trial_of_query(query)
    assert trial.frame.name == "fig-3, point 20, realization 17"
    assert (rest, errors) == ({}, [])


def test_the_live_view_repeats_a_cell_of_the_separability():
    maps = MapSpec(
        x=parse_axis("object_delay=-1e-7:1e-7:3"),
        y=parse_axis("filter_mismatch=-0.1:0.1:3"),
        fixed=(("num_objects", 3.0),),
    )
    trial = maps.trial((2, 2), 1)
    (row,) = run_trial(trial)
    step = live_run(trial_word(trial))
    assert step.state.objects.num_components == row["num_objects"]
    assert step.state.iteration == row["iterations"]


def test_a_row_of_a_version_whose_points_had_fewer_parameters_has_its_link():
    study = make_study("fig-3", methods=("object-only",))
    (row,) = run_trial(study.trial(6, 0))
    expected = trial_link(row)
    assert expected
    del row["point"]["filter_mismatch"]
    assert trial_link(row) == expected
