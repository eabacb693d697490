"""Objects that accelerate: one atom with a curvature in the place of a cluster of lines."""

import numpy as np
import pytest

from vsep.errors import InputError
from vsep.files.results import result_line
from vsep.inference.accelerating import AcceleratingSeparator
from vsep.inference.core.run import run
from vsep.inference.deviations import curvature_std, state_deviations
from vsep.inference.objects.object_only import ObjectOnlySeparator
from vsep.inference.registry import make_estimator
from vsep.presets.scenes import preset_radar, simulate_preset
from vsep.signal.chirped_atoms import (
    ChirpedPoint,
    best_chirped_point,
    chirped_products,
    chirped_signals,
    curvature_power,
)
from vsep.signal.filters import NoFilter
from vsep.signal.template import SignalModel
from vsep.units import wrap_frequency

SHAPE = 64, 128
MODEL = SignalModel(
    num_ramps=SHAPE[0], num_samples=SHAPE[1], sample_rate_hz=5e6, anti_aliasing_filter=NoFilter()
)


def noise(rng, shape=SHAPE):
    draws = rng.standard_normal((2, *shape)) / np.sqrt(2.0)
    return draws[0] + 1j * draws[1]


def five(seed, sweep_cells):
    """Five objects of 50 dB at least eight cells apart, and their frame."""
    rng = np.random.default_rng([5, seed])
    while True:
        points = np.stack([rng.uniform(-0.4, 0.4, 5), rng.uniform(-0.45, 0.45, 5)], axis=1)
        apart = abs(points[:, None] - points) @ np.array([SHAPE[1], SHAPE[0]])
        if (apart + 1e3 * np.eye(5)).min() > 8.0:
            break
    curvatures = sweep_cells / (2.0 * SHAPE[0] ** 2) * rng.choice([-1.0, 1.0], 5)
    weights = 10.0**2.5 * np.exp(2j * np.pi * rng.uniform(size=(5, 1)))
    points = np.column_stack([points, curvatures])
    received = chirped_signals(points, weights, SHAPE).sum(axis=0)[0] + noise(rng)
    return points, received


def estimated(received, acceleration="modelled"):
    return run(make_estimator("object-only", MODEL, acceleration=acceleration), received).state


def test_a_doppler_frequency_sweeps_as_many_cells_as_its_curvature_says():
    sweep = 3.0
    point = np.array([[0.0, 0.1, sweep / (2.0 * SHAPE[0] ** 2)]])
    signal = chirped_signals(point, np.ones((1, 1)), SHAPE)[0, 0, :, 0]
    turns = -np.diff(np.unwrap(np.angle(signal))) / (2.0 * np.pi) * SHAPE[0]
    # From the first difference to the last there are P - 2 ramps.
    assert turns[-1] - turns[0] == pytest.approx(sweep * (SHAPE[0] - 2) / SHAPE[0])
    assert turns.mean() == pytest.approx(0.1 * SHAPE[0])


@pytest.mark.parametrize("sweep_cells", [-2.6, 0.4, 1.0])
def test_the_search_finds_the_point_that_explains_all(sweep_cells):
    point = np.array([[0.123, 0.21, sweep_cells / (2.0 * SHAPE[0] ** 2)]])
    signals = chirped_signals(point, np.full((1, 1), 5.0), SHAPE)[0]
    found = best_chirped_point(0.1245, 0.2, signals, 3.5)
    assert np.array(found) == pytest.approx(point[0], abs=1e-9)
    assert abs(chirped_products(found, signals)) == pytest.approx(5.0)


def test_what_a_small_curvature_explains_is_told_without_looking_for_it():
    straight = ChirpedPoint(0.1, 0.2, 0.0)
    bent = np.array([[0.1, 0.2, 1e-6]])
    left = chirped_signals(bent, np.full((1, 1), 9.0), SHAPE)[0]
    left -= (
        chirped_products(straight, left)[0]
        * chirped_signals(np.array([straight]), np.ones((1, 1)), SHAPE)[0]
    )
    assert curvature_power(straight, left) == pytest.approx(np.sum(abs(left) ** 2), rel=1e-2)


@pytest.mark.parametrize("sweep_cells", [0.3, 1.0])
def test_five_objects_that_accelerate_are_five(sweep_cells):
    errors = []
    for seed in (0, 1, 3):
        points, received = five(seed, sweep_cells)
        state = estimated(received)
        assert state.objects.num_components == 5
        std, bent = state_deviations(state, SHAPE), curvature_std(state, SHAPE[0])
        for point in points:
            away = abs(wrap_frequency(state.objects.beats - point[0]))
            index = int(np.argmin(away + abs(wrap_frequency(state.objects.dopplers - point[1]))))
            errors.append(
                [
                    (state.objects.beats[index] - point[0]) / std.beats[index],
                    (state.objects.dopplers[index] - point[1]) / std.dopplers[index],
                    (state.objects.curvatures[index] - point[2]) / bent[index],
                ]
            )
    # Fifteen of each: a chi-square law of 15 degrees of freedom lies within [5.2, 32.8] in 99 %.
    squares = np.sum(np.square(errors), axis=0)
    assert np.all((squares > 5.0) & (squares < 33.0))


def test_without_the_option_nothing_is_there_and_objects_are_many():
    _, received = five(0, 1.0)
    assert type(make_estimator("object-only", MODEL)) is ObjectOnlySeparator
    assert estimated(received, "neglected").objects.num_components > 10
    assert estimated(received, "neglected").objects.curvatures is None


def test_objects_that_do_not_accelerate_are_what_they_are_without_the_option():
    _, received = five(1, 0.0)
    first, second = estimated(received, "neglected"), estimated(received)
    assert second.objects.curvatures is None
    assert np.array_equal(first.objects.beats, second.objects.beats)
    assert first.noise_precision == second.noise_precision


def test_the_preset_is_found_with_its_acceleration_under_bursts():
    scenario, observation = simulate_preset("braking", snr_db=55.0, sir_db=-10.0, seed=1)
    model = SignalModel.of_radar(scenario.radar, scenario.anti_aliasing_filter)
    estimator = make_estimator("factorised", model, acceleration="modelled")
    solution = run(estimator, observation.received)
    assert solution.objects.num_components == 5
    line = result_line("frame", solution, scenario.radar)
    off = [
        (abs(each["acceleration_mps2"]) - 10.0) / each["acceleration_std_mps2"]
        for each in line["objects"]
    ]
    assert max(np.abs(off)) < 4.0


def test_sequences_of_the_simulator_keep_the_acceleration_of_their_objects():
    scenario, observation = simulate_preset("braking", snr_db=40.0, sir_db=0.0, seed=1)
    found = scenario.radar.acceleration_from_curvature(observation.truth.curvatures)
    assert abs(found) == pytest.approx(np.full(5, 10.0))


def test_acceleration_beside_range_migration_is_refused():
    model = SignalModel.of_radar(preset_radar("moving-car"), NoFilter())
    with pytest.raises(InputError, match="stay in their range cells"):
        AcceleratingSeparator(inner=ObjectOnlySeparator(model=model))
    with pytest.raises(InputError, match="range_migration is on"):
        simulate_preset("moving-car", snr_db=40.0, sir_db=0.0, seed=1, acceleration_mps2=5.0)
