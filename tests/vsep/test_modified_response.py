"""Closed forms of Gbar against integrals over the definition."""

import numpy as np
import pytest
from scipy.integrate import quad

from vsep.signal.modified_response import bspline_responses, pole_jet, raised_cosine_jet, spline_jet

INNER_HZ, OUTER_HZ = 0.75e6, 1.25e6


def kernel(frequency, slope):
    """FT{exp(j pi slope t^2)}, the K of the module."""
    phase = np.pi / 4 * np.sign(slope) - np.pi * frequency**2 / slope
    return np.exp(1j * phase) / np.sqrt(abs(slope))


def integral(function, low, high):
    """Complex quadrature to an absolute error of 1e-12."""
    options = {"epsabs": 1e-12, "epsrel": 1e-12, "limit": 500}
    real = quad(lambda x: function(x).real, low, high, **options)[0]
    return real + 1j * quad(lambda x: function(x).imag, low, high, **options)[0]


@pytest.mark.parametrize("slope", [0.8e12, -0.8e12, 3e12])
@pytest.mark.parametrize("frequency", [0.0, -0.9e6, 1.25e6, 2e6])
def test_raised_cosine_equals_the_convolution_integral(slope, frequency):
    def taper(x):
        return 0.5 * (1 + np.cos(np.pi * (abs(x) - INNER_HZ) / (OUTER_HZ - INNER_HZ)))

    expected = (
        integral(lambda x: taper(x) * kernel(frequency - x, slope), -OUTER_HZ, -INNER_HZ)
        + integral(lambda x: kernel(frequency - x, slope), -INNER_HZ, INNER_HZ)
        + integral(lambda x: taper(x) * kernel(frequency - x, slope), INNER_HZ, OUTER_HZ)
    )
    value = raised_cosine_jet(np.array(frequency), slope, INNER_HZ, OUTER_HZ).value
    # Three integrals of relative error 1e-12 and magnitude about one.
    assert abs(value - expected) < 1e-11


@pytest.mark.parametrize("slope", [0.8e12, -0.2e12])
@pytest.mark.parametrize("frequency", [0.0, -0.9e6, 2e6])
def test_pole_equals_the_transform_of_its_impulse_response(slope, frequency):
    pole = complex(-4e6, 3e6)

    def impulse(t):
        return np.exp(pole * t + 1j * np.pi * slope * t**2 - 2j * np.pi * frequency * t)

    # In microseconds, so that the integrand is of order one; 10 us hold all but e^-40.
    expected = 1e-6 * integral(lambda t: impulse(t * 1e-6), 0.0, 10.0)
    jet = pole_jet(np.array(frequency), slope, np.array([pole]), np.array([1.0 + 0.0j]))
    # The integrals are of order 0.2 microseconds and right to 1e-12 of a microsecond each.
    assert abs(jet.value - expected) < 4e-18


def test_derivatives_of_a_pole_are_moments_of_its_impulse_response():
    pole, slope, frequency = complex(-4e6, 3e6), 0.8e12, 0.4e6

    def moment(order):
        def integrand(t):
            seconds = t * 1e-6
            exponent = (pole - 2j * np.pi * frequency) * seconds + 1j * np.pi * slope * seconds**2
            return (-2j * np.pi * t) ** order * np.exp(exponent)

        return 1e-6 * integral(integrand, 0.0, 12.0) * 1e-6**order

    jet = pole_jet(np.array(frequency), slope, np.array([pole]), np.array([1.0 + 0.0j]))
    for order in range(3):
        # 1e-12 of quadrature against moments of 0.1 to 1 in microseconds.
        assert abs(jet[order] - moment(order)) < 1e-10 * abs(moment(order))


@pytest.mark.parametrize("slope", [0.8e12, -0.2e12])
@pytest.mark.parametrize("frequency", [0.0, -0.9e6, 2e6])
def test_modified_splines_are_the_convolution_with_the_kernel(slope, frequency):
    step, knots = 0.25e6, np.arange(5) * 0.25e6 - 0.5e6

    def spline(x):
        return sum(
            weight * max(x - knot, 0.0) ** 3 / 6.0
            for weight, knot in zip([1, -4, 6, -4, 1], knots, strict=True)
        )

    expected = sum(
        integral(lambda x: spline(x) / step**3 * kernel(frequency - x, slope), low, low + step)
        for low in knots[:-1]
    )
    (modified,) = bspline_responses(np.array(frequency), slope, knots)
    # The cubics reach (2.5 MHz / step)^3 = 1000 spline heights, with 16 digits.
    assert abs(modified - expected) < 1e-10


def test_derivatives_of_a_spline_are_those_of_finite_differences():
    frequency, slope, h = np.linspace(-2e6, 2e6, 9), -0.5e12, 2.0
    knots = np.arange(5) * 0.25e6

    jumps = np.array([1.0, -4.0, 6.0, -4.0, 1.0], dtype=complex) / 0.25e6**3
    below, here, above = (
        spline_jet(frequency + offset, slope, knots, jumps) for offset in (-h, 0.0, h)
    )
    for order in (1, 2):
        difference = (above[order - 1] - below[order - 1]) / (2.0 * h)
        scale = np.abs(here[order]).max()
        # Rounding 1e-12 over the step 2 Hz against derivatives of one in 0.25 MHz: 1e-7.
        np.testing.assert_allclose(difference, here[order], rtol=0, atol=1e-5 * scale)
