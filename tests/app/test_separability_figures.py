import re

import numpy as np
import pytest
from vsep_app.figures.map_file import describe, map_html, shown_layers, write_map
from vsep_app.figures.map_view import MapView, equality_lines
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
        lines = equality_lines(separability_map, name)
        x, y = (np.concatenate(lines[axis]) for axis in ("xs", "ys"))
        # (27) falls by one dB per dB: along a row the line lies where its value at 0 dB says.
        at_zero = separability_map.layers[name][:, 4]
        expected = -np.interp(y, separability_map.spec.y.values / 1e12, at_zero)
        on_rows = np.isclose(y[:, None], separability_map.spec.y.values / 1e12).any(axis=1)
        assert on_rows.sum() == 3
        np.testing.assert_allclose(x[on_rows], expected[on_rows], atol=1e-9)


def test_a_map_has_units_limits_and_what_the_pointer_shows(separability_map):
    view = MapView(Axis(), Axis(), opens=True)
    view.update(separability_map, "detection")
    data, plot = view.source.data, view.figure
    assert plot.yaxis.axis_label == "slope difference [MHz/µs]"
    # Cells are centred on their values.
    assert (data["x"][0], data["dw"][0]) == (-45.0, 90.0)
    assert data["y"][0] == pytest.approx(-1.4)
    assert data["shown"][0][0, 0] == pytest.approx(0.8)
    fields = re.findall(r"@(\w+)", " ".join(text for _, text in view._hover.tooltips))
    assert set(fields) == {*LAYERS, "x_value", "y_value", "trials"}
    assert all(data[field][0].shape == (3, 9) for field in fields)
    start, columns, rows, *_ = plot.tags
    assert (len(columns), len(rows)) == (9, 3)
    assert start.startswith("separability-map/simulation-2-a/factorised/1/robust/0/snr_db=40.0,")


def test_a_document_holds_all_it_needs(separability_map):
    document = map_html(separability_map)
    assert not re.search(r"<(?:script|link|img)[^>]+(?:src|href)=.http", document)
    assert document.count("condition (27), weakest object") >= 1
    assert shown_layers(separability_map) == list(LAYERS)


def test_the_title_says_what_is_fixed(separability_map):
    expected = "Separability: simulation-2-a, SNR [dB] 40, seed 1, factorised, 5 trials a cell"
    assert describe(separability_map.spec) == expected


def test_a_map_for_print_has_the_layers_of_trials_too(separability_map, tmp_path):
    out = tmp_path / "map.png"
    write_map(separability_map, out)
    assert out.read_bytes().startswith(b"\x89PNG")
    with pytest.raises(InputError, match=r"must end in .html or .png"):
        write_map(separability_map, tmp_path / "map.pdf")
