"""Burst templates (12) and their derivatives from the modified response."""

import numpy as np

from vsep._typing import ComplexArray, FloatArray
from vsep.kernels.cis import cis
from vsep.kernels.compiler import compiled


@compiled
def burst_courses(
    start_frequency: FloatArray, slope: FloatArray, sample_rate_hz: float, num_samples: int
) -> tuple[FloatArray, FloatArray]:
    """Frequencies (B, N) in Hz that bursts run through, and their slopes (B, 1) in Hz/s."""
    courses = np.empty((len(slope), num_samples))
    steepness = np.empty((len(slope), 1))
    for b in range(len(slope)):
        first, step = sample_rate_hz * start_frequency[b], sample_rate_hz * slope[b]
        steepness[b, 0] = sample_rate_hz * step
        for n in range(num_samples):
            courses[b, n] = first + step * n  # f + s n, the instantaneous frequency
    return courses, steepness


@compiled
def template_jets(
    parameters: tuple[FloatArray, FloatArray, FloatArray],
    sample_rate_hz: float,
    value: ComplexArray,
    first: ComplexArray,
    second: ComplexArray,
) -> tuple[ComplexArray, ComplexArray]:
    """Templates ``exp(j 2 pi (f n + s n^2 / 2)) Gbar(f + s n; s)`` and their derivatives.

    Parameters
    ----------
    parameters : tuple of (B,) float
        f, s, and the sample where the derivatives' frequency is taken and the phase stands still.
    sample_rate_hz : float
        Unit of the frequencies by which `first` and `second` are derivatives.
    value, first, second : (B, N) complex
        Gbar along the burst's course, and its derivatives by the frequency.

    Returns
    -------
    templates : (B, N) complex
    derivatives : (B, 2, N) complex
        By the frequency at the reference and by the slope; ``dGbar/ds = -j/(4 pi) d^2 Gbar/df^2``.
    """
    start_frequency, slope, reference = parameters
    templates = np.empty(value.shape, dtype=np.complex128)
    derivatives = np.empty((len(slope), 2, value.shape[1]), dtype=np.complex128)
    for b in range(len(slope)):
        f, s = start_frequency[b], slope[b]
        for n in range(value.shape[1]):
            carrier = cis(n * (f + 0.5 * s * n))  # exp(j 2 pi (f n + s n^2 / 2))
            offset = n - reference[b]
            template = carrier * value[b, n]  # U(theta), (12)
            moved = carrier * (sample_rate_hz * first[b, n])
            angular = complex(0.0, 2.0 * np.pi * offset)
            templates[b, n] = template
            # by f at the reference: j 2 pi (n - ref) a + carrier dGbar/df
            derivatives[b, 0, n] = angular * template + moved
            # by s: j pi (n - ref)^2 a + (n - ref) carrier dGbar/df + carrier dGbar/ds
            derivatives[b, 1, n] = (
                0.5 * offset * angular * template
                + offset * moved
                - complex(0.0, 0.25 / np.pi * sample_rate_hz**2) * carrier * second[b, n]
            )
    return templates, derivatives
