import pytest

from vsep import InputError
from vsep.separability.axes import parse_axis, parse_value
from vsep.separability.map_spec import MapSpec
from vsep.separability.trial_word import trial_of_word, trial_word, word_parts
from vsep.studies.study import TrialSettings
from vsep.studies.trial import run_trial


def spec(x="sir_db=-40:40:5", y="slope_difference=-2e12:-1e11:3", **changes):
    fixed = tuple(parse_value(text) for text in changes.pop("fixed", ()))
    return MapSpec(x=parse_axis(x), y=parse_axis(y), fixed=fixed, **changes)


def test_a_cell_has_what_axes_and_fixed_values_say():
    point = spec(fixed=["snr_db=40", "filter_mismatch=0.1"], trials=2).point((4, 0))
    assert (point.sir_db, point.snr_db, point.filter_mismatch) == (40.0, 40.0, 0.1)
    assert point.interferer_slope_hz_per_s == 1e13 - 2e12
    assert point.num_objects is None


def test_a_share_becomes_whole_ramps_and_at_least_one():
    maps = spec("interfered_share=0.01:1:3", "num_objects=1:3:3", scene="simulation-2-a")
    assert [maps.point((column, 2)).num_interfered_ramps for column in range(3)] == [1, 8, 16]
    assert maps.point((0, 2)).num_objects == 3


def test_equal_specs_are_one_key_whatever_the_order_of_fixed_values():
    first = spec(fixed=["snr_db=40", "num_objects=2"])
    assert {first: 1}[spec(fixed=["num_objects=2", "snr_db=40"])] == 1


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ({"scene": "simulation-3"}, "The scene is 'simulation-3'"),
        ({"y": "sir_db=0:1:2"}, "Both axes are sir_db"),
        ({"fixed": ["sir_db=0"]}, "sir_db is fixed at 0 and on an axis"),
        ({"fixed": ["snr_db=0", "snr_db=1"]}, "fixed twice"),
        ({"fixed": ["interfered_share=0.5"]}, "simulation-1 has one ramp"),
        ({"fixed": ["filter_cutoff=6e6"]}, "filter_cutoff_hz is 6e"),
        ({"x": "object_delay=-6e-7:0:3"}, "object_delay_s is -6e-07"),
        ({"method": "magic"}, "method is 'magic'"),
        ({"trials": -1}, "Number of trials is -1"),
        ({"false_alarm_rate": -1.0}, "false_alarm_rate is -1"),
    ],
)
def test_what_cannot_be_answered_is_one_sentence(changes, sentence):
    with pytest.raises(InputError, match=sentence):
        spec(**changes)


@pytest.mark.parametrize(
    "maps",
    [
        spec(fixed=["object_delay=1e-8"], settings=TrialSettings(seed=7), method="joint"),
        spec("interfered_share=0.1:1:4", "num_objects=1:3:3", scene="simulation-2-c"),
        spec("filter_cutoff=1e6:2.5e6:4", "filter_mismatch=-0.3:0.3:7", false_alarm_rate=0.3),
    ],
    ids=["delay", "counts", "filter"],
)
def test_every_cell_is_a_word_and_back(maps):
    start, columns, rows = word_parts(maps)
    for row in range(maps.y.count):
        for column in range(maps.x.count):
            trial = maps.trial((column, row))
            assert trial_of_word(f"{start}{columns[column]},{rows[row]}") == trial
            assert trial_of_word(trial_word(trial)) == trial


@pytest.mark.parametrize(
    ("word", "sentence"),
    [
        ("separability-map/simulation-1/joint/1/robust/0", "it must read"),
        ("separability-map/noise-1/joint/1/robust/0/snr_db=1,sir_db=1", "it must read"),
        ("separability-map/simulation-1/joint/x/robust/0/snr_db=1,sir_db=1", "whole numbers"),
        ("separability-map/simulation-1/joint/1/robust/0/snr_db=1", "must name snr_db and sir_db"),
        (
            "separability-map/simulation-1/joint/1/robust/0/snr_db=1,sir_db=a",
            "sir_db must be a number",
        ),
        (
            "separability-map/simulation-1/joint/1/robust/0/panel=1,sir_db=1",
            "'panel' is no parameter",
        ),
        (
            "separability-map/simulation-1/joint/1/robust/0/num_objects=1.5",
            "must be a whole number",
        ),
        ("separability-map/simulation-1/joint/1/magic/0/snr_db=1,sir_db=1", "magic"),
    ],
)
def test_a_word_of_nothing_is_one_sentence(word, sentence):
    with pytest.raises(InputError, match=sentence):
        trial_of_word(word)


def test_a_trial_alone_gives_what_its_word_gives():
    maps = spec(fixed=["num_objects=2"], method="object-only")
    trial = maps.trial((4, 0), 1)
    rows = [run_trial(one) for one in (trial, trial_of_word(trial_word(trial)))]
    for (row,) in rows:
        del row["seconds"]
    assert rows[0] == rows[1]
    assert rows[0][0]["num_objects_true"] == 2


def test_neighbouring_cells_differ_by_their_parameters_alone():
    maps = spec("sir_db=-40:40:2", "snr_db=30:60:2", method="no-interference")
    (weak,), (strong,) = run_trial(maps.trial((0, 0))), run_trial(maps.trial((1, 0)))
    assert weak["beat_errors"] == strong["beat_errors"]
