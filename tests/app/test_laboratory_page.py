import asyncio
import csv
from concurrent.futures import ThreadPoolExecutor

import pytest

from app.laboratory import session as laboratory_session
from app.laboratory.address import read_question, write_question
from app.laboratory.form import LaboratoryForm
from app.laboratory.page import LaboratoryPage, progress_text
from app.laboratory.session import Progress, Snapshot
from app.studies.trial_link import open_trial
from app.visit import Visit
from vsep.laboratory import cells
from vsep.laboratory.axes import AXES
from vsep.studies.trial import run_trial

QUERY = {"x": "sir_db=-40:0:3", "y": "snr_db=20:60:3", "method": "object-only", "trials": "1"}


@pytest.fixture
def told(monkeypatch):
    """Sentences that the user was told."""
    sentences = []
    monkeypatch.setattr(LaboratoryPage, "complain", lambda _, sentence: sentences.append(sentence))
    return sentences


@pytest.fixture(autouse=True)
def quick_engine(monkeypatch):
    """Trials in this process, at once."""
    monkeypatch.setattr(
        cells, "run_on_processes", lambda trials, **_: (run_trial(trial) for trial in trials)
    )
    monkeypatch.setattr(laboratory_session, "SETTLE_S", 0.01)
    laboratory_session.shared_answers.cache_clear()


@pytest.fixture
def pool():
    """The workers of all sessions."""
    with ThreadPoolExecutor(max_workers=1) as workers:
        yield workers


def new_page(pool, query):
    return LaboratoryPage(
        Visit(pool=pool, query=query, post=lambda function: function(), watched=lambda: True)
    )


async def until(condition):
    for _ in range(1000):
        if condition():
            return
        await asyncio.sleep(0.02)
    pytest.fail("waited in vain")


def test_the_map_is_drawn_and_its_trials_fill_it(pool, told):
    page = new_page(pool, QUERY)

    async def visit():
        page.start()
        await until(lambda: page.atlas is not None and page.atlas.finished.all())
        page.close()

    asyncio.run(visit())
    assert told == []
    assert page.view.source.data["trials"][0].tolist() == [[1.0] * 3] * 3
    rows = list(csv.DictReader(page._table()))
    assert len(rows) == 9
    assert page._document().read().startswith("<!DOCTYPE html>")


def test_a_control_asks_another_question_and_the_first_map_goes(pool, told):
    page = new_page(pool, {**QUERY, "trials": "0"})

    async def visit():
        page.start()
        await until(lambda: page.atlas is not None)
        page.layer.value = "coherence"
        page.form.scene.value = "simulation-2-a"
        await until(lambda: page.atlas.question.scene == "simulation-2-a")
        page.close()

    asyncio.run(visit())
    assert told == []
    assert page.view.figure.title.text == "coherence of the bases"
    assert page.form.values["interfered_share"].visible
    assert not page.form.values["object_delay_s"].visible


def test_a_question_without_sense_is_told_and_nothing_changes(pool, told):
    page = new_page(pool, QUERY)
    before = page.question
    page.form.axes["x"].stop.value = "-50"
    page.form.axes["x"].stop.value = "loud"
    assert told == [
        "sir_db goes from -40 to -50; the first must be smaller.",
        "To is 'loud'; it must be a number, of SIR [dB].",
    ]
    assert page.question == before


def test_a_link_of_nonsense_is_told_and_the_usual_map_shown(pool, told):
    page = new_page(pool, {"x": "noise=0:1:2", "layer": "beauty"})

    async def visit():
        page.start()
        page.close()

    asyncio.run(visit())
    assert told[0].startswith("layer is 'beauty'")
    assert told[1].startswith("The parameter is 'noise'")
    assert page.question == read_question({})[0]


def test_the_address_brings_the_question_back_and_keeps_what_is_not_its_own():
    query = {**QUERY, "set": "num_objects=3,filter_mismatch=0.1", "layer": "detection"}
    question, layer, complaints = read_question(query)
    assert complaints == []
    assert dict(question.fixed) == {"num_objects": 3.0, "filter_mismatch": 0.1}
    address = write_question(question, layer, {"snr": "12", "x": "old"})
    from urllib.parse import parse_qsl

    again = dict(parse_qsl(address[1:]))
    assert again["snr"] == "12"
    assert read_question(again) == (question, "detection", [])


@pytest.mark.parametrize(
    "query",
    [
        {},
        QUERY,
        {**QUERY, "set": "num_objects=3,slope_difference_hz_per_s=-4e11"},
        {**QUERY, "scene": "simulation-2-c", "x": "num_objects=1:20:20", "set": "sir_db=-10"},
        {"scene": "simulation-2-b", "x": "interfered_share=0.0625:1:16", "y": "sir_db=0:1:9"},
    ],
)
def test_the_form_asks_what_it_was_made_from(query):
    question = read_question(query)[0]
    assert LaboratoryForm(question, lambda: None).question() == question


@pytest.mark.parametrize("name", list(AXES))
def test_every_parameter_can_stand_on_an_axis(name):
    asked = []
    form = LaboratoryForm(read_question({"scene": "simulation-2-a"})[0], lambda: asked.append(1))
    place = "x" if name != "sir_db" else "y"
    form.axes[place].parameter.value = name
    question = form.question()
    assert getattr(question, place).name == name
    assert asked or name in ("sir_db", "slope_difference_hz_per_s")


def test_a_cell_opens_in_the_live_view(pool):
    page = new_page(pool, {**QUERY, "set": "filter_mismatch=0.2", "method": "factorised"})
    from vsep.laboratory.words import word_parts

    start, columns, rows = word_parts(page.question)
    opened = open_trial(f"{start}{columns[2]},{rows[1]}")
    assert opened.values["estimator"] == "factorised"
    # The estimator of the view assumes what that of the trial did.
    assert opened.frame.assumed_filter.cutoff_hz == pytest.approx(1.2 * 2.55e6)
    (row,) = run_trial(page.question.trial((2, 1)))
    assert row["num_objects"] >= 1
    page.close()


def test_progress_is_one_line():
    question = read_question(QUERY)[0]
    snapshot = Snapshot(question=question, findings={}, progress=Progress.WAITING)
    assert progress_text(snapshot) == "0 of 9 cells · waiting"
    idle = Snapshot(question=read_question({"trials": "0"})[0], findings={}, progress=Progress.IDLE)
    assert progress_text(idle) == "no trials asked for"
