"""Lines of antennas, and what they receive of a scene."""

import numpy as np
import pytest

from vsep.errors import InputError
from vsep.presets.scenes import preset
from vsep.signal.linear_array import AntennaScene, UniformLinearArray
from vsep.signal.simulate import simulate_antennas


def drawn(seed=4, **options):
    return preset(
        "simulation-2-a", snr_db=50.0, sir_db=-10.0, rng=np.random.default_rng(seed), **options
    )


def received_by(num_antennas, interferer_angle=20.0):
    scenario = drawn()
    angles = np.linspace(-40.0, 50.0, scenario.scene.objects.num_paths)
    scene = AntennaScene(
        scene=scenario.scene,
        antennas=UniformLinearArray(num_antennas=num_antennas, spacing_wavelengths=0.4),
        object_angles_deg=angles,
        interferer_angles_deg=np.array([interferer_angle]),
    )
    observation = simulate_antennas(
        scenario.radar,
        scene,
        anti_aliasing_filter=scenario.anti_aliasing_filter,
        rng=np.random.default_rng(9),
    )
    return scenario, angles, observation


def test_antennas_differ_by_the_phase_of_the_shorter_path():
    scenario, angles, observation = received_by(3)
    truth = observation.truth
    steps = truth.amplitudes[:, 1:] / truth.amplitudes[:, :-1]
    expected = np.exp(2j * np.pi * 0.4 * np.sin(np.radians(angles)))
    np.testing.assert_allclose(steps, np.repeat(expected[:, None], 2, axis=1), rtol=1e-12)
    np.testing.assert_array_equal(truth.amplitudes[:, 0], scenario.scene.objects.weights)
    phase = np.exp(2j * np.pi * 0.4 * np.sin(np.radians(20.0)))
    np.testing.assert_allclose(
        truth.interference_signal[2], phase**2 * truth.interference_signal[0], rtol=1e-9
    )


def test_every_antenna_has_the_levels_asked_for_and_noise_of_its_own():
    _, _, observation = received_by(4)
    truth = observation.truth
    energy = np.sum(np.abs(truth.object_signal[0]) ** 2)
    interference = np.sum(np.abs(truth.interference_signal) ** 2, axis=(1, 2))
    np.testing.assert_allclose(interference, 10.0 * energy, rtol=1e-9)
    assert truth.noise_precision == pytest.approx(1e5 / energy)
    noise = observation.received - truth.object_signal - truth.interference_signal
    # 2048 samples of noise scatter by 2.2 % in power, and correlate by as much.
    flat = noise.reshape(4, -1) * np.sqrt(truth.noise_precision / flat_size(noise))
    np.testing.assert_allclose(flat @ flat.conj().T, np.eye(4), atol=0.11)


def flat_size(noise):
    return noise[0].size


def test_directions_are_one_for_each():
    scenario = drawn()
    line = UniformLinearArray(num_antennas=2)
    with pytest.raises(InputError, match=r"object_angles_deg has shape \(2,\); it must be \(10,\)"):
        AntennaScene(
            scene=scenario.scene,
            antennas=line,
            object_angles_deg=np.zeros(2),
            interferer_angles_deg=np.zeros(1),
        )
    with pytest.raises(InputError, match="interferer_angles_deg is 91 degrees"):
        AntennaScene(
            scene=scenario.scene,
            antennas=line,
            object_angles_deg=np.zeros(10),
            interferer_angles_deg=np.array([91.0]),
        )


def test_a_line_has_antennas_some_way_apart():
    with pytest.raises(InputError, match="num_antennas is 0"):
        UniformLinearArray(num_antennas=0)
    with pytest.raises(InputError, match="spacing_wavelengths is 0"):
        UniformLinearArray(num_antennas=2, spacing_wavelengths=0.0)
