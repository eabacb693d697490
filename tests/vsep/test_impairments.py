"""What a simulated receiver does to a frame, against its definition."""

import numpy as np
import pytest

from tests.vsep import oscillator_bench as bench
from vsep.errors import InputError
from vsep.files.frame import Frame, read_frame, write_frame
from vsep.presets.antennas import simulate_preset_antennas
from vsep.presets.scenes import simulate_preset
from vsep.signal.impairments import ReceiverImpairments, impaired
from vsep.signal.linear_array import UniformLinearArray

LEVELS = {"snr_db": 60.0, "sir_db": -20.0, "seed": 3}


def received(signal, seed=1, **errors):
    rng = np.random.default_rng(seed)
    return impaired(
        signal,
        ReceiverImpairments(**errors),
        noise_power=1.0,
        sample_rate_hz=bench.RATE_HZ,
        rng=rng,
    )


def test_branches_of_unequal_gain_and_angle_make_the_frame():
    ideal = bench.noise((4, 64), np.random.default_rng(2))
    gain, angle = 10.0 ** (0.7 / 20.0), np.deg2rad(-4.0)
    seen, truth = received(ideal, iq_gain_db=0.7, iq_phase_deg=-4.0)
    # the branches themselves; what they do to the wanted part belongs to its amplitude
    before = ideal / (0.5 + 0.5 * gain * np.exp(1j * angle))
    branches = before.real + 1j * gain * (before * np.exp(1j * angle)).imag
    np.testing.assert_allclose(seen, branches, rtol=1e-12)
    assert abs(truth.image_factor) == pytest.approx(0.0533, abs=1e-4)


def test_jitter_is_one_phase_a_ramp():
    ones = np.ones((4000, 8), dtype=np.complex128)
    seen, truth = received(ones, phase_jitter_rad=0.005)
    np.testing.assert_allclose(seen, np.exp(1j * truth.ramp_phases_rad)[:, None] * ones)
    deviation = np.std(truth.ramp_phases_rad)
    assert deviation == pytest.approx(0.005, abs=4.0 * 0.005 / np.sqrt(2.0 * 4000))
    assert truth.phase_noise_rad < 1e-15


def test_phase_noise_has_its_deviation_and_its_bandwidth():
    width_hz, ramps = 100e3, 4000
    ones = np.ones((ramps, 128), dtype=np.complex128)
    theta = np.angle(received(ones, phase_noise_rad=0.01, phase_noise_bandwidth_hz=width_hz)[0])
    assert np.sqrt(np.mean(theta**2)) == pytest.approx(0.01, rel=0.02)
    for lag in (1, 10, 30):
        # of a spectrum of half power at w the autocovariance decays by exp(-2 pi w)
        expected = 1e-4 * np.exp(-2.0 * np.pi * width_hz * lag / bench.RATE_HZ)
        found = np.mean(theta[:, lag:] * theta[:, :-lag])
        assert found == pytest.approx(expected, abs=5.0 * 1e-4 / np.sqrt(ramps))
    assert abs(np.mean(theta[1:, 0] * theta[:-1, -1])) < 5.0 * 1e-4 / np.sqrt(ramps)


def test_antennas_share_the_oscillator_and_have_offsets_of_their_own():
    ones = np.ones((3, 16, 32), dtype=np.complex128)
    seen, truth = received(ones, phase_jitter_rad=0.1, phase_noise_rad=0.1)
    np.testing.assert_array_equal(seen[0], seen[2])
    seen, truth = received(ones, dc_offset=2.0)
    np.testing.assert_allclose(np.abs(truth.offset), 2.0)
    np.testing.assert_allclose(seen, 1.0 + truth.offset[:, None, None] * np.ones_like(ones))
    assert truth.of_antenna(1).offset == truth.offset[1]


@pytest.mark.parametrize("antennas", [1, 2])
def test_a_preset_with_impairments_has_the_objects_and_the_noise_of_one_without(antennas):
    def made(**options):
        if antennas == 1:
            return simulate_preset("simulation-2-a", **LEVELS, **options)[1]
        line = UniformLinearArray(num_antennas=antennas)
        return simulate_preset_antennas("simulation-2-a", line, **LEVELS, **options)[1]

    perfect, seen = made(), made(phase_jitter_rad=0.01, iq_phase_deg=2.0, dc_offset=3.0)
    assert perfect.truth.receiver is None
    np.testing.assert_array_equal(seen.truth.object_signal, perfect.truth.object_signal)
    receiver = seen.truth.receiver
    turned = np.exp(1j * receiver.ramp_phases_rad)[:, None] * perfect.received
    offset = np.reshape(receiver.offset, (*np.shape(receiver.offset), 1, 1))
    expected = turned + receiver.image_factor * turned.conj() + offset
    np.testing.assert_allclose(seen.received, expected, rtol=1e-12, atol=1e-15)
    assert np.abs(receiver.offset) ** 2 * seen.truth.noise_precision == pytest.approx(9.0)


@pytest.mark.parametrize("beat_sign", [-1, 1])
def test_what_a_receiver_did_survives_its_file(tmp_path, beat_sign):
    scenario, seen = simulate_preset("simulation-2-a", **LEVELS, phase_jitter_rad=0.01)
    frame = Frame(
        received=seen.received,
        radar=scenario.radar,
        anti_aliasing_filter=scenario.anti_aliasing_filter,
        truth=seen.truth,
        beat_sign=beat_sign,
    )
    path = str(tmp_path / "frame.npz")
    write_frame(path, frame)
    again, receiver = read_frame(path).truth.receiver, seen.truth.receiver
    np.testing.assert_array_equal(again.ramp_phases_rad, receiver.ramp_phases_rad)
    assert (again.image_factor, again.offset) == (receiver.image_factor, receiver.offset)
    assert again.phase_noise_rad == receiver.phase_noise_rad


@pytest.mark.parametrize(
    ("errors", "sentence"),
    [
        ({"phase_jitter_rad": -0.1}, "Phase jitter is -0.1; it must lie between 0 and 1."),
        ({"iq_gain_db": 9.0}, "I/Q gain error is 9 dB; it must lie between -6 and 6 dB."),
    ],
)
def test_impairments_out_of_range_are_refused(errors, sentence):
    with pytest.raises(InputError, match=sentence):
        ReceiverImpairments(**errors)
