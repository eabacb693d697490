"""The clamped spline against scipy's, which the package does not import."""

import numpy as np
from scipy.interpolate import CubicSpline as Reference

from vsep.signal.cubic_spline import CubicSpline


def test_value_and_derivatives_equal_those_of_scipy():
    rng = np.random.default_rng(1)
    knots = np.cumsum(rng.uniform(0.2, 2.0, 30))
    values = rng.standard_normal(30) + 1j * rng.standard_normal(30)
    position = np.linspace(knots[0], knots[-1], 501)
    reference = Reference(knots, values, bc_type="clamped")
    for order, result in enumerate(CubicSpline(knots, values).jet(position)):
        expected = reference(position, order)
        # Two well conditioned tridiagonal systems: a few hundred roundings.
        np.testing.assert_allclose(result, expected, rtol=0, atol=1e-12 * np.abs(expected).max())


def test_spline_is_zero_beyond_its_knots():
    spline = CubicSpline(np.array([0.0, 1.0, 3.0]), np.array([1.0, 2.0, 1j]))
    for result in spline.jet(np.array([-1e-9, 3.0 + 1e-9, 1e300])):
        np.testing.assert_array_equal(result, 0.0)


def test_spline_passes_its_knots():
    knots, values = np.array([-1.0, 0.5, 4.0]), np.array([1.0, -2.0j, 3.0])
    np.testing.assert_allclose(CubicSpline(knots, values).jet(knots)[0], values, atol=1e-14)
