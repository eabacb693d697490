import re

import numpy as np
import pytest

from app.laboratory.figures import describe, map_html, shown_layers, write_map
from app.laboratory.view import MapView, equality_lines
from app.views.style import Axis
from vsep import InputError
from vsep.laboratory.analytic import analytic_map
from vsep.laboratory.atlas import LAYERS, make_atlas
from vsep.laboratory.axes import parse_axis
from vsep.laboratory.cells import Finding
from vsep.laboratory.question import Question


@pytest.fixture(scope="module")
def atlas():
    """A small map of Simulation II with one cell tried."""
    question = Question(
        x=parse_axis("sir_db=-40:40:9"),
        y=parse_axis("slope_difference=-1.2e12:-4e11:3"),
        scene="simulation-2-a",
        fixed=(("snr_db", 40.0),),
    )
    finding = Finding(
        cell=(0, 0),
        num_trials=5,
        num_objects=50,
        num_found=40,
        num_false=10,
        squared_errors=1e-6,
        squared_bounds=1e-7,
    )
    return make_atlas(question, analytic_map(question), {finding.cell: finding})


def test_the_lines_lie_where_the_condition_is_met(atlas):
    for name in ("whole_db", "weakest_db"):
        lines = equality_lines(atlas, name)
        x, y = (np.concatenate(lines[axis]) for axis in ("xs", "ys"))
        # (27) falls by one dB per dB: along a row the line lies where its value at 0 dB says.
        at_zero = atlas.layers[name][:, 4]
        expected = -np.interp(y, atlas.question.y.values / 1e12, at_zero)
        on_rows = np.isclose(y[:, None], atlas.question.y.values / 1e12).any(axis=1)
        assert on_rows.sum() == 3
        np.testing.assert_allclose(x[on_rows], expected[on_rows], atol=1e-9)


def test_a_map_has_units_limits_and_what_the_pointer_shows(atlas):
    view = MapView(Axis(), Axis(), opens=True)
    view.update(atlas, "detection")
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
    assert start.startswith("laboratory/simulation-2-a/factorised/1/robust/0/snr_db=40.0,")


def test_a_document_holds_all_it_needs(atlas):
    document = map_html(atlas)
    assert not re.search(r"<(?:script|link|img)[^>]+(?:src|href)=.http", document)
    assert document.count("condition (27), weakest object") >= 1
    assert shown_layers(atlas) == list(LAYERS)


def test_the_title_says_what_is_fixed(atlas):
    expected = "Separability: simulation-2-a, SNR [dB] 40, seed 1, factorised, 5 trials a cell"
    assert describe(atlas.question) == expected


def test_a_map_for_print_has_the_layers_of_trials_too(atlas, tmp_path):
    out = tmp_path / "map.png"
    write_map(atlas, out)
    assert out.read_bytes().startswith(b"\x89PNG")
    with pytest.raises(InputError, match=r"must end in .html or .png"):
        write_map(atlas, tmp_path / "map.pdf")
