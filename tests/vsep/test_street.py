"""The simulated street: places and levels are those of its geometry, and one seed is one street."""

import numpy as np
import pytest

from vsep.errors import InputError
from vsep.presets.street import SIR_DB, SNR_DB, street_frame, street_frames
from vsep.presets.street_traffic import FILTER, OWN_SPEED_MPS, RADAR
from vsep.signal.motion import CYCLE_S

INTERFERED = 21  # a frame in which a car's radar sends
PASSING_M = 12.0  # nearer objects change their radial velocity within a frame's time


def places_of(frame):
    """Distance in m and radial velocity in m/s of every named object."""
    truth = frame.observation.truth
    ranges, velocities = (
        RADAR.range_from_beat(truth.beats),
        RADAR.velocity_from_doppler(truth.dopplers),
    )
    return dict(zip(frame.names, zip(ranges, velocities, strict=True), strict=True))


def energy(signal):
    return np.sum(np.abs(signal) ** 2)


def test_a_frame_is_the_same_alone_and_in_its_sequence():
    (*_, last) = street_frames(seed=3, num_frames=8)
    alone = street_frame(7, seed=3)
    assert last.names == alone.names
    np.testing.assert_array_equal(last.observation.received, alone.observation.received)
    other = street_frame(7, seed=4)
    assert not np.array_equal(other.observation.received, alone.observation.received)


def test_objects_move_by_their_radial_velocity():
    before, after = (places_of(street_frame(number, seed=1)) for number in (40, 41))
    stay = [name for name in before if name in after and after[name][0] > PASSING_M]
    assert {"car 1", "cyclist 1", "pedestrian 1"} <= {*stay}
    for name in stay:
        # Between the frames the mean of both velocities, to third order in time.
        moved = after[name][0] - before[name][0]
        mean = 0.5 * (before[name][1] + after[name][1])
        assert moved == pytest.approx(mean * CYCLE_S, abs=2e-4), name


def test_what_stands_approaches_with_the_own_speed_at_most():
    for name, (_, velocity) in places_of(street_frame(60, seed=2)).items():
        if name.startswith("clutter"):
            assert -OWN_SPEED_MPS <= velocity < 0.0


def test_noise_is_that_of_the_reference_whatever_is_in_view():
    for number in (0, 40, 90):
        truth = street_frame(number, seed=1).observation.truth
        assert 10.0 * np.log10(truth.noise_precision) == pytest.approx(SNR_DB, abs=1e-9)


def test_a_level_changes_its_own_signal_alone():
    usual = street_frame(INTERFERED, seed=1)
    louder = street_frame(INTERFERED, seed=1, sir_db=SIR_DB - 10.0)
    first, second = usual.observation.truth, louder.observation.truth
    ratio = energy(second.interference_signal) / energy(first.interference_signal)
    assert 10.0 * np.log10(ratio) == pytest.approx(10.0, abs=1e-9)
    np.testing.assert_allclose(second.object_signal, first.object_signal)
    without = street_frame(INTERFERED, seed=1, interference=False).observation.received
    rest = usual.observation.received - first.interference_signal
    np.testing.assert_allclose(rest, without, atol=1e-12)


def test_a_whole_burst_has_the_energy_of_its_distance():
    frame = street_frame(INTERFERED, seed=1)
    distance = places_of(frame)["car 1"][0]
    truth = frame.observation.truth
    rows = np.sum(np.abs(truth.interference_signal) ** 2, axis=1)
    # Unit energy at 10 m and SIR 0 dB; the paths add up to some dB more or less, and a burst at the
    # end of a ramp is not whole.
    expected = 10.0 ** (-SIR_DB / 10.0) * (10.0 / distance) ** 2
    assert 10.0 * np.log10(rows.max() / expected) == pytest.approx(0.0, abs=3.0)
    assert len(frame.scene.interferers) == 1


def test_a_slope_is_that_of_the_bursts():
    frame = street_frame(INTERFERED, seed=1, interferer_slope_hz_per_s=8.5e12)
    slopes = {burst.slope_hz_per_s for burst in frame.observation.truth.bursts}
    assert slopes == {8.5e12 - RADAR.slope_hz_per_s}


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        ({"number": -1}, r"frame_number is -1; it must lie between 0 and 1e\+06"),
        ({"seed": -2}, "seed is -2"),
        ({"snr_db": 900.0}, "900"),
        ({"interferer_slope_hz_per_s": 1e13}, "the radar's own"),
    ],
)
def test_what_cannot_be_made_is_refused_in_a_sentence(options, sentence):
    values = {"number": 0, "seed": 1} | options
    with pytest.raises(InputError, match=sentence):
        street_frame(values.pop("number"), **values)


def test_the_estimator_may_be_told_another_filter():
    assert street_frame(0, seed=1).assumed_filter is FILTER
