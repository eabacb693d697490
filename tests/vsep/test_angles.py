"""Angles of arrival against closed forms, a grid, and a numerical Fisher information."""

import numpy as np
import pytest

from vsep.analysis.angles import angle_bound_deg, object_angles
from vsep.errors import InputError
from vsep.signal.linear_array import UniformLinearArray


def weights_of(angles_deg, num_antennas, spacing):
    """(L, A) plane waves, written out: the path to antenna a is a d sin(theta) shorter."""
    sines = np.sin(np.radians(angles_deg))[:, None]
    return np.exp(2j * np.pi * spacing * sines * np.arange(num_antennas))


@pytest.mark.parametrize("num_antennas", [2, 3, 4, 12])
@pytest.mark.parametrize("spacing", [0.25, 0.5])
def test_plane_waves_without_noise_come_from_where_they_come(num_antennas, spacing):
    angles = np.array([-89.0, -60.0, -13.7, 0.0, 1e-3, 45.0, 89.0])
    turned = (
        weights_of(angles, num_antennas, spacing) * np.array([3.0, 1j, -1.0, 2.0, 1, 1, 1])[:, None]
    )
    found = object_angles(turned, np.full(7, 1e-6), spacing)
    # Newton's method ends at rounding, 1e-8 of a cell; at 89 degrees a sine is 57 times steeper.
    np.testing.assert_allclose(found.angles_deg, angles, atol=1e-4)


def test_the_estimate_is_the_highest_point_of_the_periodogram():
    rng = np.random.default_rng(1)
    fine = np.linspace(-90.0, 90.0, 40_001)
    waves = weights_of(fine, 5, 0.5).conj()
    for _ in range(30):
        noisy = weights_of(np.array([rng.uniform(-80, 80)]), 5, 0.5)
        noisy = noisy + 0.7 * (rng.standard_normal((1, 5)) + 1j * rng.standard_normal((1, 5)))
        found = float(object_angles(noisy, np.ones(1), 0.5).angles_deg[0])
        values = np.abs(waves @ noisy[0])
        best = np.abs(weights_of(np.array([found]), 5, 0.5).conj() @ noisy[0])[0]
        # A grid point is at most 0.00225 degrees from the peak, where the curve is flat.
        assert best >= values.max() * (1 - 1e-9)


def test_a_wide_line_gives_the_direction_nearest_to_broadside():
    # Two wavelengths apart, sin(theta) is known modulo 1/2.
    found = object_angles(weights_of(np.array([40.0]), 4, 2.0), np.ones(1), 2.0)
    aliased = np.degrees(np.arcsin((np.sin(np.radians(40.0)) + 0.25) % 0.5 - 0.25))
    assert found.angles_deg[0] == pytest.approx(aliased, abs=1e-6)
    assert (
        abs(found.angles_deg[0])
        <= UniformLinearArray(num_antennas=2, spacing_wavelengths=2.0).unambiguous_angle_deg
        == pytest.approx(14.4775, abs=1e-4)
    )


def test_noise_beyond_the_ends_of_a_narrow_line_is_put_at_its_end():
    # A phase of 0.4 turns from antenna to antenna: a quarter of a wavelength gives 0.25 at most.
    found = object_angles(np.exp(2j * np.pi * 0.4 * np.arange(4))[None], np.ones(1), 0.25)
    assert found.angles_deg[0] == pytest.approx(90.0)
    assert np.isinf(found.stds_deg[0])


def test_bound_equals_the_numerical_fisher_information():
    num_antennas, spacing, angle, snr = 4, 0.5, 25.0, 50.0

    def signal(parameters):
        theta, real, imaginary = parameters
        return (real + 1j * imaginary) * weights_of(np.array([theta]), num_antennas, spacing)[0]

    point, step = np.array([angle, 1.0, 0.5]), 1e-5
    columns = [
        (signal(point + step * e) - signal(point - step * e)) / (2 * step) for e in np.eye(3)
    ]
    jacobian = np.array(columns).T
    fisher = 2.0 * (snr / 1.25) * (jacobian.conj().T @ jacobian).real
    expected = np.sqrt(np.linalg.inv(fisher)[0, 0])
    found = angle_bound_deg(np.array([snr]), np.array([angle]), num_antennas, spacing)[0]
    assert found == pytest.approx(expected, rel=1e-6)


def test_errors_have_the_deviation_that_is_told():
    rng = np.random.default_rng(2)
    count, variance = 2000, 0.02
    draws = rng.standard_normal((2, count, 4)) * np.sqrt(variance / 2)
    angles = rng.uniform(-50.0, 50.0, count)
    found = object_angles(
        weights_of(angles, 4, 0.5) + draws[0] + 1j * draws[1], np.full(count, variance), 0.5
    )
    score = (found.angles_deg - angles) / found.stds_deg
    # 2000 squares of normal errors scatter by 3 %; at this SNR the bound is not quite attained.
    assert np.mean(score**2) == pytest.approx(1.0, abs=0.15)


def test_no_object_has_no_angle():
    found = object_angles(np.zeros((0, 4), dtype=complex), np.zeros(0), 0.5)
    assert found.angles_deg.shape == found.stds_deg.shape == (0,)


def test_one_antenna_has_no_angle():
    with pytest.raises(InputError, match=r"shape \(3, 1\).*at least 2 antennas"):
        object_angles(np.ones((3, 1), dtype=complex), np.ones(3), 0.5)
