import asyncio
import json
import threading
import time
from pathlib import Path

import numpy as np
import pytest
from bokeh.models import ColumnDataSource

from app.studies.curves import StudyCurves
from app.studies.figures import draw_panel, panel_columns, panel_shape, update_panel
from app.studies.form import StudyForm
from app.studies.page import StudyPage, compose
from app.studies.progress import Pace, progress_text
from app.studies.scatter import ScatterChoice, StudyScatter, make_dots, worst_html, worst_rows
from app.studies.session import StudyPhase, StudySnapshot
from vsep import InputError
from vsep.studies.catalogue import make_study
from vsep.studies.figures import study_panels
from vsep.studies.trial import run_trial

CHOICE = ScatterChoice(study="fig-3", panel="3a", value="iterations")


@pytest.fixture(scope="module")
def rows():
    """Three realisations of two points, by two methods."""
    study = make_study("fig-3", methods=("object-only", "no-interference"), selection="6,9")
    trials = [study.trial(index, r) for r in range(3) for index in study.point_indices]
    return [row for trial in trials for row in run_trial(trial)]


def snapshot(num_rows, *, whole=100, phase=StudyPhase.RUNNING, failed=0):
    rows = ({"status": "done"},) * num_rows
    return StudySnapshot(phase=phase, rows=rows, num_rows=whole, num_failed=failed)


def test_a_figure_takes_newer_numbers_and_keeps_its_range(rows):
    before, after = study_panels(rows[:8])[0], study_panels(rows)[0]
    plot = draw_panel(before)
    plot.x_range.update(start=20.0, end=40.0)
    assert panel_shape(before) == panel_shape(after)
    update_panel(plot, after)
    columns = panel_columns(after)
    sources = list(plot.select({"type": ColumnDataSource}))
    assert len(sources) == len(columns)
    for source in sources:
        np.testing.assert_array_equal(source.data["y"], columns[source.name]["y"])
    assert (plot.x_range.start, plot.x_range.end) == (20.0, 40.0)


def test_curves_are_drawn_once_and_then_get_numbers(rows):
    view = StudyCurves()
    panels = [one for one in study_panels(rows[:8]) if one.title.startswith("Fig. 3a")]
    view.show(panels)
    drawn = [place.objects[1].object for row in view.grid.objects for place in row.objects]
    assert len(drawn) == len(panels) == 4
    view.show([one for one in study_panels(rows) if one.title == panels[0].title])
    again = [place.objects[1].object for row in view.grid.objects for place in row.objects]
    assert all(one is other for one, other in zip(drawn, again, strict=True))
    assert "object-only" in view.key.object


def test_another_method_draws_the_panel_anew(rows):
    view = StudyCurves()
    some = [row for row in rows if row["method"] == "object-only"]
    for chosen in (some, rows):
        view.show([one for one in study_panels(chosen) if one.title.startswith("Fig. 3a")][:1])
    (place,) = view.grid.objects[0].objects
    labels = [item.label.value for item in place.objects[1].object.legend[0].items]
    assert labels[:2] == ["no-interference", "object-only"]


def test_new_dots_join_those_that_are_there(rows):
    view = StudyScatter()
    view.show(make_dots(rows[:8], CHOICE))
    plot = view.card.objects[0].object
    view.show(make_dots(rows, CHOICE))
    assert view.card.objects[0].object is plot
    source = plot.select_one({"name": "trials-object-only"})
    own = [row for row in rows if row["method"] == "object-only"]
    assert list(source.data["y"]) == [row["iterations"] for row in own]
    assert source.data["link"][-1] == f"fig-3/9/2/object-only/1/{own[-1]['schedule']}"


def test_dots_of_another_seed_take_the_place_of_the_old_ones(rows):
    view = StudyScatter()
    view.show(make_dots(rows, CHOICE))
    plot = view.card.objects[0].object
    view.show(make_dots([{**row, "seed": 2} for row in rows], CHOICE))
    assert view.card.objects[0].object is not plot


def test_the_largest_values_come_first_and_are_links(rows):
    worst = worst_rows(make_dots(rows, CHOICE))
    assert [value for value, _ in worst] == sorted((r["iterations"] for r in rows), reverse=True)
    largest = worst[0][1]
    name = f"point {largest['point_index']}, realization {largest['realization']}"
    assert f'href="./?trial=fig-3%2F{largest["point_index"]}%2F' in worst_html(worst)
    assert name in worst_html(worst)
    assert "No trial" in worst_html([])


def test_time_left_counts_only_the_rows_of_this_run():
    now = [0.0]
    pace = Pace(lambda: now[0])
    assert pace.left_s(snapshot(20)) is None
    pace.begin(20)
    now[0] = 10.0
    assert pace.left_s(snapshot(22)) is None
    assert pace.left_s(snapshot(40)) == pytest.approx(30.0)
    assert pace.left_s(snapshot(40, phase=StudyPhase.STOPPED)) is None
    assert progress_text(snapshot(40, failed=2), 30.0) == "40 of 100 rows · 2 failed · 30 s left"


def test_the_form_makes_the_study_that_is_asked_for(tmp_path):
    form = StudyForm(own_folder=True)
    form.study_name.value = "fig-5"
    form.panels.value = ["5d-f", "5-edges"]
    form.methods.value = ["no-interference", "factorised"]
    form.realizations.value, form.seed.value = 7, 3
    study = form.study()
    assert (study.name, study.realizations, study.settings.seed) == ("fig-5", 7, 3)
    assert study.methods == ("factorised", "no-interference")
    assert {study.points[index].panel for index in study.point_indices} == {"5d-f", "5-edges"}
    assert form.path(tmp_path) == tmp_path / "fig-5-seed-3-robust.jsonl"
    form.folder.value = str(tmp_path / "gone")
    with pytest.raises(InputError, match="gone is not there"):
        form.path(tmp_path)


def test_a_form_with_nothing_chosen_is_one_sentence():
    form = StudyForm(own_folder=False)
    form.methods.value = []
    with pytest.raises(InputError, match="at least one"):
        form.study()
    form.panels.value = []
    with pytest.raises(InputError, match="No panel"):
        form.study()


def test_a_visitor_from_outside_chooses_no_folder(tmp_path):
    form = StudyForm(own_folder=False)
    form.folder.value = str(tmp_path / "other")
    assert form.path(tmp_path).parent == tmp_path


def test_the_picture_has_the_curves_and_the_dots(rows):
    picture = compose(rows, CHOICE)
    assert {panel.title for panel in picture.panels} == {"Fig. 3a: over SNR at SIR 0 dB"}
    assert len(picture.dots.by_method["object-only"].rows) == 6


def test_a_closed_page_stops_its_study_and_removes_its_folder(monkeypatch):
    def run(trials, *, workers):
        del workers
        for trial in trials:
            time.sleep(0.01)
            yield run_trial(trial)

    monkeypatch.setattr("vsep.studies.engine.run_on_processes", run)

    async def visit():
        page = StudyPage(lambda function: function())
        page.form.methods.value = ["object-only"]
        page.form.realizations.value = 10_000
        page.start()
        await page._run(None)
        while not page._panels:
            await asyncio.sleep(0.02)
        content = page._rows().read().splitlines()
        page.close()
        return page, content

    before = set(threading.enumerate())
    page, content = asyncio.run(visit())
    assert json.loads(content[0])["study"] == "fig-3"
    page.session.wait(10.0)
    assert page.session.snapshot().phase is StudyPhase.STOPPED
    for thread in set(threading.enumerate()) - before:
        if thread.daemon:
            thread.join(10.0)
    assert not Path(page._folder.name).exists()
