import pytest

from vsep import InputError
from vsep.studies.scatter import FRAME_VALUES, scatter


def row(realization, sir_db=0.0, method="factorised", status="done", panel="5d-f", **changes):
    values = {
        "realization": realization,
        "method": method,
        "status": status,
        "point": {"panel": panel, "sir_db": sir_db},
        "errors": [1e-3, 3e-3],
        "misses": 1,
        "false_alarms": realization,
        "iterations": 12,
        "seconds": 0.5,
    }
    return values | changes


def test_every_dot_leads_back_to_its_row():
    rows = [row(0), row(7, sir_db=15.0), row(1, method="joint"), row(2, panel="5a-c")]
    dots = scatter(rows, "false alarms", panel="5d-f", method="factorised", x="sir_db")
    assert dots.x.tolist() == [0.0, 15.0]
    assert dots.y.tolist() == [0.0, 7.0]
    assert dots.rows == (rows[0], rows[1])


def test_frames_without_the_value_and_failed_ones_have_no_dot():
    rows = [row(0), row(1, errors=[]), row(2, status="failed")]
    name = "mean assigned error [cycles]"
    dots = scatter(rows, name, panel="5d-f", method="factorised", x="sir_db")
    assert dots.y == pytest.approx([2e-3])
    assert [one["realization"] for one in dots.rows] == [0]


@pytest.mark.parametrize("value", FRAME_VALUES)
def test_every_value_can_be_read(value):
    assert len(scatter([row(3)], value, panel="5d-f", method="factorised", x="sir_db").y) == 1


def test_an_unknown_value_is_named():
    with pytest.raises(InputError, match="'beauty'"):
        scatter([], "beauty", panel="5d-f", method="factorised", x="sir_db")
