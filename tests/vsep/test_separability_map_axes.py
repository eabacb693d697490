import numpy as np
import pytest

from vsep import InputError
from vsep.separability.axes import AXES, Axis, parse_axis, parse_value


def test_an_axis_reads_back_what_it_writes():
    for name, kind in AXES.items():
        start, stop = map(kind.rounded_si, kind.offered)
        axis = Axis(name=name, start=start, stop=stop, count=20)
        assert parse_axis(axis.text) == axis


def test_a_name_may_lack_its_unit():
    assert parse_axis("sir=-40:40:3").name == "sir_db"
    assert parse_value("filter_cutoff=1e6") == ("filter_cutoff_hz", 1e6)
    assert parse_value("num_objects=4") == ("num_objects", 4.0)


def test_values_are_equally_spaced_and_short():
    np.testing.assert_array_equal(parse_axis("filter_mismatch=0:0.3:4").values, [0, 0.1, 0.2, 0.3])


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("sir_db", "must read name=start:stop:count"),
        ("sir_db=1:2", "must read name=start:stop:count"),
        ("sir_db=1:2:3:4", "must read name=start:stop:count"),
        ("sir_db=1:2:x", "must read name=start:stop:count"),
        ("noise=1:2:3", "The parameter is 'noise'"),
        ("sir_db=-10:10:1", "Number of values of sir_db is 1"),
        ("sir_db=-10:10:130", "it must lie between 2 and 129"),
        ("sir_db=10:-10:3", "goes from 10 to -10"),
        ("sir_db=-1000:0:3", "sir_db is -1000"),
        ("sir_db=nan:0:3", "sir_db is nan"),
        ("num_objects=1:4:3", "num_objects is 2.5; its values must be whole"),
        ("slope_difference=-1e12:1e12:3", "0, where chirps are parallel"),
        ("interfered_share=0:1:3", "interfered_share is 0; it must be above 0"),
    ],
)
def test_what_is_no_axis_is_one_sentence(text, sentence):
    with pytest.raises(InputError, match=sentence):
        parse_axis(text)


def test_what_is_no_value_is_one_sentence():
    with pytest.raises(InputError, match="must read name=number"):
        parse_value("sir_db=loud")
    with pytest.raises(InputError, match="filter_cutoff_hz is 1"):
        parse_value("filter_cutoff=1")
