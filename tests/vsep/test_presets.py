"""The scenes of Table I."""

import numpy as np
import pytest

from vsep.errors import InputError
from vsep.presets.registry import PRESET_NAMES
from vsep.presets.scenes import interferer_sequence, preset, preset_radar, simulate_preset
from vsep.signal.filters import ButterworthFilter

SIMULATIONS = [name for name in PRESET_NAMES if name.startswith("simulation-")]
SIMULATION_2 = SIMULATIONS[1:]
# f_I in GHz, k_I in 10^3 GHz/s, T_swI and T_pI in us, P_I.
TABLE_1 = {
    "simulation-1": (79.01, 9.2, 25.0, 25.0, 1),
    "simulation-2-a": (79.002, 9.8321, 25.02, 75.01, 2),
    "simulation-2-b": (79.004, 9.7122, 25.02, 50.01, 4),
    "simulation-2-c": (79.008, 9.3925, 25.02, 25.02, 8),
}
LEVELS = {"snr_db": 60.0, "sir_db": -20.0}


@pytest.mark.parametrize("name", SIMULATIONS)
def test_interferers_are_those_of_table_1(name):
    sequence = interferer_sequence(name)
    values = (
        sequence.start_frequency_hz / 1e9,
        sequence.slope_hz_per_s / 1e12,
        sequence.ramp_duration_s / 1e-6,
        sequence.ramp_period_s / 1e-6,
        sequence.num_ramps,
    )
    assert values == pytest.approx(TABLE_1[name], rel=1e-12)
    assert sequence.time_offset_s == 0.0


def test_the_preset_of_the_measurements_has_the_radars_of_table_1():
    victim, other = preset_radar("measurement"), interferer_sequence("measurement")
    assert (victim.shape, victim.sample_rate_hz, victim.ramp_period_s) == ((32, 256), 40e6, 44e-6)
    assert (victim.start_frequency_hz, victim.slope_hz_per_s) == (76.2e9, 2.08e13)
    assert (other.start_frequency_hz, other.slope_hz_per_s) == (76.1e9, 2.6923e13)
    assert (other.ramp_duration_s, other.ramp_period_s, other.num_ramps) == (26e-6, 25e-6, 8)
    _, observation = simulate_preset("measurement", **LEVELS, seed=1)
    # 4 x 44 us are 7 x 25 us and one more: 27 MHz later, at the end of the ramp.
    assert [burst.ramp for burst in observation.truth.bursts] == [0, 4]
    first = observation.truth.bursts[0]
    # In the middle of the 6.4 us of a ramp it crosses zero.
    assert first.start_frequency_hz == pytest.approx(-first.slope_hz_per_s * 3.2e-6, abs=1.0)


def test_victims_are_those_of_table_1():
    first, second = preset_radar("simulation-1"), preset_radar("simulation-2-c")
    assert (first.shape, first.sample_rate_hz) == ((1, 256), 10.2e6)
    assert (second.shape, second.sample_rate_hz) == ((16, 128), 5.1e6)
    for radar in (first, second):
        assert radar.start_frequency_hz == 79e9
        assert radar.slope_hz_per_s == 1e13
        assert radar.ramp_period_s == 25e-6


def test_simulation_1_has_one_object_and_a_direct_path():
    scene = preset("simulation-1", **LEVELS, rng=np.random.default_rng(3)).scene
    (interferer,) = scene.interferers
    np.testing.assert_array_equal(scene.objects.delays_s, [80.06e-9])
    np.testing.assert_array_equal(scene.objects.dopplers_hz, [0.0])
    np.testing.assert_array_equal(interferer.channel.delays_s, [0.0])
    for channel in (scene.objects, interferer.channel):
        np.testing.assert_allclose(np.abs(channel.weights), 1.0, rtol=1e-12)
        assert abs(channel.weights[0].imag) > 0.0


@pytest.mark.parametrize("name", SIMULATION_2)
def test_simulation_2_draws_from_the_intervals_of_table_1(name):
    speed_of_light = 299_792_458.0
    drawn = [preset(name, **LEVELS, rng=np.random.default_rng(seed)).scene for seed in range(100)]
    delays = np.array([scene.objects.delays_s for scene in drawn])
    dopplers = np.array([scene.objects.dopplers_hz for scene in drawn])
    weights = np.array([scene.objects.weights for scene in drawn])
    excess = 20 * np.log10(np.abs(weights)) + 40 * np.log10(delays * speed_of_light + 1)
    paths = [scene.interferers[0].channel for scene in drawn]
    path_delays = np.array([channel.delays_s for channel in paths])
    path_weights = np.array([channel.weights for channel in paths])
    assert delays.shape == path_delays.shape == (100, 10)
    np.testing.assert_array_equal(path_delays[:, 0], 0.0)
    np.testing.assert_allclose(np.abs(path_weights[:, 0]), 1.0, rtol=1e-12)
    path_excess = 20 * np.log10(np.abs(path_weights)) + 20 * np.log10(
        path_delays * speed_of_light + 1
    )
    # All within the interval, and of 900 draws one within a hundredth of either end: missed with
    # the probability 0.99^900 = 1e-4 each, for seeds that do not change.
    for values, low, high in (
        (delays, 3.97e-9, 127e-9),
        (dopplers, -5e3, 5e3),
        (excess, -3.0, 3.0),
        (path_delays[:, 1:], 3.97e-9, 127e-9),
        (path_excess[:, 1:], -10.0, 0.0),
        (np.angle(weights), -np.pi, np.pi),
        (np.angle(path_weights), -np.pi, np.pi),
    ):
        width = high - low
        assert low - 1e-9 * width <= values.min() < low + 0.01 * width
        assert high - 0.01 * width < values.max() <= high + 1e-9 * width


@pytest.mark.parametrize(
    ("name", "share"),
    [("simulation-2-a", 0.75), ("simulation-2-b", 0.44), ("simulation-2-c", 0.21)],
)
def test_share_of_interfered_samples_in_an_interfered_ramp(name, share):
    # The filter that the paper leaves open reproduces the shares known for its scenes: samples of
    # a direct burst whose course lies in the pass band, the taper included.
    scenario, observation = simulate_preset(name, **LEVELS, seed=0)
    radar, edge = scenario.radar, scenario.anti_aliasing_filter.outer_hz
    for burst in observation.truth.bursts:
        course = burst.start_frequency_hz + burst.slope_hz_per_s * radar.sample_times_s
        # One sample of 128 is 0.008.
        assert np.mean(np.abs(course) <= edge) == pytest.approx(share, abs=0.01)


@pytest.mark.parametrize("name", PRESET_NAMES)
def test_one_seed_makes_one_frame(name):
    first = simulate_preset(name, **LEVELS, seed=5)[1]
    second = simulate_preset(name, **LEVELS, seed=5)[1]
    other = simulate_preset(name, **LEVELS, seed=6)[1]
    np.testing.assert_array_equal(first.received, second.received)
    assert np.abs(first.received - other.received).max() > 0.0


def test_frames_of_a_sequence_have_moved_objects_and_noise_of_their_own():
    first, second, third = (
        simulate_preset("simulation-2-a", **LEVELS, seed=5, frame_number=number)
        for number in range(3)
    )
    start, later = first[0].scene.objects, third[0].scene.objects
    moved = start.delays_s + 2 * 0.05 * start.dopplers_hz / 79e9
    np.testing.assert_allclose(later.delays_s, moved, rtol=1e-12)
    np.testing.assert_array_equal(later.dopplers_hz, start.dopplers_hz)
    bursts = [o.truth.interference_signal for _, o in (first, second)]
    noises = [
        o.received - o.truth.object_signal - o.truth.interference_signal
        for _, o in (first, second, third)
    ]
    # The SIR holds in every frame, so that the level of the bursts follows that of the objects.
    np.testing.assert_allclose(*(burst / np.linalg.norm(burst) for burst in bursts), atol=1e-14)
    # Of two independent noises the correlation is at most 4 / sqrt(2048), one time in 10^7.
    for one, other in ((0, 1), (1, 2)):
        norm = np.linalg.norm(noises[one]) * np.linalg.norm(noises[other])
        assert abs(np.vdot(noises[one], noises[other])) / norm < 4 / np.sqrt(2048)
    direct = simulate_preset("simulation-2-a", **LEVELS, seed=5)[1]
    np.testing.assert_array_equal(first[1].received, direct.received)


def test_seed_sequence_is_not_used_up():
    seed = np.random.SeedSequence(7, spawn_key=(2, 3))
    first = simulate_preset("simulation-1", **LEVELS, seed=seed)[1]
    second = simulate_preset("simulation-1", **LEVELS, seed=seed)[1]
    np.testing.assert_array_equal(first.received, second.received)
    parent = simulate_preset("simulation-1", **LEVELS, seed=7)[1]
    assert np.abs(first.received - parent.received).max() > 0.0


@pytest.mark.parametrize("name", PRESET_NAMES)
def test_interference_changes_neither_objects_nor_noise(name):
    _, burst = simulate_preset(name, **LEVELS, seed=8)
    scenario, clean = simulate_preset(name, **LEVELS, seed=8, interference=False)
    assert scenario.scene.interferers == ()
    np.testing.assert_array_equal(burst.truth.object_signal, clean.truth.object_signal)
    difference = burst.received - burst.truth.interference_signal - clean.received
    largest = np.abs(burst.truth.interference_signal).max()
    assert np.abs(difference).max() <= 4 * np.finfo(float).eps * largest
    assert not np.any(clean.truth.interference_signal)


def test_levels_change_neither_scene_nor_noise():
    _, first = simulate_preset("simulation-2-a", snr_db=60.0, sir_db=0.0, seed=9)
    _, second = simulate_preset("simulation-2-a", snr_db=40.0, sir_db=20.0, seed=9)
    np.testing.assert_array_equal(first.truth.object_signal, second.truth.object_signal)
    np.testing.assert_allclose(
        second.truth.interference_signal, 0.1 * first.truth.interference_signal, atol=1e-14
    )
    noises = [
        item.received - item.truth.object_signal - item.truth.interference_signal
        for item in (first, second)
    ]
    # Rounding of the burst's magnitude, below 1, against noise of 1e-4.
    np.testing.assert_allclose(noises[1], 10 * noises[0], rtol=0, atol=1e-14)


@pytest.mark.parametrize("name", SIMULATIONS)
@pytest.mark.parametrize("slope", [5e12, 9.9e12, 14e12, 30e12])
def test_another_slope_keeps_the_first_crossing(name, slope):
    radar = preset_radar(name)
    own, moved = (interferer_sequence(name), interferer_sequence(name, slope_hz_per_s=slope))
    crossings = [
        (
            sequence.slope_hz_per_s * sequence.time_offset_s
            - (sequence.start_frequency_hz - radar.start_frequency_hz)
        )
        / (sequence.slope_hz_per_s - radar.slope_hz_per_s)
        for sequence in (own, moved)
    ]
    # Carriers of 8e10 Hz are right to 1e-5 Hz, 1e-16 s at 1e11 Hz/s.
    assert crossings[1] == pytest.approx(crossings[0], abs=1e-15)
    assert 0.0 < crossings[0] < radar.sample_times_s[-1]
    truth = simulate_preset(name, **LEVELS, seed=1, interferer_slope_hz_per_s=slope)[1].truth
    assert truth.bursts[0].ramp == 0
    assert truth.bursts[0].slope_hz_per_s == pytest.approx(slope - radar.slope_hz_per_s)


def test_time_offset_moves_the_crossing():
    name = "simulation-2-b"
    early = simulate_preset(name, **LEVELS, seed=1)[1].truth.bursts[0]
    late = simulate_preset(name, **LEVELS, seed=1, time_offset_s=0.1e-6)[1].truth.bursts[0]
    shift = late.start_frequency_hz - early.start_frequency_hz
    assert shift == pytest.approx(-0.1e-6 * 9.7122e12, rel=1e-6)


def test_chosen_filter_shapes_the_bursts():
    chosen = ButterworthFilter(cutoff_hz=1.275e6, order=4)
    own = simulate_preset("simulation-2-a", **LEVELS, seed=1)
    other = simulate_preset("simulation-2-a", **LEVELS, seed=1, anti_aliasing_filter=chosen)
    assert own[0].anti_aliasing_filter.cutoff_hz == 5.1e6 / 4
    assert own[0].anti_aliasing_filter.rolloff == 0.25
    assert other[0].anti_aliasing_filter is chosen
    bursts = [item[1].truth.interference_signal for item in (own, other)]
    assert np.abs(bursts[0] - bursts[1]).max() > 0.01 * np.abs(bursts[0]).max()


def test_unknown_names_and_negative_seeds_are_refused():
    with pytest.raises(
        InputError, match="preset is 'simulation-3'; it must be one of simulation-1"
    ):
        preset("simulation-3", **LEVELS, rng=np.random.default_rng(0))
    with pytest.raises(InputError, match="seed is -1"):
        simulate_preset("simulation-1", **LEVELS, seed=-1)
    with pytest.raises(InputError, match="SNR is nan"):
        simulate_preset("simulation-1", snr_db=float("nan"), sir_db=0.0, seed=0)


def test_a_second_interferer_leaves_the_first_the_objects_and_the_noise():
    levels = {"snr_db": 60.0, "sir_db": -20.0, "seed": 4}
    alone, one = simulate_preset("simulation-2-b", **levels)
    both, two = simulate_preset("simulation-2-b", second_interferer=True, **levels)
    first, second = both.scene.interferers
    assert first.sequence == alone.scene.interferers[0].sequence
    assert np.array_equal(first.channel.weights, alone.scene.interferers[0].channel.weights)
    assert np.array_equal(one.truth.object_signal, two.truth.object_signal)
    for observation in (one, two):
        truth = observation.truth
        rest = observation.received - truth.object_signal - truth.interference_signal
        assert np.std(rest) == pytest.approx(truth.noise_precision**-0.5, rel=0.05)
    slope = preset_radar("simulation-2-b").slope_hz_per_s
    factor = (second.sequence.slope_hz_per_s - slope) / (first.sequence.slope_hz_per_s - slope)
    assert 1.2 <= factor <= 2.0
    ramps = [burst.ramp for burst in two.truth.bursts]
    assert set(ramps) == {burst.ramp for burst in one.truth.bursts}
    assert len(ramps) == 2 * len(set(ramps))
    _, none = simulate_preset(
        "simulation-2-b", second_interferer=True, interference=False, **levels
    )
    assert not none.truth.interference_signal.any()
