import re

import numpy as np
import pytest
from bokeh.models import HoverTool
from vsep_app.figures.map_elements import equality_lines
from vsep_app.figures.map_file import describe, map_html, shown_layers, write_map
from vsep_app.figures.map_view import MapView
from vsep_app.views.style import Axis

from vsep import InputError
from vsep.separability.analytic import analytic_map
from vsep.separability.axes import parse_axis
from vsep.separability.cells import CellResult
from vsep.separability.map import LAYERS, make_separability_map
from vsep.separability.map_spec import MapSpec


@pytest.fixture(scope="module")
def separability_map():
    """A small map of Simulation II with one cell tried."""
    spec = MapSpec(
        x=parse_axis("sir_db=-40:40:9"),
        y=parse_axis("slope_difference=-1.2e12:-4e11:3"),
        scene="simulation-2-a",
        fixed=(("snr_db", 40.0),),
    )
    cell_result = CellResult(
        cell=(0, 0),
        num_trials=5,
        num_objects=50,
        num_found=40,
        num_false=10,
        squared_errors=1e-6,
        squared_bounds=1e-7,
    )
    return make_separability_map(spec, analytic_map(spec), {cell_result.cell: cell_result})


def test_the_lines_lie_where_the_condition_is_met(separability_map):
    for name in ("whole_db", "weakest_db"):
        x, y = np.concatenate(equality_lines(separability_map, name)).T
        # (27) falls by one dB per dB: along a row the line lies where its value at 0 dB says.
        at_zero = separability_map.layers[name][:, 4]
        expected = -np.interp(y, separability_map.spec.y.values / 1e12, at_zero)
        on_rows = np.isclose(y[:, None], separability_map.spec.y.values / 1e12).any(axis=1)
        assert on_rows.sum() == 3
        np.testing.assert_allclose(x[on_rows], expected[on_rows], atol=1e-9)


def test_a_map_has_units_limits_and_what_the_pointer_shows(separability_map):
    plot = MapView(Axis(), Axis()).update(separability_map, "detection")
    data = plot.renderers[0].data_source.data
    assert plot.yaxis.axis_label == "slope difference [MHz/µs]"
    # Cells are centred on their values.
    assert (data["x"][0], data["dw"][0]) == pytest.approx((-45.0, 90.0))
    assert data["y"][0] == pytest.approx(-1.4)
    assert (plot.x_range.start, plot.x_range.end) == (-45.0, 45.0)
    assert data["image"][0][0, 0] == pytest.approx(0.8)
    fields = re.findall(
        r"@(\w+)", " ".join(text for _, text in plot.select_one(HoverTool).tooltips)
    )
    own = {"x_value", "y_value", "trials", "least_found", "most_found"}
    assert set(fields) == {*(f"{name}_layer" for name in LAYERS)} | own
    # Clopper-Pearson of 40 in 50, from tables.
    assert data["least_found"][0][0, 0] == pytest.approx(0.663, abs=5e-4)
    assert data["most_found"][0][0, 0] == pytest.approx(0.900, abs=5e-4)
    assert all(data[field][0].shape == (3, 9) for field in fields)
    np.testing.assert_array_equal(data["x_value"][0][0], separability_map.spec.x.values)
    np.testing.assert_allclose(
        data["y_value"][0][:, 0], separability_map.spec.y.values / 1e12, rtol=1e-12
    )
    np.testing.assert_array_equal(data["coherence_layer"][0], separability_map.layers["coherence"])
    start, columns, rows, *_ = plot.tags
    assert (len(columns), len(rows)) == (9, 3)
    assert start.startswith("separability-map/simulation-2-a/factorised/1/robust/0/snr_db=40.0,")


def test_cells_without_trials_of_their_own_are_hatched(separability_map):
    plot = MapView(Axis(), Axis()).update(separability_map, "detection")
    (boxes,) = (r for r in plot.renderers if type(r.glyph).__name__ == "Quad")
    assert boxes.glyph.hatch_pattern == "right_diagonal_line"
    # Of 3 x 9 cells the first one is tried: what is left of its row, and two whole rows.
    data = boxes.data_source.data
    spans = sorted(zip(data["left"], data["right"], strict=True))
    assert spans == [(-45.0, 45.0), (-45.0, 45.0), (-35.0, 45.0)]


def test_another_layer_comes_into_the_same_figure_and_the_zoom_stays(separability_map):
    view = MapView(Axis(), Axis())
    plot = view.update(separability_map, "detection")
    plot.x_range.update(start=-10.0, end=20.0)
    assert view.update(separability_map, "whole_db") is plot
    assert plot.title.text == LAYERS["whole_db"].label
    shown, bar = plot.renderers[0].data_source.data["image"][0], plot.right[0].color_mapper
    np.testing.assert_array_equal(shown, separability_map.layers["whole_db"])
    assert (bar.low, bar.high) == separability_map.limits("whole_db")
    # Red below zero, blue above it.
    assert bar.palette[0][1:3] > bar.palette[0][5:7]
    assert bar.palette[-1][1:3] < bar.palette[-1][5:7]
    assert (plot.x_range.start, plot.x_range.end) == (-10.0, 20.0)


def test_a_document_holds_all_it_needs(separability_map):
    document = map_html(separability_map)
    assert document == map_html(separability_map)
    assert not re.search(r"<(?:script|link|img)[^>]+(?:src|href)=.http", document)
    assert document.count("condition (27), weakest object") >= 1
    assert shown_layers(separability_map) == list(LAYERS)


def test_the_title_says_what_is_fixed(separability_map):
    expected = "Separability: simulation-2-a, SNR [dB] 40, seed 1, factorised, 5 trials a cell"
    assert describe(separability_map.spec) == expected


def test_a_map_for_print_has_all_layers_and_the_same_bytes_each_time(separability_map, tmp_path):
    for suffix, start in ((".png", b"\x89PNG"), (".svg", b"<?xml"), (".pdf", b"%PDF")):
        paths = [tmp_path / f"{name}{suffix}" for name in ("one", "two")]
        for path in paths:
            write_map(separability_map, path)
        assert paths[0].read_bytes().startswith(start)
        assert paths[0].read_bytes() == paths[1].read_bytes()
    # A map is one image in the file, and its colours another.
    assert (tmp_path / "one.svg").read_text().count("<image") >= len(LAYERS)
    with pytest.raises(InputError, match=r"must end in .html, .png, .svg or .pdf"):
        write_map(separability_map, tmp_path / "map.gif")
