"""Extended objects: which points are one, and groups below the threshold of points."""

from dataclasses import replace

import numpy as np
import pytest

from tests.vsep.extended_bench import RADAR, car_scene, found_in, of_the_car
from vsep.analysis.intervals import bootstrap_interval, poisson_interval
from vsep.files.results import groups_entry
from vsep.grouping.evidence import cell_evidence, evidence_threshold
from vsep.grouping.groups import find_groups
from vsep.grouping.partition import point_groups
from vsep.grouping.prior import CAR, Points, log_density, log_odds
from vsep.inference.core.run import run
from vsep.inference.objects.object_only import ObjectOnlySeparator
from vsep.presets.scenes import simulate_preset
from vsep.signal.filters import NoFilter
from vsep.signal.template import SignalModel

CAR_M = np.array([20.0, 20.4, 20.9, 21.5])
FAR_M, FAR_MPS = np.array([5.0, 12.0, 33.0]), np.array([1.0, -7.0, 12.0])


def points(ranges_m, velocities_mps, std=0.01):
    stds = np.full(len(ranges_m), std)
    return Points(
        ranges_m=ranges_m,
        velocities_mps=velocities_mps,
        range_std_m=stds,
        velocity_std_mps=stds,
        range_span_m=50.0,
        velocity_span_mps=32.0,
    )


def test_the_density_around_a_free_centre_is_the_integral_over_it():
    values, stds = np.array([0.1, 0.9, 0.4]), np.array([0.2, 0.1, 0.3])
    centres = np.linspace(-6.0, 7.0, 20_001)[:, None]
    scales = np.geomspace(0.3, 2.0, 8)
    variances = scales[:, None, None] ** 2 + stds**2
    normal = np.exp(-0.5 * (values - centres) ** 2 / variances) / np.sqrt(2.0 * np.pi * variances)
    integral = np.trapezoid(normal.prod(axis=2), centres[:, 0], axis=1).mean()
    assert log_density(values, stds, (0.3, 2.0)) == pytest.approx(np.log(integral), rel=1e-3)


def test_four_points_that_move_together_are_a_group_and_others_are_not():
    near = points(np.concatenate([CAR_M, FAR_M]), np.concatenate([np.full(4, 8.0), FAR_MPS]))
    (members, odds), *others = point_groups(near)
    assert members == [0, 1, 2, 3]
    assert odds == pytest.approx(log_odds(members, near))
    assert others == []


def test_points_that_move_apart_are_no_group():
    assert point_groups(points(CAR_M, np.array([8.0, 3.0, -2.0, -9.0]))) == []


def test_two_points_are_no_group():
    assert point_groups(points(CAR_M[:2], np.full(2, 8.0))) == []


def test_velocities_at_both_ends_of_the_interval_are_the_same():
    found = point_groups(points(CAR_M, np.array([15.99, -15.98, 15.97, -15.99])))
    assert [members for members, _ in found] == [[0, 1, 2, 3]]


def test_points_whose_velocity_is_not_known_are_grouped_by_distance():
    known = points(CAR_M, np.zeros(4))
    unknown = replace(known, velocity_std_mps=np.full(4, np.inf))
    assert [members for members, _ in point_groups(unknown)] == [[0, 1, 2, 3]]


def test_a_group_is_no_longer_than_the_prior_allows():
    line = points(np.linspace(10.0, 10.0 + 1.2 * CAR.max_extent_m, 9), np.full(9, 8.0))
    for members, _ in point_groups(line):
        assert np.ptp(line.ranges_m[members]) <= CAR.max_extent_m


@pytest.mark.parametrize("num_antennas", [1, 3])
def test_the_threshold_is_exceeded_as_often_as_it_says(num_antennas):
    rng, shape, rate = np.random.default_rng(1), (4000, 256), 600.0
    evidence = cell_evidence(rng.gamma(num_antennas, size=shape), 11, num_antennas)
    sums = np.lib.stride_tricks.sliding_window_view(evidence, 11, axis=1).sum(axis=2)
    threshold = evidence_threshold(rate, 11, shape[0], sums[:, 1:].size, num_antennas)
    above = sums > threshold
    runs = above[:, 0] + np.sum(above[:, 1:] & ~above[:, :-1], axis=1)
    interval = bootstrap_interval(runs.astype(np.float64))
    # The law's lattice is rounded up, by 2.5e-3 nats a cell on average: thresholds by 0.03.
    assert shape[0] * interval.low <= rate <= 1.03 * shape[0] * interval.high


@pytest.mark.parametrize("num_ramps", [1, 16])
def test_noise_alone_holds_no_more_groups_than_asked_for(num_ramps):
    radar = replace(RADAR, num_ramps=num_ramps, num_samples=64, slope_hz_per_s=120e12)
    rng, num_frames, rate = np.random.default_rng(2), 250, 0.5
    silent = np.ones(radar.shape, dtype=np.complex128)
    estimator = ObjectOnlySeparator(model=SignalModel.of_radar(radar, NoFilter()))
    state = replace(estimator.init(silent), noise_precision=0.5)
    count = 0
    for _ in range(num_frames):
        noise = rng.standard_normal((2, *radar.shape))
        groups = find_groups(noise[0] + 1j * noise[1], state, radar, false_group_rate=rate)
        count += len(groups)
    interval = poisson_interval(count, num_frames)
    assert interval.high <= rate
    assert interval.low > 0.01  # it does ask for evidence, not for the impossible


@pytest.mark.parametrize("seed", [(17, 0), (17, 1)])
def test_a_car_among_points_is_one_group_and_takes_no_point(seed):
    found = found_in(seed, 20.0)
    assert (found["groups"], found["others"]) == (1, 0)
    assert (found["swallowed"], found["left out"]) == (0, 0)
    assert found["points"] >= 5


def test_a_car_below_the_threshold_of_points_is_found_as_a_whole():
    hidden = [found_in((18, seed), 9.0, others=False) for seed in range(8)]
    assert sum(each["groups"] == 1 for each in hidden) >= 6
    assert sum(each["points"] >= 3 for each in hidden) == 0


def test_a_single_weak_line_is_no_group():
    rng, shape = np.random.default_rng(3), RADAR.shape
    estimator = ObjectOnlySeparator(model=SignalModel.of_radar(RADAR, NoFilter()))
    noise = rng.standard_normal((2, *shape))
    line = np.exp(-2j * np.pi * (0.1 * np.arange(256) + 0.25 * np.arange(128)[:, None]))
    received = noise[0] + 1j * noise[1] + line * np.sqrt(2.0 * 14.0 / line.size)
    state = replace(estimator.init(received), noise_precision=0.5)  # 11 dB, below the threshold
    assert find_groups(received, state, RADAR) == ()


@pytest.mark.parametrize("sir_db", [-20.0, 0.0, 20.0])
def test_bursts_that_the_estimate_does_not_explain_are_no_group(sir_db):
    scenario, observation = simulate_preset("simulation-2-b", snr_db=60.0, sir_db=sir_db, seed=21)
    model = SignalModel.of_radar(scenario.radar, scenario.anti_aliasing_filter)
    state = run(ObjectOnlySeparator(model=model), observation.received).state
    assert find_groups(observation.received, state, scenario.radar) == ()


def test_the_result_line_says_what_belongs_together():
    received, truth, state = car_scene((17, 2), 20.0)
    (entry,) = groups_entry(find_groups(received, state, RADAR))["groups"]
    ranges = RADAR.range_from_beat(state.objects.beats)[entry["objects"]]
    assert entry["extent_m"] == pytest.approx(np.ptp(ranges))
    assert entry["range_m"] == pytest.approx((ranges.min() + ranges.max()) / 2.0)
    assert of_the_car(truth, entry["range_m"], entry["velocity_mps"])
    assert entry["strongest"]["component_snr_db"] == pytest.approx(
        10.0 * np.log10(state.component_snr[entry["objects"]].max())
    )
    assert groups_entry(()) == {}


def test_cars_of_the_simulator_leave_the_rest_of_the_scene_as_it_is():
    levels = {"snr_db": 40.0, "sir_db": -20.0, "seed": 3, "interference": False}
    alone, _ = simulate_preset("simulation-2-b", **levels)
    with_cars, observation = simulate_preset("simulation-2-b", num_cars=2, **levels)
    count = alone.scene.objects.num_paths
    groups = observation.truth.groups
    assert np.array_equal(with_cars.scene.objects.weights[:count], alone.scene.objects.weights)
    assert np.array_equal(with_cars.scene.objects.delays_s[:count], alone.scene.objects.delays_s)
    assert set(groups[:count]) == {-1}
    assert set(groups[count:]) == {0, 1}
    for car in (0, 1):
        ranges = 0.5 * 299_792_458.0 * with_cars.scene.objects.delays_s[groups == car]
        assert 3 <= len(ranges) <= 8
        assert np.ptp(ranges) < 4.5


def test_frames_of_a_sequence_know_their_cars():
    scenario, _ = simulate_preset(
        "extended-car", snr_db=40.0, sir_db=0.0, seed=1, interference=False, frame_number=1
    )
    assert max(scenario.scene.objects.groups) == 0
