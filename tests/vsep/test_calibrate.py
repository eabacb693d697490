"""From whole recordings to the receiver's response, simulated and real."""

from dataclasses import replace

import numpy as np
import pytest

from tests.vsep.recording_bench import (
    INTERFERED,
    RADAR,
    RATE,
    SLOPE,
    car_of,
    car_sir_db,
    recording,
    separated,
)
from vsep.calibration.calibrate import calibrate
from vsep.calibration.response_estimate import reproduction_errors
from vsep.errors import InputError
from vsep.signal.clutter import static_clutter
from vsep.signal.filters import ButterworthFilter
from vsep.signal.radar import InterfererSequence
from vsep.signal.receiver_response import ReceiverResponse
from vsep.signal.scene import Channel, Interferer
from vsep.signal.simulate import add_interference

SIMULATED_RATE = 10e6


def simulated_recording():
    """24 ramps of one antenna: a moving and a still object, noise, bursts of a steep Butterworth.

    The slope difference is -1e13 Hz/s, one burst in every ramp but a few.
    """
    rng = np.random.default_rng(5)
    values = {"slope_hz_per_s": 30e12, "sample_rate_hz": SIMULATED_RATE, "ramp_period_s": 30e-6}
    radar = replace(RADAR, num_samples=256, num_ramps=24, **values)
    n, p = np.arange(256), np.arange(24)[:, None]
    frame = np.exp(-2j * np.pi * (0.11 * n + 0.21 * p)) + np.exp(-2j * np.pi * 0.07 * n)
    frame = frame + 0.1 * (rng.normal(size=(24, 256)) + 1j * rng.normal(size=(24, 256)))
    other = Interferer(
        sequence=InterfererSequence(
            start_frequency_hz=77e9,
            slope_hz_per_s=20e12,
            ramp_duration_s=29e-6,
            ramp_period_s=30.17e-6,
            num_ramps=24,
            time_offset_s=-10e-6,
        ),
        channel=Channel(delays_s=np.zeros(1), dopplers_hz=np.zeros(1), weights=np.ones(1, complex)),
    )
    made_by = ButterworthFilter(cutoff_hz=4e6, order=8)
    observation = add_interference(
        radar, frame, [other], sir_db=-25.0, anti_aliasing_filter=made_by
    )
    return observation.received[None], made_by


def test_a_simulated_receiver_is_found():
    received, made_by = simulated_recording()
    calibration = calibrate([received], SIMULATED_RATE, -10e12)
    response = calibration.estimate.response
    band = np.abs(response.frequency_hz) < 0.45 * SIMULATED_RATE
    frequency_hz, estimated = response.frequency_hz[band], response.response[0, band]
    known = made_by.response(frequency_hz)
    delays = np.linspace(-1e-6, 1e-6, 8001)[:, None]
    share = np.abs((known * np.exp(-2j * np.pi * frequency_hz * delays)).conj() @ estimated) ** 2
    error = 1.0 - share.max() / (np.vdot(known, known) * np.vdot(estimated, estimated)).real
    # Some 20 bursts 30 dB over the objects, of which filling-in leaves a part: well below -30 dB.
    assert error < 1e-3


def test_a_frame_without_bursts_is_refused():
    rng = np.random.default_rng(6)
    noise = rng.normal(size=(1, 16, 128)) + 1j * rng.normal(size=(1, 16, 128))
    with pytest.raises(InputError, match="needs interference"):
        calibrate([noise], 1e7)


@pytest.mark.parametrize(
    ("recordings", "sentence"),
    [
        ([np.ones((16, 128), complex)], r"shape \(16, 128\)"),
        ([np.ones((1, 4, 128), complex)], "4 ramps; at least 8"),
        ([np.ones((1, 16, 128), complex), np.ones((2, 16, 128), complex)], "1 and 2 antennas"),
    ],
)
def test_unusable_recordings_are_refused(recordings, sentence):
    with pytest.raises(InputError, match=sentence):
        calibrate(recordings, 1e7)


@pytest.mark.parametrize("slope", [0.0, np.nan, 1e20])
def test_an_impossible_slope_difference_is_refused(slope):
    with pytest.raises(InputError, match="slope difference"):
        calibrate([np.ones((1, 16, 128), complex)], 1e7, slope)


def test_bursts_of_another_part_of_a_real_recording_are_reproduced():
    signals, _ = recording(INTERFERED)
    first = calibrate([signals[:1, :64]], RATE, SLOPE)
    # The second half's windows, cut where a calibration of its own finds them.
    second = calibrate([signals[:1, 64:]], RATE, SLOPE)
    response = first.estimate.response
    errors = _median_db(second.windows, response)
    assert errors < -22.0  # the bar; -25.8 was measured
    # Without the phase, and without the response, reproduction fails; -5.3 and -4.0 dB measured
    # elsewhere with other windows.
    assert _median_db(second.windows, _changed(response, np.abs(response.response))) > -10.0
    inside = np.abs(response.frequency_hz) <= 0.5 * RATE
    assert _median_db(second.windows, _changed(response, inside[None].astype(complex))) > -10.0


def test_the_slope_difference_of_a_real_recording_is_found():
    signals, _ = recording(INTERFERED)
    response = calibrate([signals[:1]], RATE).estimate.response
    # Settings of both radars; 19.263 MHz/us was measured, 0.25 % off.
    assert response.slope_difference_hz_per_s == pytest.approx(SLOPE, rel=0.01)


def _median_db(windows, response):
    return 10.0 * np.log10(np.median(reproduction_errors(windows, response, RATE)))


def _changed(response, samples):
    return ReceiverResponse(
        frequency_hz=response.frequency_hz,
        response=samples,
        coherence=response.coherence,
        slope_difference_hz_per_s=response.slope_difference_hz_per_s,
        num_bursts=response.num_bursts,
    )


def test_the_static_part_of_a_recording_holds_no_burst():
    signals, mask = recording(INTERFERED)
    still = static_clutter(signals[0])
    # Bursts peak at some hundred times the median magnitude; the settling transient is smooth.
    assert np.abs(still).max() < 0.15
    assert np.abs(signals[0][mask]).max() > 0.3


@pytest.mark.scenario
def test_the_car_of_a_real_recording_is_freed_of_bursts():
    signals, mask = recording(INTERFERED)
    response = calibrate([signals], RATE, SLOPE).estimate.response
    moving = signals[0] - static_clutter(signals[0])
    state = separated(signals[0], response.filter_of(0))
    # The bars; 44.2 dB was measured, 15.0 as received and 43.1 by slow-time interpolation.
    assert car_sir_db(signals[0] - state.interference_signal) > 44.0
    burst_free = ~mask.any(axis=1)
    freed = car_of(moving - state.interference_signal)
    assert freed == pytest.approx(car_of(moving, np.flatnonzero(burst_free)), abs=0.1)
    rest = np.abs(moving - state.object_signal - state.interference_signal) ** 2
    assert 10.0 * np.log10(rest.mean() / rest[burst_free].mean()) < 0.5
