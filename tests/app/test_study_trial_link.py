import pytest

from app.settings import LOADED_FRAME, Settings
from app.studies.trial_link import open_trial, trial_link, trial_of_query
from app.work import advance, prepare
from vsep import InputError
from vsep.inference.state import Termination
from vsep.studies.catalogue import make_study
from vsep.studies.trial import run_trial


@pytest.mark.parametrize(
    ("study", "index", "method"),
    [
        ("fig-3", 20, "factorised"),
        ("fig-3", 20, "no-interference"),
        ("fig-5", 5, "object-only"),
        ("false-alarms", 2, "object-only"),
    ],
)
def test_the_live_view_does_what_the_trial_did(study, index, method):
    (row,) = run_trial(make_study(study, methods=(method,)).trial(index, 4))
    trial = open_trial(trial_link(row))
    settings = Settings(**trial.values)
    settings.choose_preset(LOADED_FRAME)
    prepared = prepare(settings.plan(), trial.frame)
    step = advance(prepared, prepared.initial_state)
    while step.termination is Termination.RUNNING:
        step = advance(prepared, step.state)
    assert step.state.iteration == row["iterations"]
    assert step.state.objects.num_components == row["num_objects"]
    assert step.termination.name.lower() == row["termination"]


@pytest.mark.parametrize(
    "link",
    [
        "fig-3",
        "fig-3/a/0/factorised/1/robust",
        "fig-9/0/0/factorised/1/robust",
        "fig-3/999/0/factorised/1/robust",
        "fig-3/0/0/magic/1/robust",
        "fig-3/0/0/factorised/1/wild",
        "fig-3/0/99999999999/factorised/1/robust",
    ],
)
def test_a_link_that_names_no_trial_is_one_sentence(link):
    with pytest.raises(InputError):
        open_trial(link)
    trial, rest, complaints = trial_of_query({"trial": link, "speed": 30})
    assert (trial, rest, len(complaints)) == (None, {"speed": 30}, 1)


def test_a_query_without_a_trial_stays_as_it_is():
    query = {"preset": "simulation-2-a"}
    assert trial_of_query(query) == (None, query, [])


def test_the_trial_brings_the_loaded_frame_of_its_query():
    query = {"trial": "fig-3/20/17/factorised/1/robust", "preset": LOADED_FRAME}
    trial, rest, complaints = trial_of_query(query)
    assert trial.frame.name == "fig-3, point 20, realization 17"
    assert (rest, complaints) == ({}, [])
