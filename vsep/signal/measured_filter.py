"""Measured anti-aliasing filter: complex samples over frequency.

Between the samples the response is a cubic spline. Beyond the outermost samples their value fades
to zero smoothly over one eighth of the measured band on either side, so that a response which
stops abruptly does not ring.

Completing the square in the convolution with K (see `vsep.signal.modified_response`) leaves a
Fourier transform of a function of finite support,

    Gbar(f; Delta k) = K(f) * integral of [G(f') exp(-j pi f'^2 / Delta k)] exp(j 2 pi x f') df',

at x = f / Delta k, which need not lie on a grid. It is evaluated with one FFT per slope
difference and a short interpolation kernel (nonuniform FFT); G' and G'' in the place of G give the
derivatives. The cost grows with the square of the band over Delta k: a few hundred points for the
slopes that automotive radars meet.
"""

from functools import lru_cache
from typing import Literal

import numpy as np
from scipy.fft import ifft, next_fast_len

from vsep._typing import ComplexArray, FloatArray, IntArray, frozen
from vsep.errors import InputError
from vsep.signal.cubic_spline import CubicSpline
from vsep.signal.modified_response import ModifiedResponse, ResponseJet, nonparallel

_FADE_SHARE = 0.125
# Nearly parallel chirps would need more points than this; Gbar = G - (j Delta k / 4 pi) G'' then
# holds to second order in Delta k.
_MAX_GRID = 2**17
# Slopes whose points together stay below this are transformed at once; some 100 MB.
_MAX_BLOCK = 2**19
# Kernel exp(beta (sqrt(1 - z^2) - 1)) of this many points on a twofold oversampled grid errs by
# 10^-(points - 1) at beta = 2.3 points (Barnett, Magland and af Klinteberg, 2019): -220 dB.
_KERNEL_POINTS = 12
_KERNEL_BETA = 2.3 * _KERNEL_POINTS


class MeasuredFilter(ModifiedResponse):
    """Filter given by complex samples of its response; equal to itself only.

    Parameters
    ----------
    frequency_hz : (M,) float
        Ascending, irregular spacing allowed, at least four.
    response : (M,) complex
        G at these frequencies; a delay common to all samples is allowed.

    Raises
    ------
    InputError
        If the arrays do not fit together, are not finite or ascending, or the response is zero.

    Examples
    --------
    >>> import numpy as np
    >>> frequency_hz = np.linspace(-2e6, 2e6, 41)
    >>> measured = MeasuredFilter(
    ...     frequency_hz=frequency_hz, response=1.0 / (1.0 + 1j * frequency_hz / 1e6)
    ... )
    >>> measured.response(np.array([0.0, 1e6, 9e6])).round(6)
    array([1. +0.j , 0.5-0.5j, 0. +0.j ])
    """

    def __init__(self, *, frequency_hz: FloatArray, response: ComplexArray) -> None:
        frequency, samples = _checked(frequency_hz, response)
        self._frequency_hz = frozen(frequency)
        self._samples = frozen(samples)
        self._spline = _spline_with_fades(frequency, samples)
        self._step_hz = max(
            float(np.median(np.diff(frequency))) / 2.0,
            2.0 * float(np.ptp(self._spline.knots)) / _MAX_GRID,
        )

    def __repr__(self) -> str:
        """Describe number and range of the samples."""
        low, high = self._frequency_hz[[0, -1]]
        return f"MeasuredFilter({len(self._samples)} samples from {low:g} to {high:g} Hz)"

    @property
    def kind(self) -> Literal["measured"]:
        """Name of the family."""
        return "measured"

    @property
    def frequency_hz(self) -> FloatArray:
        """(M,) frequencies of the samples."""
        return self._frequency_hz

    @property
    def samples(self) -> ComplexArray:
        """(M,) complex samples of the response."""
        return self._samples

    @property
    def cutoff_hz(self) -> float:
        """Outermost absolute frequency whose sample reaches half of the largest magnitude."""
        magnitude = np.abs(self._samples)
        return float(np.abs(self._frequency_hz[2.0 * magnitude >= magnitude.max()]).max())

    def response(self, frequency_hz: FloatArray) -> ComplexArray:
        """Complex response G(f), zero beyond the fades."""
        return self._spline.jet(np.asarray(frequency_hz, dtype=np.float64))[0]

    def modified_response_jet(
        self, frequency_hz: FloatArray, slope_difference_hz_per_s: FloatArray | float
    ) -> ResponseJet:
        """Gbar with derivatives by f; `InputError` for a slope difference of zero."""
        slope = nonparallel(slope_difference_hz_per_s)
        frequency, slope = np.broadcast_arrays(np.asarray(frequency_hz, dtype=np.float64), slope)
        jet = np.zeros((3, *frequency.shape), dtype=np.complex128)
        half_band = np.abs(self._spline.knots[[0, -1]]).max()
        # Outside of this the smooth response has no energy, whatever the chirp.
        highest = 2.0 * half_band + 8.0 * np.sqrt(np.abs(slope))
        step = np.minimum(self._step_hz, np.abs(slope) / (highest + half_band))
        steep = step * _MAX_GRID > np.ptp(self._spline.knots)
        inside = np.abs(frequency) <= highest
        parallel, crossing = inside & ~steep, inside & steep
        jet[:, parallel] = self._nearly_parallel(frequency[parallel], slope[parallel])
        if np.any(crossing):
            finest = step[steep].min()
            jet[:, crossing] = self._transform(frequency[crossing], slope[crossing], finest)
        return ResponseJet(jet[0], jet[1], jet[2])

    def _nearly_parallel(self, frequency_hz: FloatArray, slope: FloatArray) -> ComplexArray:
        value, first, second = self._spline.jet(frequency_hz)
        return np.stack([value - 0.25j / np.pi * slope * second, first, second])

    def _transform(self, frequency_hz: FloatArray, slope: FloatArray, step: float) -> ComplexArray:
        """(3, M) jet at M frequencies, each with its slope, from integrals of the given step."""
        low, high = self._spline.knots[[0, -1]]
        slopes, row = np.unique(slope, return_inverse=True)
        num_modes = 2 * next_fast_len(int(np.ceil((high - low) / step / 2.0)) + 1)
        modes = np.arange(num_modes) - num_modes // 2
        centre = 0.5 * (low + high)
        grid = centre + step * modes
        responses = np.stack(self._spline.jet(grid))
        position = frequency_hz / slope
        integral = np.empty((3, len(position)), dtype=np.complex128)
        block = max(1, _MAX_BLOCK // num_modes)
        for first in range(0, len(slopes), block):
            chosen = (row >= first) & (row < first + block)
            chirps = np.exp(-1j * np.pi * grid**2 / slopes[first : first + block, None])
            integral[:, chosen] = _nonuniform_inverse_dft(
                responses[:, None, :] * chirps, row[chosen] - first, position[chosen] * step
            )
        kernel = np.exp(
            0.25j * np.pi * np.sign(slope) - 1j * np.pi * frequency_hz * position
        ) / np.sqrt(np.abs(slope))
        return np.asarray(integral * (step * kernel * np.exp(2j * np.pi * position * centre)))


def _checked(frequency_hz: FloatArray, response: ComplexArray) -> tuple[FloatArray, ComplexArray]:
    try:
        frequency = np.array(frequency_hz, dtype=np.float64)
        samples = np.array(response, dtype=np.complex128)
    except (TypeError, ValueError):
        raise InputError("The measured filter holds no numbers; give two numeric arrays.") from None
    if frequency.ndim != 1 or frequency.shape != samples.shape or len(frequency) < 4:
        raise InputError(
            f"The measured filter has {frequency.shape} frequencies and {samples.shape} samples; "
            "both must be one-dimensional, of one length and at least 4 long."
        )
    if not (np.all(np.isfinite(frequency)) and np.all(np.isfinite(samples))):
        raise InputError("The measured filter holds NaN or infinity; all its samples are finite.")
    if not np.all(np.diff(frequency) > 0.0):
        raise InputError("The measured filter's frequencies are not ascending; sort them.")
    if not np.any(samples):
        raise InputError("The measured filter is zero everywhere; one sample must be nonzero.")
    return frequency, samples


def _spline_with_fades(frequency: FloatArray, samples: ComplexArray) -> CubicSpline:
    """Cubic spline through the samples and through a fade to zero on either side."""
    share = np.arange(1, 9) / 8.0
    offset = share * _FADE_SHARE * (frequency[-1] - frequency[0])
    # Smooth step whose first two derivatives vanish at both ends.
    fade = 1.0 - share**3 * (10.0 - 15.0 * share + 6.0 * share**2)
    knots = np.concatenate([frequency[0] - offset[::-1], frequency, frequency[-1] + offset])
    values = np.concatenate([samples[0] * fade[::-1], samples, samples[-1] * fade])
    return CubicSpline(knots, values)


@lru_cache(maxsize=32)
def _kernel_transform(num_modes: int, num_bins: int) -> FloatArray:
    """(num_modes,) Fourier transform of the interpolation kernel at the modes, by quadrature."""
    nodes, weights = np.polynomial.legendre.leggauss(40)
    modes = np.arange(num_modes) - num_modes // 2
    phases = np.pi * _KERNEL_POINTS / num_bins * np.outer(modes, nodes)
    transform: FloatArray = np.cos(phases) @ (0.5 * _KERNEL_POINTS * weights * _kernel(nodes))
    return frozen(transform)


def _kernel(position: FloatArray) -> FloatArray:
    """Interpolation kernel, zero outside of [-1, 1]."""
    root = np.sqrt(np.maximum(1.0 - position**2, 0.0))
    return np.asarray(np.exp(_KERNEL_BETA * (root - 1.0)))


def _nonuniform_inverse_dft(
    coefficients: ComplexArray, row: IntArray, cycles: FloatArray
) -> ComplexArray:
    """Sum over m coefficients[:, row, m] exp(j 2 pi cycles (m - M/2)), M even.

    `coefficients` (A, S, M): A quantities for S rows; `row` (Q,): the row of every query; `cycles`
    (Q,): cycles per mode of every query. Returns (A, Q).
    """
    num_modes = coefficients.shape[-1]
    num_bins = 2 * next_fast_len(num_modes)
    padded = np.zeros((*coefficients.shape[:-1], num_bins), dtype=np.complex128)
    scaled = coefficients / _kernel_transform(num_modes, num_bins)
    padded[..., : num_modes // 2] = scaled[..., num_modes // 2 :]
    padded[..., -(num_modes // 2) :] = scaled[..., : num_modes // 2]
    bins = ifft(padded, axis=-1, norm="forward")
    position = cycles * num_bins
    first = np.ceil(position - 0.5 * _KERNEL_POINTS).astype(np.int64)
    total = np.zeros((coefficients.shape[0], len(cycles)), dtype=np.complex128)
    for point in range(_KERNEL_POINTS):
        index = first + point
        weight = _kernel((position - index) * (2.0 / _KERNEL_POINTS))
        total += bins[:, row, index % num_bins] * weight
    return total
