import pytest

from vsep import InputError
from vsep.studies.catalogue import CATALOGUE, make_study
from vsep.studies.methods import NO_INTERFERENCE, estimator_names, method_names
from vsep.studies.study import select_points
from vsep.studies.trial_scenario import simulate_trial


def test_the_catalogue_has_the_promised_studies():
    names = ["fig-1", "fig-2", "fig-3", "fig-4", "fig-5", "fig-5-methods", "fig-6", "fig-7"]
    names += ["baselines", "detectors", "false-alarms"]
    names += ["mru-prior", "mru-share", "mru-size", "mru-solver", "repairs", "separability"]
    assert list(CATALOGUE) == names


@pytest.mark.parametrize("name", CATALOGUE)
def test_every_point_is_distinct_and_its_scene_can_be_drawn(name):
    study = make_study(name)
    assert len(set(study.points)) == len(study.points)
    drawn = set()
    for index, point in enumerate(study.points):
        kind = (point.panel, point.butterworth_order, point.interferer_slope_hz_per_s)
        if kind not in drawn:
            drawn.add(kind)
            assert simulate_trial(study.trial(index, 0)).interfered.received.size


def test_figure_3_covers_the_levels_that_are_asked_for():
    points = make_study("fig-3").points
    over_snr = [point.snr_db for point in points if point.panel == "3a"]
    over_sir = [point.sir_db for point in points if point.panel == "3b"]
    assert set(over_snr) >= {15.0, 20.0, 30.0, 40.0, 50.0, 60.0}
    assert (min(over_sir), max(over_sir)) == (-50.0, 10.0)
    assert -15.0 in over_sir
    mismatched = {(p.butterworth_order, p.sir_db) for p in points if p.panel == "3c"}
    assert mismatched >= {(8, -40.0), (4, -30.0)}


def test_figure_5_covers_the_levels_and_variants_that_are_asked_for():
    points = make_study("fig-5").points
    assert {p.snr_db for p in points if p.panel == "5a-c"} >= {0.0, 70.0}
    assert {p.sir_db for p in points if p.panel == "5d-f"} >= {-40.0, -15.0, 15.0, 40.0}
    edges = [p for p in points if p.panel == "5-edges"]
    assert {p.interference_model for p in edges} == {"convolution-with-edges"}
    assert {p.num_interferers for p in points if p.panel == "5-two-bursts"} == {2}
    assert {p.num_second_crossings for p in points if p.panel == "5-three-bursts"} == {2}


def test_noise_alone_is_not_run_without_interference():
    assert NO_INTERFERENCE not in make_study("false-alarms").methods
    assert make_study("fig-3").methods == estimator_names()


def test_one_study_of_figure_5_compares_the_mitigation_methods_as_well():
    # The one that chooses is the factorised one wherever its model holds.
    compared = tuple(name for name in method_names() if name != "evidence")
    assert make_study("fig-5-methods").methods == compared
    paper = ("object-only", "zeroing", "mca-unmasked", "factorised", NO_INTERFERENCE)
    assert set(make_study("fig-5").methods) > {*paper, "masked", "autoregressive", "iht", "mca"}
    # Any of them can be asked for in the others.
    assert make_study("fig-5", methods=("zeroing", "masked")).methods == ("zeroing", "masked")


def test_panels_indices_and_ranges_choose_points():
    points = make_study("fig-3").points
    assert select_points(points, "3b") == tuple(range(13, 26))
    assert select_points(points, "2, 0-1,1") == (0, 1, 2)
    assert select_points(make_study("fig-5").points, "5d-f")[0] == 15


@pytest.mark.parametrize(
    "selection",
    [
        "",
        "3z",
        "1-",
        "-1",
        "52",
        "5-2",
        "x-3",
        "0,,1",
        "0-999999999",
        "1" * 5000,
        "0-" + "9" * 5000,
    ],
)
def test_a_senseless_selection_is_refused(selection):
    with pytest.raises(InputError, match="points"):
        make_study("fig-3", selection=selection)


def test_a_threshold_replaces_that_of_the_points():
    points = make_study("false-alarms", object_threshold_db=10.0).points
    assert {(p.object_threshold_db, p.false_alarm_rate) for p in points} == {(10.0, None)}


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"study": "fig-9"}, "fig-9"),
        ({"realizations": 0}, "realizations"),
        ({"methods": ("x",)}, "'x'"),
    ],
)
def test_unknown_names_and_numbers_are_refused(changes, message):
    with pytest.raises(InputError, match=message):
        make_study(**({"study": "fig-3"} | changes))


def test_the_opponents_meet_short_and_endless_bursts_weak_and_strong_in_few_and_all_ramps():
    study = make_study("baselines")
    assert set(study.methods) == {"factorised", "masked", "masked-autoregressive", NO_INTERFERENCE}
    length = [p for p in study.points if p.panel == "length"]
    # Seconds for which a burst is within the half-amplitude band of 2.55 MHz; a ramp has 25 us.
    seconds = [2.55e6 / (1e13 - p.interferer_slope_hz_per_s) for p in length]
    assert min(seconds) < 0.2 * 25e-6
    assert max(seconds) > 2.0 * 25e-6
    assert {p.sir_db for p in study.points if p.panel == "level"} >= {-40.0, 0.0, 40.0}
    share = [p for p in study.points if p.panel == "share"]
    assert [p.num_interfered_ramps for p in share][-1] == 16
