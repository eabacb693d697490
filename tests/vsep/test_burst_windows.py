import numpy as np
import pytest

from tests.vsep.test_calibrate import SIMULATED_RATE, simulated_recording
from vsep.calibration.burst_windows import Crossing, cut_bursts, find_crossings, window_span
from vsep.errors import InputError
from vsep.signal.clutter import static_clutter

SLOPE = -10e12 / SIMULATED_RATE**2


def crossings_at(*places):
    return [Crossing(ramp=p, sample=n, slope_hz_per_s=-10e12) for p, n in places]


def test_simulated_bursts_are_found_where_they_cross():
    received, _ = simulated_recording()
    moving = received[0] - static_clutter(received[0])
    found = find_crossings(moving, SIMULATED_RATE)
    # f = k_V t - k_I (t - offset - 0.17 us p) = 0, where t is from the start of ramp p.
    expected = {p: 10.0 * (-20.0 * (-10.0 + 0.17 * p)) / 10.0 for p in range(24)}
    # The interferer's ramp p ends 19 us + 0.17 us p after the victim's begins.
    inside = {p for p, sample in expected.items() if 0.0 < sample < 190.0 + 1.7 * p}
    assert {each.ramp for each in found} == inside
    for each in found:
        # The filter's group delay of some 4 samples, and a search on a grid of whole samples.
        assert each.sample == pytest.approx(expected[each.ramp], abs=8.0)


def test_windows_hold_no_object():
    rng = np.random.default_rng(7)
    n, p = np.arange(256), np.arange(32)[:, None]
    tone = np.exp(-2j * np.pi * (0.11 * n + 0.25 * p))
    received = tone[None] + 1e-3 * rng.normal(size=(1, 32, 256))
    windows = cut_bursts(received, crossings_at((3, 100.0), (9, 80.0)), -0.1)
    for window in windows:
        # Half of a ramp's samples, far from the edges, are filled in to a few per cent.
        assert np.mean(np.abs(window.signals) ** 2) < 0.1


def test_bursts_that_overlap_or_lie_outside_are_left_out():
    rng = np.random.default_rng(8)
    received = rng.normal(size=(2, 16, 256)) + 0j
    places = crossings_at((1, 100.0), (2, 50.0), (2, 70.0), (3, -4.0))
    windows = cut_bursts(received, places, SLOPE)
    assert [(window.ramp, window.signals.shape[0]) for window in windows] == [(1, 2)]


def test_a_recording_full_of_bursts_is_refused():
    received = np.ones((1, 8, 128), complex)
    with pytest.raises(InputError, match="at most 70 % are allowed"):
        cut_bursts(received, crossings_at(*((p, 60.0) for p in range(8))), 0.01)


def test_a_window_ends_with_its_ramp():
    assert window_span(250.0, 0.1, 256) == (236, 256)
