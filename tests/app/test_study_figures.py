import gc
import re
import weakref

import numpy as np
import pytest
from bokeh.models import Legend
from vsep_app.figures.study_elements import panel_marks
from vsep_app.figures.study_figure import (
    draw_panel,
    figure_html,
    figure_panels,
    write_panels,
    write_study_figure,
)
from vsep_app.figures.study_style import colour, marker

from vsep import InputError
from vsep.studies.panels import Box, BoxPanel, FigurePanel, ImagePanel, Series

X = np.array([-20.0, 0.0, 20.0])


def series(kind="curve", role="factorised", **changes):
    values = {
        "label": role,
        "role": role,
        "kind": kind,
        "x": X,
        "y": np.array([1e-4, 0.0, 3e-4]),
        "low": np.array([0.5e-4, 0.0, np.nan]),
        "high": np.array([2e-4, 1e-4, np.nan]),
    }
    return Series(**(values | changes))


PANEL = FigurePanel(
    title="Fig. X",
    x_label="SIR [dB]",
    y_label="error",
    note="95 % intervals",
    log_y=True,
    series=(
        series(),
        series(role="joint", variant=1),
        series("dashed", role="bound"),
        series("line", role="received"),
        series("stems", role="estimated object"),
        series("crosses", role="true object"),
    ),
)
BOXES = BoxPanel(
    title="Fig. X",
    y_label="misses",
    boxes=(
        Box(role="factorised", low=0.0, first=1.0, middle=2.0, third=3.0, high=4.0, outliers=()),
        Box(
            role="joint", low=0.0, first=1.0, middle=2.0, third=3.0, high=4.0, outliers=(9.0, 11.0)
        ),
    ),
)
IMAGE = ImagePanel(
    title="Fig. Y",
    x_label="time",
    y_label="frequency",
    x=np.arange(4.0),
    y=np.array([0.0, 0.5, 1.0]),
    levels_db=np.arange(12.0).reshape(3, 4),
    series=(series("crosses", role="true object"),),
)
OTHER = FigurePanel(title="Fig. Y", x_label="x", y_label="y", series=(series(),), log_x=False)


def test_a_figure_that_nobody_holds_is_gone():
    drawn = weakref.ref(draw_panel(PANEL))
    gc.collect()
    assert drawn() is None


def test_a_panel_shows_every_series_its_unit_and_its_note():
    plot = draw_panel(PANEL)
    (legend,) = plot.select(type=Legend)
    labels = [item.label.value for item in legend.items]
    assert labels == ["factorised", "joint", "bound", "received", "estimated object", "true object"]
    assert plot.xaxis[0].axis_label == "SIR [dB]"
    assert plot.title.text == "95 % intervals"


def test_a_logarithmic_axis_leaves_zero_out():
    plot = draw_panel(PANEL)
    drawn = plot.renderers[0].data_source.data["y"]
    assert np.isnan(drawn[1])
    assert drawn[0] == 1e-4


def test_boxes_name_their_methods_and_count_their_outliers():
    plot = draw_panel(BOXES)
    assert plot.xaxis[0].major_label_overrides == {0: "factorised", 1: "joint"}
    texts = [r.data_source.data["text"] for r in plot.renderers if "text" in r.data_source.data]
    assert [list(text) for text in texts] == [[], ["2"]]


def test_every_mark_has_the_columns_that_bokeh_draws():
    # A page updates a figure by these columns, in this order.
    for panel in (PANEL, BOXES, IMAGE, OTHER):
        plot = draw_panel(panel)
        marks = panel_marks(panel)
        for renderer, mark in zip(plot.renderers, marks, strict=True):
            drawn = renderer.data_source.data
            assert drawn.keys() == mark.source.keys()
            for name, values in mark.source.items():
                np.testing.assert_array_equal(drawn[name], values)


def test_the_document_asks_for_nothing():
    text, again = (figure_html([PANEL, BOXES, IMAGE, OTHER], title="vsep: fig-x") for _ in range(2))
    assert text == again
    assert "<title>vsep: fig-x</title>" in text
    assert not re.search(r"<(?:script|link|img)[^>]*(?:src|href)=[\"']?https?:", text)


def test_print_has_the_right_format_and_the_same_bytes_each_time(tmp_path):
    for suffix, start in ((".png", b"\x89PNG"), (".svg", b"<?xml"), (".pdf", b"%PDF")):
        paths = [tmp_path / f"{name}{suffix}" for name in ("one", "two")]
        for path in paths:
            write_panels([PANEL, BOXES, IMAGE, OTHER], path)
        assert paths[0].read_bytes().startswith(start)
        assert paths[0].read_bytes() == paths[1].read_bytes()


def test_a_new_method_gets_a_colour_and_a_marker_of_its_own_choosing():
    assert colour("zeroing") == colour("zeroing")
    assert colour("zeroing") not in {colour("factorised"), colour("joint")}
    assert marker("zeroing") != marker("factorised")


def test_rows_without_results_have_no_figure(tmp_path):
    with pytest.raises(InputError, match="no finished trial"):
        figure_panels([])
    with pytest.raises(InputError, match=r"figure\.gif"):
        write_study_figure([], tmp_path / "figure.gif")
