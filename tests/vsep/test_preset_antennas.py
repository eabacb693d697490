"""Presets as several antennas receive them."""

import numpy as np
import pytest

from vsep.errors import InputError
from vsep.presets.antennas import MAX_DEG, simulate_preset_antennas
from vsep.presets.scenes import simulate_preset
from vsep.signal.linear_array import UniformLinearArray

LEVELS = {"snr_db": 40.0, "sir_db": -15.0, "seed": 5}
LINE = UniformLinearArray(num_antennas=3, spacing_wavelengths=0.4)


def drawn(line=LINE, **options):
    return simulate_preset_antennas("simulation-2-b", line, **(LEVELS | options))[1]


def test_the_first_antenna_receives_the_scene_of_one():
    truth = drawn().truth
    alone = simulate_preset("simulation-2-b", **LEVELS)[1].truth
    np.testing.assert_array_equal(truth.amplitudes[:, 0], alone.amplitudes)
    np.testing.assert_array_equal(truth.object_signal[0], alone.object_signal)
    # Its level is set by the energy at all antennas, summed in another order: a few roundings.
    np.testing.assert_allclose(
        truth.interference_signal[0], alone.interference_signal, rtol=1e-12, atol=1e-12
    )
    places = [
        [(burst.ramp, burst.slope_hz_per_s) for burst in each.bursts] for each in (truth, alone)
    ]
    assert places[0] == places[1]
    assert len(places[0]) == 4


def test_antennas_turn_as_the_directions_say():
    truth = drawn().truth
    assert np.all(np.abs(truth.angles_deg) <= MAX_DEG)
    assert len(set(truth.angles_deg.tolist())) == 10
    turns = 0.4 * np.sin(np.radians(truth.angles_deg))
    np.testing.assert_allclose(
        truth.amplitudes[:, 2] / truth.amplitudes[:, 0], np.exp(4j * np.pi * turns), rtol=1e-12
    )


def test_a_direction_that_is_given_leaves_the_others():
    both, one = drawn(), drawn(interferer_angles_deg=np.array([-12.0]))
    np.testing.assert_array_equal(one.truth.angles_deg, both.truth.angles_deg)
    np.testing.assert_array_equal(one.truth.interferer_angles_deg, [-12.0])
    given = drawn(object_angles_deg=np.full(10, 7.0))
    np.testing.assert_array_equal(
        given.truth.interferer_angles_deg, both.truth.interferer_angles_deg
    )
    assert len(drawn(interference=False).truth.interferer_angles_deg) == 0


def test_a_wide_line_draws_directions_that_it_tells_apart():
    truth = drawn(UniformLinearArray(num_antennas=2, spacing_wavelengths=2.0)).truth
    # asin(1/4) on both sides.
    assert np.all(np.abs(truth.angles_deg) <= np.degrees(np.arcsin(0.25)))


def test_directions_of_another_number_are_refused():
    with pytest.raises(InputError, match=r"object_angles_deg has shape \(2,\); it must be \(10,\)"):
        drawn(object_angles_deg=np.zeros(2))
