from dataclasses import replace

import numpy as np
from vsep_app.figures.study_elements import panel_marks, panel_shape
from vsep_app.figures.study_figure import draw_panel, update_panel
from vsep_app.pages.studies.curves import StudyCurves

from vsep.studies.example import example_panels
from vsep.studies.figures import study_panels
from vsep.studies.panels import FigurePanel, reference


def of_figure_3a(rows):
    return [
        panel
        for panel in study_panels(rows)
        if panel.title.startswith("Fig. 3a") and "half a cell" in panel.title
    ]


def plots(view):
    return [place.objects[1].object for row in view.grid.objects for place in row.objects]


def test_a_figure_takes_newer_numbers_and_keeps_its_range(study_rows):
    before, after = study_panels(study_rows[:8])[0], study_panels(study_rows)[0]
    plot = draw_panel(before)
    plot.x_range.update(start=20.0, end=40.0)
    assert panel_shape(before) == panel_shape(after)
    update_panel(plot, after)
    assert plot.title.text == after.note != before.note
    for renderer, mark in zip(plot.renderers, panel_marks(after), strict=True):
        for name, values in mark.columns.items():
            np.testing.assert_array_equal(renderer.data_source.data[name], values)
    assert (plot.x_range.start, plot.x_range.end) == (20.0, 40.0)


def test_curves_are_drawn_once_and_then_get_numbers(study_rows):
    view = StudyCurves()
    view.show(of_figure_3a(study_rows[:8]))
    drawn = plots(view)
    assert len(drawn) == 4
    view.show(of_figure_3a(study_rows))
    assert all(one is other for one, other in zip(drawn, plots(view), strict=True))
    assert "object-only" in view.key.object


def test_another_method_draws_the_panel_anew(study_rows):
    view = StudyCurves()
    some = [row for row in study_rows if row["method"] == "object-only"]
    for chosen in (some, study_rows):
        view.show(of_figure_3a(chosen)[:1])
    (plot,) = plots(view)
    labels = [item.label.value for item in plot.legend[0].items]
    assert labels[:2] == ["no-interference", "object-only"]


def test_examples_are_two_pictures_and_nothing_is_a_hint(study_rows):
    view = StudyCurves()
    hint = view.grid.objects[0].object
    row = {**study_rows[0], "study": "fig-2"}
    view.show(example_panels([row]))
    assert len(plots(view)) == 2
    assert all(word in view.key.object for word in ("received", "estimated object"))
    view.show([])
    assert view.grid.objects[0].object == hint
    assert "Choose a study" in hint


def test_a_reference_that_gains_a_band_is_drawn_anew():
    x, nothing = np.arange(3.0), np.full(3, np.nan)
    line = reference("ideal", "guide", x, x)
    shapes = []
    for low, high in ((nothing, nothing), (x - 1.0, x + 1.0)):
        series = replace(line, low=low, high=high)
        panel = FigurePanel(title="Fig. X", x_label="x", y_label="y", series=(series,))
        plot = draw_panel(panel)
        update_panel(plot, panel)
        shapes.append(panel_shape(panel))
    assert shapes[0] != shapes[1]
