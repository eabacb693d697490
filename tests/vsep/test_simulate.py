"""Simulated frames: levels, composition, and what is refused."""

import dataclasses

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vsep.errors import InputError
from vsep.presets.scenes import interferer_sequence, preset_radar
from vsep.signal.bursts import multiplicative_bursts
from vsep.signal.filters import NoFilter, RaisedCosineFilter
from vsep.signal.scene import Channel, Interferer, Scene
from vsep.signal.simulate import INTERFERENCE_MODELS, add_interference, simulate

RADAR = preset_radar("simulation-2-b")
FILTER = RaisedCosineFilter(cutoff_hz=RADAR.sample_rate_hz / 4)


def energy(signal):
    return float(np.sum(np.abs(signal) ** 2))


def channel(delays_s, dopplers_hz, weights):
    return Channel(
        delays_s=np.array(delays_s), dopplers_hz=np.array(dopplers_hz), weights=np.array(weights)
    )


OBJECTS = channel([20e-9, 100e-9], [-3e3, 1e3], [1.0, 0.1j])
INTERFERER = Interferer(
    sequence=interferer_sequence("simulation-2-b"), channel=channel([0.0], [0.0], [1.0])
)


def make(scene, seed=0, **options):
    options = {"anti_aliasing_filter": FILTER} | options
    return simulate(RADAR, scene, rng=np.random.default_rng(seed), **options)


def test_object_signal_is_the_sum_of_unit_norm_atoms():
    truth = make(Scene(objects=OBJECTS, snr_db=30.0)).truth
    expected = np.zeros(RADAR.shape, dtype=complex)
    for ramp in range(16):
        for sample in range(128):
            for delay, doppler, weight in ((20e-9, -3e3, 1.0), (100e-9, 1e3, 0.1j)):
                turns = 1e13 * delay * sample / 5.1e6 + doppler * 25e-6 * ramp
                expected[ramp, sample] += weight / np.sqrt(16 * 128) * np.exp(-2j * np.pi * turns)
    # A hundred turns carry 100 * 2 pi * 2e-16 relative to a magnitude of 0.02.
    np.testing.assert_allclose(truth.object_signal, expected, rtol=0, atol=1e-14)
    np.testing.assert_allclose(truth.beats, [20e-9 * 1e13 / 5.1e6, 100e-9 * 1e13 / 5.1e6])
    np.testing.assert_allclose(truth.dopplers, [-0.075, 0.025])
    np.testing.assert_array_equal(truth.amplitudes, [1.0, 0.1j])


def test_frequencies_of_the_truth_are_wrapped():
    far = channel([0.75 * 5.1e6 / 1e13], [-0.5 / 25e-6], [1.0])
    truth = make(Scene(objects=far, snr_db=30.0)).truth
    np.testing.assert_allclose(truth.beats, [-0.25], atol=1e-12)
    np.testing.assert_allclose(truth.dopplers, [-0.5], atol=1e-12)


@given(sir_db=st.floats(-60.0, 60.0), snr_db=st.floats(-20.0, 120.0))
def test_levels_are_those_asked_for(sir_db, snr_db):
    truth = make(
        Scene(objects=OBJECTS, interferers=(INTERFERER,), snr_db=snr_db, sir_db=sir_db)
    ).truth
    ratio = energy(truth.object_signal) / energy(truth.interference_signal)
    assert 10 * np.log10(ratio) == pytest.approx(sir_db, abs=1e-9)
    snr = truth.noise_precision * energy(truth.object_signal)
    assert 10 * np.log10(snr) == pytest.approx(snr_db, abs=1e-9)


def test_noise_is_white_and_circular_with_the_precision_of_the_truth():
    frames = [make(Scene(objects=OBJECTS, snr_db=10.0), seed) for seed in range(50)]
    precision = frames[0].truth.noise_precision
    noise = np.array([frame.received - frame.truth.object_signal for frame in frames])
    count = noise.size
    # The mean of `count` unit exponentials has the standard deviation 1/sqrt(count); five of them
    # are exceeded once in two million. The others are complex means of unit variance.
    limit = 5 / np.sqrt(count)
    assert abs(precision * np.mean(np.abs(noise) ** 2) - 1.0) < limit
    assert abs(precision * np.mean(noise**2)) < limit * np.sqrt(2)
    assert abs(np.sqrt(precision) * np.mean(noise)) < limit
    assert abs(precision * np.mean(noise[:, :, 1:] * noise[:, :, :-1].conj())) < limit
    assert abs(precision * np.mean(noise[:, 1:] * noise[:, :-1].conj())) < limit


def test_frame_is_the_sum_of_its_parts():
    scene = Scene(objects=OBJECTS, interferers=(INTERFERER,), snr_db=200.0, sir_db=-10.0)
    observation = make(scene)
    truth = observation.truth
    rest = observation.received - truth.object_signal - truth.interference_signal
    # At 200 dB the noise lies 1e-10 under the objects, far over the rounding errors.
    assert energy(rest) * truth.noise_precision == pytest.approx(rest.size, rel=0.2)


def test_noise_does_not_depend_on_the_interference():
    scene = {"objects": OBJECTS, "snr_db": 20.0}
    clean = make(Scene(**scene))
    burst = make(Scene(**scene, interferers=(INTERFERER,), sir_db=-20.0))
    difference = burst.received - burst.truth.interference_signal - clean.received
    largest = np.abs(burst.truth.interference_signal).max()
    assert np.abs(difference).max() <= 4 * np.finfo(float).eps * largest


def test_interferers_add_with_the_levels_of_their_weights():
    strong = Interferer(sequence=INTERFERER.sequence, channel=channel([0.0], [0.0], [2.0]))
    other = Interferer(
        sequence=interferer_sequence("simulation-2-c", time_offset_s=0.2e-6),
        channel=channel([0.0], [0.0], [1.0]),
    )
    scene = Scene(objects=OBJECTS, interferers=(strong, other), snr_db=20.0, sir_db=0.0)
    truth = make(scene).truth
    expected = 2 * multiplicative_bursts(RADAR, INTERFERER, FILTER)
    expected += multiplicative_bursts(RADAR, other, FILTER)
    expected *= np.sqrt(energy(truth.object_signal) / energy(expected))
    np.testing.assert_allclose(truth.interference_signal, expected, rtol=0, atol=1e-14)
    assert [burst.ramp for burst in truth.bursts] == sorted([0, 2, 4, 6, *range(8)])


def test_interferer_beyond_the_band_leaves_the_frame_clean():
    far = interferer_sequence("simulation-2-b", time_offset_s=12e-6)
    scene = Scene(
        objects=OBJECTS,
        interferers=(Interferer(sequence=far, channel=channel([0.0], [0.0], [1.0])),),
        snr_db=20.0,
        sir_db=-40.0,
    )
    truth = make(scene).truth
    assert not np.any(truth.interference_signal)
    assert truth.bursts == ()
    assert not np.any(truth.interfered_samples())


def test_scene_without_objects_has_unit_reference_energy():
    empty = channel([], [], [])
    scene = Scene(objects=empty, interferers=(INTERFERER,), snr_db=20.0, sir_db=10.0)
    truth = make(scene).truth
    assert truth.noise_precision == pytest.approx(100.0)
    assert energy(truth.interference_signal) == pytest.approx(0.1)
    assert not np.any(truth.object_signal)


def test_arrays_of_an_observation_are_read_only():
    observation = make(Scene(objects=OBJECTS, snr_db=20.0))
    truth = observation.truth
    arrays = (observation.received, truth.object_signal, truth.interference_signal, truth.beats)
    assert not any(array.flags.writeable for array in arrays)


@pytest.mark.parametrize("model", INTERFERENCE_MODELS)
def test_every_model_makes_the_same_bursts_of_a_direct_path(model):
    scene = Scene(objects=OBJECTS, interferers=(INTERFERER,), snr_db=20.0, sir_db=-20.0)
    reference = make(scene).truth.interference_signal
    burst = make(scene, interference_model=model).truth.interference_signal
    similarity = abs(np.vdot(reference, burst)) / np.sqrt(energy(reference) * energy(burst))
    # Set b: the interferer's ramp ends 0.1 us after the victim's and its edges change the burst by
    # less than a tenth of a percent of its energy, -30 dB.
    assert similarity > 1 - 1e-3


def test_unknown_model_and_powerless_objects_are_refused():
    scene = Scene(objects=OBJECTS, snr_db=20.0)
    with pytest.raises(InputError, match="interference model is 'exact'; it must be one of multi"):
        make(scene, interference_model="exact")
    with pytest.raises(InputError, match="no energy"):
        make(Scene(objects=channel([1e-8], [0.0], [0.0]), snr_db=20.0))


def test_bursts_are_added_to_a_frame_at_the_level_asked_for():
    rng = np.random.default_rng(4)
    frame = rng.standard_normal(RADAR.shape) + 1j * rng.standard_normal(RADAR.shape)
    observation = add_interference(
        RADAR, frame, [INTERFERER], sir_db=-13.0, anti_aliasing_filter=FILTER
    )
    truth = observation.truth
    np.testing.assert_array_equal(truth.object_signal, frame)
    np.testing.assert_array_equal(observation.received, frame + truth.interference_signal)
    ratio = energy(frame) / energy(truth.interference_signal)
    assert 10 * np.log10(ratio) == pytest.approx(-13.0, abs=1e-9)
    assert [burst.ramp for burst in truth.bursts] == [0, 2, 4, 6]
    assert truth.beats.size == truth.dopplers.size == truth.amplitudes.size == 0
    assert np.isnan(truth.noise_precision)
    assert frame.flags.writeable


@pytest.mark.parametrize(
    ("frame", "sir_db", "message"),
    [
        (np.ones((3, 128)), 0.0, r"shape \(3, 128\); it must be \(16, 128\)"),
        (np.full((16, 128), np.nan), 0.0, "NaN"),
        (np.zeros((16, 128)), 0.0, "zero everywhere"),
        (np.ones((16, 128)), 300.0, "SIR is 300 dB"),
    ],
)
def test_unusable_frames_are_refused(frame, sir_db, message):
    with pytest.raises(InputError, match=message):
        add_interference(RADAR, frame, [INTERFERER], sir_db=sir_db, anti_aliasing_filter=NoFilter())


@pytest.mark.benchmark
def test_speed_of_a_frame_of_64_ramps(benchmark):
    radar = dataclasses.replace(RADAR, num_ramps=64, num_samples=256)
    sequence = dataclasses.replace(INTERFERER.sequence, num_ramps=64)
    delays_s = np.linspace(0.0, 127e-9, 10)
    interferer = Interferer(sequence=sequence, channel=channel(delays_s, np.zeros(10), np.ones(10)))
    scene = Scene(objects=OBJECTS, interferers=(interferer,), snr_db=20.0)
    benchmark(simulate, radar, scene, anti_aliasing_filter=FILTER, rng=np.random.default_rng(0))
    assert benchmark.stats is None or benchmark.stats["mean"] < 0.3
