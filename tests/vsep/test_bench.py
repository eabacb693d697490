from functools import partial

import numpy as np
import pytest

from tests.vsep.conftest import small_trial
from vsep import ButterworthFilter, InputError, RaisedCosineFilter, simulate_preset
from vsep.studies.study import Point
from vsep.studies.trial_scenario import preset_name, simulate_trial

trial = partial(small_trial, 3, ("factorised",))


def noise_of(observation):
    truth = observation.truth
    return observation.received - truth.object_signal - truth.interference_signal


@pytest.mark.parametrize(
    "changes",
    [
        {},
        {"scene": "simulation-2"},
        {"butterworth_order": 4, "interference_model": "convolution"},
        {"scene": "simulation-2", "interference_model": "convolution-with-edges"},
        {"scene": "simulation-2", "num_interferers": 2},
        {"interferer_slope_hz_per_s": 9.8e12},
    ],
)
def test_both_frames_have_the_same_objects_and_noise(changes):
    bench = simulate_trial(trial(**changes))
    interfered, clean = bench.interfered.truth, bench.clean.truth
    assert np.array_equal(interfered.object_signal, clean.object_signal)
    assert not np.any(clean.interference_signal)
    ratio = np.sum(np.abs(interfered.object_signal) ** 2)
    ratio /= np.sum(np.abs(interfered.interference_signal) ** 2)
    assert 10.0 * np.log10(ratio) == pytest.approx(-20.0, abs=1e-9)
    # The noise comes back as a difference of numbers up to 1e2 times larger.
    assert noise_of(bench.interfered) == pytest.approx(noise_of(bench.clean), abs=1e-12)


def test_the_scene_is_that_of_the_preset_of_the_same_seed():
    one = trial(scene="simulation-2", realization=1)
    bench = simulate_trial(one)
    _, observation = simulate_preset(
        "simulation-2-b", snr_db=30.0, sir_db=-20.0, seed=one.seed_sequence
    )
    assert bench.preset == "simulation-2-b"
    assert np.array_equal(bench.interfered.received, observation.received)


def test_the_sets_of_simulation_2_take_turns():
    point = Point(panel="a", scene="simulation-2", snr_db=60.0, sir_db=0.0)
    assert [preset_name(point, index)[-1] for index in range(4)] == ["a", "b", "c", "a"]


def test_the_estimators_assume_the_raised_cosine_whatever_shaped_the_bursts():
    bench = simulate_trial(trial(butterworth_order=8))
    true, assumed = bench.scenario.anti_aliasing_filter, bench.model.anti_aliasing_filter
    assert true == ButterworthFilter(cutoff_hz=2.55e6, order=8)
    assert assumed == RaisedCosineFilter(cutoff_hz=2.55e6, rolloff=0.25)


@pytest.mark.parametrize("realization", range(6))
def test_a_second_interferer_puts_a_second_burst_into_every_interfered_ramp(realization):
    one = simulate_trial(trial(scene="simulation-2", realization=realization))
    two = simulate_trial(trial(scene="simulation-2", realization=realization, num_interferers=2))
    first = [burst.ramp for burst in one.truth.bursts]
    both = [burst.ramp for burst in two.truth.bursts]
    assert both == sorted(first * 2)
    middles = {}
    for burst in two.truth.bursts:
        crossing_s = -burst.start_frequency_hz / burst.slope_hz_per_s
        middles.setdefault(burst.ramp, []).append(crossing_s * 5.1e6 / 128)
    apart = [abs(np.diff(pair)[0]) for pair in middles.values()]
    # Drawn from 15 to 35 % of a ramp; later ramps shift by 20 ns of slope, up to a tenth.
    assert min(apart) > 0.04
    assert max(apart) < 0.46


def test_two_chirps_of_the_second_interferer_make_three_bursts_on_both_sides_of_the_first():
    one = simulate_trial(trial(scene="simulation-2"))
    point = {"num_interferers": 2, "num_second_crossings": 2}
    three = simulate_trial(trial(scene="simulation-2", **point))
    first = {burst.ramp: burst for burst in one.truth.bursts}
    assert [burst.ramp for burst in three.truth.bursts] == sorted([*first] * 3)
    for ramp, alone in first.items():
        bursts = [burst for burst in three.truth.bursts if burst.ramp == ramp]
        crossings_s = [-burst.start_frequency_hz / burst.slope_hz_per_s for burst in bursts]
        own_s = -alone.start_frequency_hz / alone.slope_hz_per_s
        assert min(crossings_s) < own_s < max(crossings_s)
        # The two chirps of the second have one slope.
        assert len({round(burst.slope_hz_per_s) for burst in bursts}) == 2


def test_noise_frames_hold_noise_alone():
    small, large = simulate_trial(trial(scene="noise-1")), simulate_trial(trial(scene="noise-2"))
    assert small.interfered.received.shape == (1, 256)
    assert large.interfered.received.shape == (16, 128)
    assert len(large.truth.beats) == 0
    assert not np.any(large.truth.interference_signal)
    assert large.truth.bursts == ()
    other = simulate_trial(trial(scene="noise-2", realization=1))
    assert not np.array_equal(large.interfered.received, other.interfered.received)


def test_bounds_are_those_of_the_true_filter_and_unknown_interference_raises_them():
    unknown, known = simulate_trial(trial()).bounds()
    assert known.root_mean_crlb == pytest.approx(4.816e-5, abs=0.5e-8)
    assert 1.0 < unknown.root_mean_crlb / known.root_mean_crlb < 1.001
    nothing, same = simulate_trial(trial(scene="noise-1")).bounds()
    assert np.isnan(nothing.root_mean_crlb)
    assert np.isnan(same.root_mean_crlb)


@pytest.mark.parametrize("realization", range(3))
@pytest.mark.parametrize("count", [1, 5, 16])
def test_as_many_ramps_are_interfered_as_asked_for(realization, count):
    bench = simulate_trial(trial(realization, scene="simulation-2", num_interfered_ramps=count))
    assert [burst.ramp for burst in bench.truth.bursts] == list(range(count))


def test_more_ramps_than_there_are_cannot_be_interfered():
    with pytest.raises(InputError, match="num_interfered_ramps is 17"):
        simulate_trial(trial(scene="simulation-2", num_interfered_ramps=17))
