from vsep_app.model.trial_link import trial_link
from vsep_app.pages.studies.scatter import (
    ScatterChoice,
    StudyScatter,
    make_dots,
    worst_html,
    worst_rows,
)

CHOICE = ScatterChoice(study="fig-3", panel="3a", value="iterations")


def test_new_dots_join_those_that_are_there(study_rows):
    view = StudyScatter()
    view.show(make_dots(study_rows[:8], CHOICE))
    plot = view.card.objects[0].object
    view.show(make_dots(study_rows, CHOICE))
    assert view.card.objects[0].object is plot
    source = plot.select_one({"name": "trials-object-only"})
    own = [row for row in study_rows if row["method"] == "object-only"]
    assert list(source.data["y"]) == [row["iterations"] for row in own]
    assert list(source.data["link"]) == [trial_link(row) for row in own]
    assert source.data["link"][-1] == "fig-3/9/2/object-only/1/robust"


def test_dots_of_another_seed_take_the_place_of_the_old_ones(study_rows):
    view = StudyScatter()
    view.show(make_dots(study_rows, CHOICE))
    plot = view.card.objects[0].object
    view.show(make_dots([{**row, "seed": 2} for row in study_rows], CHOICE))
    assert view.card.objects[0].object is not plot


def test_a_study_without_rows_has_an_empty_figure_until_there_are_some(study_rows):
    view = StudyScatter()
    view.show(make_dots([], CHOICE))
    view.show(make_dots(study_rows, CHOICE))
    plot = view.card.objects[0].object
    assert len(plot.select_one({"name": "trials-object-only"}).data["x"]) == 6
    view.show(make_dots([], CHOICE))
    assert view.card.objects[0].object is not plot


def test_the_largest_values_come_first_and_are_links(study_rows):
    worst = worst_rows(make_dots(study_rows, CHOICE))
    values = sorted((row["iterations"] for row in study_rows), reverse=True)
    assert [value for value, _ in worst] == values
    largest = worst[0][1]
    name = f"point {largest['point_index']}, realization {largest['realization']}"
    assert f'href="./?trial=fig-3%2F{largest["point_index"]}%2F' in worst_html(worst)
    assert name in worst_html(worst)
    assert "No trial" in worst_html([])


def test_what_the_live_view_cannot_repeat_is_no_link(study_rows):
    html = worst_html([(3.0, {**study_rows[0], "method": "not <live>"})])
    assert "href" not in html
    assert "not &lt;live&gt;" in html


def test_examples_have_dots_though_no_curves(study_rows):
    choice = ScatterChoice(study="fig-2", panel="3a", value="misses")
    assert (choice.x, choice.log_x) == ("sir_db", False)
    assert ScatterChoice(study="false-alarms", panel="noise-1", value="misses").log_x
    assert len(make_dots(study_rows, choice).by_method["object-only"].x) == 6
