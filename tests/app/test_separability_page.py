import asyncio
import csv

import pytest
from vsep_app.model.trial_link import open_trial
from vsep_app.pages.base import PageContext
from vsep_app.pages.separability import session as separability_session
from vsep_app.pages.separability.form import SeparabilityForm
from vsep_app.pages.separability.page import SeparabilityPage, progress_text
from vsep_app.pages.separability.session import Progress, Snapshot
from vsep_app.pages.separability.url import read_map_spec, write_map_spec

from tests.app.conftest import until
from vsep.separability import cells
from vsep.separability.axes import AXES
from vsep.studies.trial import run_trial

QUERY = {"x": "sir_db=-40:0:3", "y": "snr_db=20:60:3", "method": "object-only", "trials": "1"}


@pytest.fixture
def told(monkeypatch):
    """Sentences that the user was told."""
    sentences = []
    monkeypatch.setattr(
        SeparabilityPage, "notify_error", lambda _, sentence: sentences.append(sentence)
    )
    return sentences


@pytest.fixture(autouse=True)
def quick_engine(monkeypatch):
    """Trials in this process, at once."""
    monkeypatch.setattr(
        cells, "run_on_processes", lambda trials, **_: (run_trial(trial) for trial in trials)
    )
    monkeypatch.setattr(separability_session, "SETTLE_S", 0.01)
    separability_session.shared_map_cache.cache_clear()


def new_page(pool, query):
    return SeparabilityPage(
        PageContext(pool=pool, query=query, post=lambda function: function(), watched=lambda: True)
    )


def test_the_map_is_drawn_and_its_trials_fill_it(pool, told):
    page = new_page(pool, QUERY)

    async def context():
        page.start()
        await until(lambda: page.separability_map is not None)
        # No trial begins unasked.
        assert page.session.snapshot().progress is Progress.IDLE
        assert not page.separability_map.finished.any()
        page._run()
        await until(lambda: bool(page.separability_map.finished.all()))
        page.close()

    asyncio.run(context())
    assert told == []
    assert page.view.figure.renderers[0].data_source.data["trials"][0].tolist() == [[1.0] * 3] * 3
    rows = list(csv.DictReader(page._table()))
    assert len(rows) == 9
    assert page._document().read().startswith("<!DOCTYPE html>")


def test_a_control_asks_another_spec_and_the_first_map_goes(pool, told):
    page = new_page(pool, {**QUERY, "trials": "0"})

    async def context():
        page.start()
        await until(lambda: page.separability_map is not None)
        page.layer.value = "coherence"
        page.form.scene.value = "simulation-2-a"
        await until(lambda: page.separability_map.spec.scene == "simulation-2-a")
        page.close()

    asyncio.run(context())
    assert told == []
    assert page.view.figure.title.text == "coherence of the bases"
    assert page.form.values["interfered_share"].visible
    assert not page.form.values["object_delay_s"].visible


def test_a_spec_without_sense_is_told_and_nothing_changes(pool, told):
    page = new_page(pool, QUERY)
    before = page.spec
    page.form.axes["x"].stop.value = "-50"
    page.form.axes["x"].stop.value = "loud"
    assert told == [
        "sir_db goes from -40 to -50; the first must be smaller.",
        "To is 'loud'; it must be a number, of SIR [dB].",
    ]
    assert page.spec == before


def test_a_link_of_nonsense_is_told_and_the_usual_map_shown(pool, told):
    page = new_page(pool, {"x": "noise=0:1:2", "layer": "beauty"})

    async def context():
        page.start()
        page.close()

    asyncio.run(context())
    assert told[0].startswith("layer is 'beauty'")
    assert told[1].startswith("The parameter is 'noise'")
    assert page.spec == read_map_spec({})[0]


def test_the_address_brings_the_spec_back_and_keeps_what_is_not_its_own():
    query = {**QUERY, "set": "num_objects=3,filter_mismatch=0.1", "layer": "detection"}
    spec, layer, errors = read_map_spec(query)
    assert errors == []
    assert dict(spec.fixed) == {"num_objects": 3.0, "filter_mismatch": 0.1}
    address = write_map_spec(spec, layer, {"snr": "12", "x": "old"})
    from urllib.parse import parse_qsl

    again = dict(parse_qsl(address[1:]))
    assert again["snr"] == "12"
    assert read_map_spec(again) == (spec, "detection", [])


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
    spec = read_map_spec(query)[0]
    assert SeparabilityForm(spec, lambda: None).spec() == spec


@pytest.mark.parametrize("name", list(AXES))
def test_every_parameter_can_stand_on_an_axis(name):
    asked = []
    form = SeparabilityForm(read_map_spec({"scene": "simulation-2-a"})[0], lambda: asked.append(1))
    place = "x" if name != "sir_db" else "y"
    form.axes[place].parameter.value = name
    spec = form.spec()
    assert getattr(spec, place).name == name
    assert asked or name in ("sir_db", "slope_difference_hz_per_s")


def test_a_cell_opens_in_the_live_view(pool):
    page = new_page(pool, {**QUERY, "set": "filter_mismatch=0.2", "method": "factorised"})
    from vsep.separability.trial_word import word_parts

    start, columns, rows = word_parts(page.spec)
    opened = open_trial(f"{start}{columns[2]},{rows[1]}")
    assert opened.values["estimator"] == "factorised"
    # The estimator of the view assumes what that of the trial did.
    assert opened.frame.assumed_filter.cutoff_hz == pytest.approx(1.2 * 2.55e6)
    (row,) = run_trial(page.spec.trial((2, 1)))
    assert row["num_objects"] >= 1
    page.close()


def test_progress_is_one_line():
    spec = read_map_spec(QUERY)[0]
    snapshot = Snapshot(spec=spec, cell_results={}, progress=Progress.WAITING)
    assert progress_text(snapshot) == "0 of 9 cells · waiting"
    idle = Snapshot(spec=read_map_spec({"trials": "0"})[0], cell_results={}, progress=Progress.IDLE)
    assert progress_text(idle) == "no trials yet"
