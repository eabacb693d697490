"""Bursts of one interferer against direct formulas and against integrals over time."""

import dataclasses

import numpy as np
import pytest

from vsep.errors import InputError
from vsep.presets.scenes import interferer_sequence, preset_radar
from vsep.signal.bursts import (
    convolved_bursts,
    crossings,
    multiplicative_bursts,
    overlapping_passages,
    true_bursts,
)
from vsep.signal.filters import ButterworthFilter, NoFilter, RaisedCosineFilter
from vsep.signal.radar import InterfererSequence
from vsep.signal.scene import Channel, Interferer

RADAR = preset_radar("simulation-2-a")
FILTER = RaisedCosineFilter(cutoff_hz=1.275e6, rolloff=0.25)


def paths(delays_s=(0.0,), dopplers_hz=(0.0,), weights=(1.0,)):
    return Channel(
        delays_s=np.array(delays_s), dopplers_hz=np.array(dopplers_hz), weights=np.array(weights)
    )


def direct(sequence):
    return Interferer(sequence=sequence, channel=paths())


def parallel(offset_hz, **changes):
    values = {
        "start_frequency_hz": 79e9 + offset_hz,
        "slope_hz_per_s": 1e13,
        "ramp_duration_s": 60e-6,
        "ramp_period_s": 100e-6,
        "num_ramps": 1,
        "time_offset_s": -10e-6,
    }
    return InterfererSequence(**(values | changes))


def error_db(signal, reference):
    return 10 * np.log10(np.sum(np.abs(signal - reference) ** 2) / np.sum(np.abs(reference) ** 2))


@pytest.mark.parametrize("name", ["simulation-1", "simulation-2-a", "simulation-2-b"])
def test_convolution_of_the_direct_path_equals_the_multiplicative_model(name):
    radar, interferer = preset_radar(name), direct(interferer_sequence(name))
    filters = [
        RaisedCosineFilter(cutoff_hz=radar.sample_rate_hz / 4),
        *(ButterworthFilter(cutoff_hz=radar.sample_rate_hz / 4, order=n) for n in (2, 4, 8)),
    ]
    for anti_aliasing_filter in filters:
        multiplied = multiplicative_bursts(radar, interferer, anti_aliasing_filter)
        convolved = convolved_bursts(radar, interferer, anti_aliasing_filter, with_edges=False)
        # The requirement of the project.
        assert error_db(multiplied, convolved) <= -90.0


def test_multiplicative_burst_by_the_formulas_of_the_paper():
    sequence = interferer_sequence("simulation-2-b")
    interferer = Interferer(
        sequence=sequence, channel=paths((0.0, 50e-9), (0.0, 700.0), (1.0, 0.3 - 0.2j))
    )
    signal = multiplicative_bursts(RADAR, interferer, FILTER)
    # Ramp 4 of the victim meets ramp 2 of the interferer: (38)-(41), scalar by scalar.
    f_i, k_i, f_0, k = 79.004e9, 9.7122e12, 79e9, 1e13
    t_0 = 25e-6 * 4 - 50.01e-6 * 2
    for sample in (0, 40, 71, 127):
        t = sample / 5.1e6
        course = f_i + k_i * t_0 - f_0 + (k_i - k) * t
        chirp = np.exp(1j * (2 * np.pi * (f_i - f_0 + k_i * t_0) * t + np.pi * (k_i - k) * t**2))
        constant = np.exp(1j * (2 * np.pi * f_i * t_0 + np.pi * k_i * t_0**2))
        frequency = f_i + k_i * (t + t_0)
        channel = 1.0 + (0.3 - 0.2j) * np.exp(
            -2j * np.pi * (frequency * 50e-9 + 700.0 * 50.01e-6 * 2)
        )
        envelope = FILTER.modified_response(np.array(course), k_i - k)
        # Phases of some 4e3 turns, f_I times 50 ns, carry 4e3 * 2 pi * 2e-16 = 5e-12.
        assert abs(signal[4, sample] - chirp * constant * channel * envelope) < 1e-10
    assert not np.any(signal[[1, 3, 5, 7, 8]])


@pytest.mark.parametrize("with_edges", [False, True])
def test_convolution_equals_the_integral_over_the_impulse_response(with_edges):
    radar = preset_radar("simulation-1")
    duration = 14.003e-6
    course = interferer_sequence("simulation-1")
    sequence = dataclasses.replace(course, ramp_duration_s=duration, ramp_period_s=50e-6)
    anti_aliasing_filter = ButterworthFilter(cutoff_hz=2.55e6, order=2)
    signal = convolved_bursts(radar, direct(sequence), anti_aliasing_filter, with_edges=with_edges)
    corner = 2 * np.pi * 2.55e6 / 3**0.25
    # Simpson's rule on 4 us of g(t) = sqrt2 w exp(-w t / sqrt2) sin(w t / sqrt2).
    lag = np.linspace(0.0, 4e-6, 40_001)
    impulse = (
        np.sqrt(2) * corner * np.exp(-corner * lag / np.sqrt(2)) * np.sin(corner * lag / np.sqrt(2))
    )
    simpson = np.where(np.arange(40_001) % 2, 4.0, 2.0) * (lag[1] / 3)
    simpson[[0, -1]] /= 2
    for sample in (5, 90, 128, 142, 145, 170):
        time = sample / 10.2e6 - lag
        on = (time >= 0.0) & (time <= duration) if with_edges else True
        chirp = np.exp(2j * np.pi * (10e6 * time - 0.4e12 * time**2))
        expected = np.sum(simpson * impulse * chirp * on)
        # Without edges both are exact. An edge is spread over one of the 81.6 MHz cells: of its
        # response, up to 0.3, (2 pi 2.55e6 / 81.6e6)^2 / 12 = 3e-3 is lost, and Simpson's rule
        # places it within half a step of 0.1 ns, w * 0.05e-9 = 1e-3 of the response.
        assert abs(signal[0, sample] - expected) < (2e-3 if with_edges else 1e-9)


def test_delayed_path_crosses_later_in_the_convolution():
    # A path of delay tau is the direct burst of an interferer that starts tau later, up to the
    # phase pi k_I tau^2 that (33) neglects.
    delay = 100e-9
    slope = 9.7122e12
    sequence = interferer_sequence("simulation-2-b")
    late = interferer_sequence("simulation-2-b", time_offset_s=delay)
    delayed = convolved_bursts(
        RADAR, Interferer(sequence=sequence, channel=paths((delay,))), FILTER, with_edges=False
    )
    moved = convolved_bursts(RADAR, direct(late), FILTER, with_edges=False)
    assert error_db(delayed, moved * np.exp(-1j * np.pi * slope * delay**2)) <= -90.0


def test_parallel_interferer_makes_a_tone_of_the_filter_gain():
    frequency = 1.1e6
    signal = convolved_bursts(RADAR, direct(parallel(frequency)), FILTER, with_edges=False)
    # The interferer starts 10 us before ramp 0, at a course of f + k_I * 10 us; ramps 0 and 1 lie
    # within its 60 us. Its phase at the start of ramp 0 is that of (39).
    age = 10e-6
    course = frequency + 1e13 * age
    assert course > 2 * FILTER.cutoff_hz
    assert not np.any(signal)
    inside = parallel(frequency - 1e13 * age)
    signal = convolved_bursts(RADAR, direct(inside), FILTER, with_edges=False)
    time = RADAR.sample_times_s
    start = inside.start_frequency_hz
    constant = np.exp(2j * np.pi * (start * age + 0.5e13 * age**2))
    gain = FILTER.response(np.array(frequency))
    expected = gain * constant * np.exp(2j * np.pi * frequency * time)
    # What the filter remembers from more than a ramp ago is left out: its impulse response falls
    # as 1 / (2 pi W^2 B t^3) with W = 0.64 MHz, 1e-5 at 25 us; half of that is out of phase.
    np.testing.assert_allclose(signal[0], expected, rtol=0, atol=1e-5)


def test_parallel_interferer_is_refused_by_the_multiplicative_model():
    with pytest.raises(InputError, match=r"slope is 1e\+13 Hz/s.*multiplicative model"):
        multiplicative_bursts(RADAR, direct(parallel(0.0)), FILTER)


@pytest.mark.parametrize("with_edges", [False, True])
def test_without_filter_the_chirp_is_sampled_as_it_is(with_edges):
    interferer = direct(interferer_sequence("simulation-2-a"))
    multiplied = multiplicative_bursts(RADAR, interferer, NoFilter())
    convolved = convolved_bursts(RADAR, interferer, NoFilter(), with_edges=with_edges)
    np.testing.assert_allclose(np.abs(multiplied[[0, 3]]), 1.0, rtol=0, atol=1e-12)
    # Within the ramp; where it switches on or off the last samples may be half a cell.
    np.testing.assert_allclose(convolved[[0, 3], 2:-2], multiplied[[0, 3], 2:-2], rtol=0, atol=1e-9)


def test_interferer_out_of_the_band_makes_no_burst():
    far = parallel(0.0, start_frequency_hz=79.5e9, slope_hz_per_s=9.9e12)
    assert not np.any(multiplicative_bursts(RADAR, direct(far), FILTER))
    assert not np.any(convolved_bursts(RADAR, direct(far), FILTER, with_edges=True))
    assert true_bursts(RADAR, far, FILTER) == ()


@pytest.mark.parametrize(
    ("name", "ramps"),
    [
        ("simulation-1", [0]),
        ("simulation-2-a", [0, 3]),
        ("simulation-2-b", [0, 2, 4, 6]),
        ("simulation-2-c", [0, 1, 2, 3, 4, 5, 6, 7]),
    ],
)
def test_bursts_of_the_presets_lie_in_the_ramps_of_table_1(name, ramps):
    radar, sequence = preset_radar(name), interferer_sequence(name)
    anti_aliasing_filter = RaisedCosineFilter(cutoff_hz=radar.sample_rate_hz / 4)
    bursts = true_bursts(radar, sequence, anti_aliasing_filter)
    assert [burst.ramp for burst in bursts] == ramps
    for index, burst in enumerate(bursts):
        offset = radar.ramp_period_s * burst.ramp - sequence.ramp_period_s * index
        start = sequence.start_frequency_hz - 79e9 + sequence.slope_hz_per_s * offset
        # The difference of carriers of 8e10 Hz is right to 1e-5 Hz.
        assert burst.start_frequency_hz == pytest.approx(start, abs=1e-3)
        assert burst.slope_hz_per_s == pytest.approx(sequence.slope_hz_per_s - 1e13)


def test_passages_equal_a_search_over_all_pairs():
    radar = dataclasses.replace(RADAR, ramp_period_s=31e-6, num_ramps=9)
    timing = {"ramp_duration_s": 9e-6, "ramp_period_s": 11e-6, "time_offset_s": 23e-6}
    sequence = parallel(0.0, slope_hz_per_s=7e12, num_ramps=17, **timing)
    passages = overlapping_passages(radar, sequence)
    expected = [
        (ramp, other)
        for ramp in range(9)
        for other in range(17)
        if 23e-6 + 11e-6 * other <= 31e-6 * ramp + 127 / 5.1e6
        and 23e-6 + 11e-6 * other + 9e-6 >= 31e-6 * ramp
    ]
    assert list(zip(passages.ramps, passages.interferer_ramps, strict=True)) == expected


def test_crossing_needs_the_interferer_to_be_on():
    # Simulation II c crosses 13 us into ramp 0; switched off after 10 us it makes no burst.
    sequence = interferer_sequence("simulation-2-c")
    assert len(crossings(RADAR, sequence, FILTER).ramps) == 8
    short = dataclasses.replace(sequence, ramp_duration_s=10e-6)
    assert len(crossings(RADAR, short, FILTER).ramps) == 0
    # The same course, but switched on only 16 us into ramp 0.
    delay = 16e-6
    late = dataclasses.replace(
        sequence,
        start_frequency_hz=sequence.start_frequency_hz + sequence.slope_hz_per_s * delay,
        time_offset_s=delay,
        num_ramps=1,
    )
    assert len(overlapping_passages(RADAR, late).ramps) == 2
    assert len(crossings(RADAR, late, FILTER).ramps) == 0


def test_two_crossings_of_one_ramp_add():
    # Ramps of 9 us every 10 us against a victim so slow that both cross 4 us after their start.
    slow = dataclasses.replace(RADAR, slope_hz_per_s=1e10)
    first = InterfererSequence(
        start_frequency_hz=79e9 - 4e12 * 4e-6,
        slope_hz_per_s=4e12,
        ramp_duration_s=9e-6,
        ramp_period_s=10e-6,
        num_ramps=1,
        time_offset_s=2e-6,
    )
    second = dataclasses.replace(first, time_offset_s=12e-6)
    pair = dataclasses.replace(first, num_ramps=2)
    alone = [multiplicative_bursts(slow, direct(item), FILTER)[0] for item in (first, second)]
    both = multiplicative_bursts(slow, direct(pair), FILTER)[0]
    # Centred at 6 and 16 us, samples 31 and 82.
    assert [int(np.argmax(np.abs(signal))) // 51 for signal in alone] == [0, 1]
    # The offsets of the second ramp differ by rounding, 1e-21 s of 79 GHz.
    np.testing.assert_allclose(both, alone[0] + alone[1], rtol=0, atol=1e-8)


def test_absurd_ramp_period_is_refused():
    with pytest.raises(InputError, match="ramp_period_s is 1e-09"):
        overlapping_passages(
            dataclasses.replace(RADAR, sample_rate_hz=1e3, ramp_period_s=1.0, num_samples=512),
            parallel(0.0, ramp_duration_s=1e-9, ramp_period_s=1e-9),
        )


def test_absurd_sweep_is_refused_by_the_convolution():
    steep = parallel(0.0, slope_hz_per_s=1e17)
    with pytest.raises(InputError, match=r"sweeps 9.999e\+16 Hz/s.*at most 4194304"):
        convolved_bursts(RADAR, direct(steep), NoFilter(), with_edges=True)
