"""Parametric substitute of a measured response: Butterworth high-pass and low-pass.

    G(f) = gain * exp(-j 2 pi f delay - j pi f^2 bend) * high-pass(f) * low-pass(f)

Both filters are causal and analogue, -3 dB at their cut-offs; gain and delay belong to one antenna,
the rest to all. ``bend`` is what a wrong slope difference leaves: 1/true less 1/assumed. A filter
of this kind bends the phase by a known amount, which tells the slope difference where nobody does.
"""

from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

from vsep._typing import ComplexArray, FloatArray
from vsep.signal.receiver_response import ReceiverResponse

HIGH_PASS_ORDER = 2
LOW_PASS_ORDER = 10
FITTED_BAND = 0.55  # sample rates; further out bursts show next to nothing
START_HIGH_PASS = 0.02  # cut-offs in sample rates where the fit starts
START_LOW_PASS = 0.4
MIN_HIGH_PASS = 1e-4  # what a receiver without a high-pass comes out at


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class ParametricResponse:
    """A Butterworth high-pass and low-pass fitted to a response."""

    #: -3 dB frequencies
    high_pass_hz: float
    low_pass_hz: float
    #: 1/true slope difference less 1/assumed one, in s^2; zero where it was not free
    bend_s2: float
    #: (A,) residual energy over the energy of the response of every antenna, inside the fitted band
    errors: FloatArray

    @property
    def sections(self) -> FloatArray:
        """(S, 6) second-order sections of the analogue filter: numerator and denominator in s."""
        return np.concatenate(
            [
                _sections(self.high_pass_hz, HIGH_PASS_ORDER, high_pass=True),
                _sections(self.low_pass_hz, LOW_PASS_ORDER, high_pass=False),
            ]
        )

    def corrected_slope(self, slope_hz_per_s: float) -> float:
        """Slope difference in the place of the assumed one."""
        return 1.0 / (1.0 / slope_hz_per_s + self.bend_s2)


def fit_parametric(
    response: ReceiverResponse, sample_rate_hz: float, *, free_bend: bool = False
) -> ParametricResponse:
    """Fit cut-offs, gains and delays to all antennas together, by least squares.

    `response`: as measured; `sample_rate_hz`: sets the band that is fitted; `free_bend`: whether
    the slope difference is in question.
    """
    inside = np.abs(response.frequency_hz) <= FITTED_BAND * sample_rate_hz
    frequency_hz = response.frequency_hz[inside]
    measured = response.response[:, inside]
    measured = measured / np.linalg.norm(measured, axis=1, keepdims=True)
    # Everything of order one: cut-offs by their logarithm, delays in samples, the bend in cycles at
    # a quarter of the sample rate.
    bend_unit = 16.0 / sample_rate_hz**2

    def templates(parameters: FloatArray) -> ComplexArray:
        high_pass_hz, low_pass_hz = np.exp(parameters[:2]) * sample_rate_hz
        bend = parameters[2] * bend_unit if free_bend else 0.0
        delays = parameters[3:, None] / sample_rate_hz
        phase = 2.0 * np.pi * frequency_hz * delays + np.pi * frequency_hz**2 * bend
        shape = butterworth(frequency_hz, high_pass_hz, low_pass_hz) * np.exp(-1j * phase)
        shape = shape / np.linalg.norm(shape, axis=1, keepdims=True)
        gains = np.sum(shape.conj() * measured, axis=1, keepdims=True)
        return np.asarray(gains * shape)

    def residuals(parameters: FloatArray) -> FloatArray:
        residual = (measured - templates(parameters)).ravel()
        return np.concatenate([residual.real, residual.imag])

    delays = np.zeros(len(measured))
    cut_offs = np.log([START_HIGH_PASS, START_LOW_PASS])
    # Lag of the causal filter at the start, in samples, which the response lacks on average.
    lag = -LOW_PASS_ORDER / (2.0 * np.pi * START_LOW_PASS)
    start = np.concatenate([cut_offs, [0.0], delays + lag])
    lowest = np.concatenate([[np.log(MIN_HIGH_PASS), np.log(0.02), -1.0], delays - 50.0])
    highest = np.concatenate([[np.log(0.1), 0.0, 1.0], delays + 50.0])
    best = least_squares(residuals, start, bounds=(lowest, highest))
    residual = measured - templates(best.x)
    return ParametricResponse(
        high_pass_hz=float(np.exp(best.x[0]) * sample_rate_hz),
        low_pass_hz=float(np.exp(best.x[1]) * sample_rate_hz),
        bend_s2=float(best.x[2] * bend_unit) if free_bend else 0.0,
        errors=np.asarray(np.sum(np.abs(residual) ** 2, axis=1)),
    )


def butterworth(frequency_hz: FloatArray, high_pass_hz: float, low_pass_hz: float) -> ComplexArray:
    """Complex response of both filters.

    Examples
    --------
    >>> import numpy as np
    >>> np.abs(butterworth(np.array([0.3e6, 8e6]), 0.3e6, 8e6)).round(3)
    array([0.707, 0.707])
    """
    s = 2j * np.pi * np.asarray(frequency_hz)
    response = np.ones(s.shape, dtype=np.complex128)
    sections = np.concatenate(
        [
            _sections(high_pass_hz, HIGH_PASS_ORDER, high_pass=True),
            _sections(low_pass_hz, LOW_PASS_ORDER, high_pass=False),
        ]
    )
    for b2, b1, b0, a2, a1, a0 in sections:
        response *= (b2 * s**2 + b1 * s + b0) / (a2 * s**2 + a1 * s + a0)
    return response


def _sections(cutoff_hz: float, order: int, *, high_pass: bool) -> FloatArray:
    """(order / 2, 6) coefficients of s^2, s, 1 of numerators and denominators."""
    radius = 2.0 * np.pi * cutoff_hz
    angles = np.pi * (0.5 + (np.arange(order // 2) + 0.5) / order)
    damping = -2.0 * radius * np.cos(angles)
    ones, zeros = np.ones(order // 2), np.zeros(order // 2)
    top = [ones, zeros, zeros] if high_pass else [zeros, zeros, ones * radius**2]
    return np.stack([*top, ones, damping, ones * radius**2], axis=1)
