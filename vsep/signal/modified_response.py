"""Closed forms of the modified anti-aliasing filter response, (40)-(41).

Demixing turns an interferer's ramp into a chirp of slope Delta k, which the filter then convolves
with its impulse response g. The result is the chirp times

    Gbar(f; Delta k) = FT{g(t) exp(j pi Delta k t^2)} = integral of G(f') K(f - f') df',
    K(f) = exp(j pi/4 sgn Delta k) / sqrt|Delta k| exp(-j pi f^2 / Delta k),

taken along the chirp's course f = Delta f_0 + Delta k t. Because K solves a Schrodinger equation,
dGbar/d(Delta k) = -(j / 4 pi) d^2 Gbar/df^2: one jet in the frequency holds every derivative.

The functions take frequencies and slope differences Delta k that broadcast, in Hz and Hz/s, return
arrays of the broadcast shape and raise `InputError` if a slope difference is zero.
"""

from abc import ABC, abstractmethod

import numpy as np
from scipy.special import wofz

from vsep._typing import ComplexArray, FloatArray
from vsep.kernels.fresnel import SMOOTH, raised_cosine_terms
from vsep.kernels.splines import bspline_terms, spline_terms
from vsep.signal.response_jet import ResponseJet, nonparallel
from vsep.signal.smooth_response import SmoothResponse


class ModifiedResponse(ABC):
    """Base of the filters: the modified response is the value of its jet."""

    __slots__ = ()

    @abstractmethod
    def modified_response_jet(
        self, frequency_hz: FloatArray, slope_difference_hz_per_s: FloatArray | float
    ) -> ResponseJet:
        """Return the modified response with its first two derivatives by the frequency."""

    @property
    def smooth(self) -> SmoothResponse | None:
        """The response as a smooth one of finite support, where it is given by samples."""
        return None

    def modified_response(
        self, frequency_hz: FloatArray, slope_difference_hz_per_s: FloatArray | float
    ) -> ComplexArray:
        """Return the modified response Gbar(f; Delta k) of (40)-(41); the arguments broadcast."""
        return self.modified_response_jet(frequency_hz, slope_difference_hz_per_s).value


def raised_cosine_jet(
    frequency_hz: FloatArray, slope_hz_per_s: FloatArray | float, inner_hz: float, outer_hz: float
) -> ResponseJet:
    """Evaluate the modified response of a raised cosine in Fresnel integrals.

    Times the kernel K every part of the response is a quadratic phase, see
    `vsep.kernels.fresnel.raised_cosine_terms`.

    Parameters
    ----------
    inner_hz, outer_hz : float
        End of the flat part and of the taper, inner < outer.
    """
    slope = nonparallel(slope_hz_per_s)
    frequency = np.asarray(frequency_hz, dtype=np.float64)
    if frequency.ndim == 2 and slope.shape == (len(frequency), 1):
        # Rows of one slope each, whole bursts: what the estimator asks for.
        return ResponseJet(*raised_cosine_terms(frequency, slope, inner_hz, outer_hz, SMOOTH))
    frequency, slope = np.broadcast_arrays(frequency, slope)
    column = frequency.reshape(-1, 1).copy()
    terms = raised_cosine_terms(column, slope.reshape(-1, 1).copy(), inner_hz, outer_hz, SMOOTH)
    return ResponseJet(*terms.reshape(3, *frequency.shape))


def pole_jet(
    frequency_hz: FloatArray,
    slope_hz_per_s: FloatArray | float,
    poles: ComplexArray,
    residues: ComplexArray,
) -> ResponseJet:
    """Evaluate the modified response of a causal all-pole filter in the Faddeeva function.

    The impulse response is the sum of residue exp(pole t) over t >= 0, so that every pole gives
    W(a), the integral of exp(a t + j pi Delta k t^2) with a = pole - j 2 pi f. Integration by parts
    gives the derivatives, W' = (-1 - a W) / (j 2 pi Delta k), W'' = -(W + a W') / (j 2 pi Delta k).

    Parameters
    ----------
    poles, residues : (K,) complex
        Poles in rad/s, left of the imaginary axis, and residues in rad/s.
    """
    slope = nonparallel(slope_hz_per_s)
    curvature = 2j * np.pi * slope
    # sqrt(-j pi Delta k), the root with a positive real part: the contour turns by +-45 degrees.
    root = np.sqrt(np.pi * np.abs(slope)) * np.exp(-0.25j * np.pi * np.sign(slope))
    shape = np.broadcast_shapes(np.shape(frequency_hz), slope.shape)
    jet = [np.zeros(shape, dtype=np.complex128) for _ in range(3)]
    angular = 2j * np.pi * np.asarray(frequency_hz)
    for pole, residue in zip(poles, residues, strict=True):
        exponent = pole - angular
        integral = 0.5 * np.sqrt(np.pi) / root * wofz(-0.5j * exponent / root)
        first = -(1.0 + exponent * integral) / curvature
        second = -(integral + exponent * first) / curvature
        jet[0] += residue * integral
        jet[1] += residue * first
        jet[2] += residue * second
    return ResponseJet(jet[0], -2j * np.pi * jet[1], -4.0 * np.pi**2 * jet[2])


def spline_jet(
    frequency_hz: FloatArray,
    slope_hz_per_s: FloatArray | float,
    knots_hz: FloatArray,
    jumps: ComplexArray,
) -> ResponseJet:
    """Evaluate the modified response of a complex cubic spline of finite support.

    Parameters
    ----------
    knots_hz : (M,) float
    jumps : (M,) complex
        Of the spline's third derivative at the knots, 1/Hz^3.
    """
    slope = nonparallel(slope_hz_per_s)
    frequency, slope = np.broadcast_arrays(np.asarray(frequency_hz, dtype=np.float64), slope)
    terms = spline_terms(frequency.flatten(), slope.flatten(), knots_hz, jumps, SMOOTH)
    return ResponseJet(*terms.reshape(3, *frequency.shape))


def bspline_responses(
    frequency_hz: FloatArray, slope_hz_per_s: FloatArray | float, knots_hz: FloatArray
) -> ComplexArray:
    """Evaluate the modified responses of all cubic B-splines on a grid of knots.

    Parameters
    ----------
    knots_hz : (M,) float
        Equidistant, ascending.

    Returns
    -------
    (..., M - 4) complex
    """
    slope = nonparallel(slope_hz_per_s)
    frequency, slope = np.broadcast_arrays(np.asarray(frequency_hz, dtype=np.float64), slope)
    splines = bspline_terms(frequency.flatten(), slope.flatten(), knots_hz, SMOOTH)
    return splines.reshape(*frequency.shape, -1)
