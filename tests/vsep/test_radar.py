"""Chirp sequences and the maps between axes and units."""

import dataclasses

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vsep.errors import InputError
from vsep.signal.radar import ChirpSequence, InterfererSequence

VALUES = {
    "start_frequency_hz": 79e9,
    "slope_hz_per_s": 1e13,
    "sample_rate_hz": 10.2e6,
    "ramp_period_s": 25e-6,
    "num_samples": 256,
    "num_ramps": 4,
}
INTERFERER_VALUES = {
    "start_frequency_hz": 79e9,
    "slope_hz_per_s": 9e12,
    "ramp_duration_s": 25e-6,
    "ramp_period_s": 30e-6,
    "num_ramps": 4,
}


def test_axes_follow_from_the_rates():
    radar = ChirpSequence(**VALUES)
    assert radar.shape == (4, 256)
    np.testing.assert_allclose(radar.sample_times_s[[0, 1, 255]], [0.0, 1 / 10.2e6, 255 / 10.2e6])
    np.testing.assert_allclose(radar.ramp_times_s, [0.0, 25e-6, 50e-6, 75e-6])


def test_object_of_simulation_1_stands_at_twelve_metres():
    radar = ChirpSequence(**VALUES)
    beat = radar.beat_from_delay(np.array([80.06e-9]))
    # 80.06 ns times 1e13 Hz/s over 10.2 MHz; half of it times the speed of light.
    np.testing.assert_allclose(beat, [0.8006 / 10.2], rtol=1e-12)
    np.testing.assert_allclose(radar.range_from_beat(beat), [12.0007], atol=1e-4)


@given(
    lowest=st.sampled_from([-1.0, -0.5, -0.25, 0.0]),
    position=st.floats(0.001, 0.999),
    slope=st.sampled_from([1e13, -2.9e13]),
)
def test_delay_survives_the_way_over_the_beat(lowest, position, slope):
    radar = ChirpSequence(**VALUES | {"slope_hz_per_s": slope, "lowest_beat": lowest})
    delay = np.array((lowest + position) * 10.2e6 / slope)
    # The beat may come back wrapped by whole cycles.
    for cycles in (-1, 0, 1):
        beat = radar.beat_from_delay(delay) + cycles
        np.testing.assert_allclose(radar.delay_from_beat(beat), delay, rtol=0, atol=1e-20)


def test_negative_slope_turns_the_beat_and_keeps_the_range():
    radar = ChirpSequence(**VALUES | {"slope_hz_per_s": -1e13})
    beat = radar.beat_from_delay(np.array(50e-9))
    assert beat < 0.0
    assert radar.range_from_beat(beat) == pytest.approx(50e-9 * 299_792_458 / 2)


def test_receding_object_has_positive_doppler_and_velocity():
    radar = ChirpSequence(**VALUES)
    # 10 m/s at 79 GHz: 2 v f_0 / c.
    doppler_hz = 2 * 10.0 * 79e9 / 299_792_458
    doppler = radar.doppler_from_hz(np.array(doppler_hz))
    assert doppler == pytest.approx(doppler_hz * 25e-6)
    assert radar.doppler_to_hz(doppler) == pytest.approx(doppler_hz)
    assert radar.velocity_from_doppler(doppler) == pytest.approx(10.0)


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("start_frequency_hz", 0.0),
        ("slope_hz_per_s", 0.0),
        ("slope_hz_per_s", float("nan")),
        ("sample_rate_hz", -5e6),
        ("sample_rate_hz", float("inf")),
        ("ramp_period_s", 0.0),
        ("num_samples", 7),
        ("num_ramps", 0),
        ("num_ramps", 10**6),
        ("lowest_beat", 0.5),
    ],
)
def test_impossible_radars_are_refused(name, value):
    with pytest.raises(InputError, match=rf"{name}\)? is .*must lie between"):
        ChirpSequence(**VALUES | {name: value})


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("start_frequency_hz", -1.0),
        ("slope_hz_per_s", float("inf")),
        ("ramp_duration_s", 0.0),
        ("ramp_period_s", float("nan")),
        ("num_ramps", 0),
        ("time_offset_s", 1e3),
    ],
)
def test_impossible_interferers_are_refused(name, value):
    with pytest.raises(InputError, match=rf"interferer .*{name}\)? is .*must lie between"):
        InterfererSequence(**INTERFERER_VALUES | {name: value})


def test_interferer_may_have_any_slope():
    for slope in (0.0, -1e13, 1e13):
        assert (
            InterfererSequence(**INTERFERER_VALUES | {"slope_hz_per_s": slope}).slope_hz_per_s
            == slope
        )


def test_radars_are_values():
    assert ChirpSequence(**VALUES) == ChirpSequence(**VALUES)
    assert hash(ChirpSequence(**VALUES)) == hash(ChirpSequence(**VALUES))
    with pytest.raises(dataclasses.FrozenInstanceError):
        ChirpSequence(**VALUES).num_ramps = 3
