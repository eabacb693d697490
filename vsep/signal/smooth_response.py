"""Modified response of a smooth response of finite support.

Completing the square in the convolution with K (see `vsep.signal.modified_response`) leaves a
Fourier transform of a function of finite support,

    Gbar(f; Delta k) = K(f) * integral of [G(f') exp(-j pi f'^2 / Delta k)] exp(j 2 pi x f') df',

at x = f / Delta k, which need not lie on a grid. It is evaluated with one FFT per slope
difference and a short interpolation kernel (nonuniform FFT); G' and G'' in the place of G give the
derivatives. The cost grows with the square of the band over Delta k: a few hundred points for the
slopes that automotive radars meet.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from scipy.fft import ifft, next_fast_len

from vsep._typing import ComplexArray, FloatArray, IntArray, frozen
from vsep.signal.response_jet import ResponseJet, nonparallel

# Nearly parallel chirps would need more points than this; Gbar = G - (j Delta k / 4 pi) G'' then
# holds to second order in Delta k.
MAX_GRID = 2**17
# Slopes whose points together stay below this are transformed at once; some 100 MB.
_MAX_BLOCK = 2**19
# Kernel exp(beta (sqrt(1 - z^2) - 1)) of this many points on a twofold oversampled grid errs by
# 10^-(points - 1) at beta = 2.3 points (Barnett, Magland and af Klinteberg, 2019): -220 dB.
_KERNEL_POINTS = 12
_KERNEL_BETA = 2.3 * _KERNEL_POINTS

Jet = tuple[ComplexArray, ComplexArray, ComplexArray]


@dataclass(frozen=True, slots=True, eq=False)
class SmoothResponse:
    """A response with two continuous derivatives.

    Parameters
    ----------
    jet : callable
        Gives the response and its first two derivatives at frequencies in Hz.
    low_hz, high_hz : float
        Outside of these it is zero.
    step_hz : float
        Step of an integral over the response, fine enough for its details.
    """

    jet: Callable[[FloatArray], Jet]
    low_hz: float
    high_hz: float
    step_hz: float

    def modified_response_jet(
        self, frequency_hz: FloatArray, slope_difference_hz_per_s: FloatArray | float
    ) -> ResponseJet:
        """Gbar with derivatives by f; `InputError` for a slope difference of zero."""
        slope = nonparallel(slope_difference_hz_per_s)
        frequency, slope = np.broadcast_arrays(np.asarray(frequency_hz, dtype=np.float64), slope)
        jet = np.zeros((3, *frequency.shape), dtype=np.complex128)
        half_band = max(abs(self.low_hz), abs(self.high_hz))
        # Outside of this the smooth response has no energy, whatever the chirp.
        highest = 2.0 * half_band + 8.0 * np.sqrt(np.abs(slope))
        step = np.minimum(self.step_hz, np.abs(slope) / (highest + half_band))
        steep = step * MAX_GRID > self.high_hz - self.low_hz
        inside = np.abs(frequency) <= highest
        parallel, crossing = inside & ~steep, inside & steep
        jet[:, parallel] = self._nearly_parallel(frequency[parallel], slope[parallel])
        if np.any(crossing):
            # Halved as often as need be: few different grids, see `_sampled`
            halvings = np.ceil(np.log2(self.step_hz / step[steep].min()))
            finest = self.step_hz / 2.0 ** float(halvings)
            jet[:, crossing] = self._transform(frequency[crossing], slope[crossing], finest)
        return ResponseJet(jet[0], jet[1], jet[2])

    def _nearly_parallel(self, frequency_hz: FloatArray, slope: FloatArray) -> ComplexArray:
        value, first, second = self.jet(frequency_hz)
        return np.stack([value - 0.25j / np.pi * slope * second, first, second])

    def _transform(self, frequency_hz: FloatArray, slope: FloatArray, step: float) -> ComplexArray:
        """(3, M) jet at M frequencies, each with its slope, from integrals of the given step."""
        low, high = self.low_hz, self.high_hz
        slopes, row = np.unique(slope, return_inverse=True)
        num_modes = 2 * next_fast_len(int(np.ceil((high - low) / step / 2.0)) + 1)
        modes = np.arange(num_modes) - num_modes // 2
        centre = 0.5 * (low + high)
        grid = centre + step * modes
        num_bins = 2 * next_fast_len(num_modes)
        squares = -1j * np.pi * grid**2
        responses = _prepared(self, step, num_modes, num_bins)
        position = frequency_hz / slope
        integral = np.empty((3, len(position)), dtype=np.complex128)
        block = max(1, _MAX_BLOCK // num_modes)
        for first in range(0, len(slopes), block):
            chosen = (row >= first) & (row < first + block)
            chirps = np.exp(squares / slopes[first : first + block, None])
            integral[:, chosen] = _nonuniform_inverse_dft(
                responses, chirps, num_bins, row[chosen] - first, position[chosen] * step
            )
        kernel = np.exp(
            0.25j * np.pi * np.sign(slope) - 1j * np.pi * frequency_hz * position
        ) / np.sqrt(np.abs(slope))
        return np.asarray(integral * (step * kernel * np.exp(2j * np.pi * position * centre)))


@lru_cache(maxsize=16)
def _prepared(response: SmoothResponse, step: float, num_modes: int, num_bins: int) -> ComplexArray:
    """(3, num_modes) jet of a response on the grid of an integral; the same for most slopes.

    The interpolation that follows is taken off.
    """
    modes = np.arange(num_modes) - num_modes // 2
    grid = 0.5 * (response.low_hz + response.high_hz) + step * modes
    jet = np.stack(response.jet(np.asarray(grid, dtype=np.float64)))
    return frozen(jet / _kernel_transform(num_modes, num_bins))


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
    coefficients: ComplexArray,
    chirps: ComplexArray,
    num_bins: int,
    row: IntArray,
    cycles: FloatArray,
) -> ComplexArray:
    """Sum over m coefficients[:, m] chirps[row, m] exp(j 2 pi cycles (m - M/2)), M even.

    `coefficients` (A, M): A quantities, the interpolation taken off; `chirps` (S, M); `num_bins`
    of the transform; `row` (Q,): the chirp of every query; `cycles` (Q,): cycles per mode of every
    query. Returns (A, Q).
    """
    count, half = len(coefficients), coefficients.shape[1] // 2
    padded = np.zeros((count, len(chirps), num_bins), dtype=np.complex128)
    for part, modes in ((slice(half), slice(half, None)), (slice(-half, None), slice(half))):
        np.multiply(coefficients[:, None, modes], chirps[:, modes], out=padded[..., part])
    bins = ifft(padded, axis=-1, norm="forward", overwrite_x=True).reshape(count, -1)
    position = cycles * num_bins
    first = np.ceil(position - 0.5 * _KERNEL_POINTS).astype(np.int64)
    start = row * num_bins
    total = np.zeros((count, len(cycles)), dtype=np.complex128)
    for point in range(_KERNEL_POINTS):
        index = first + point
        weight = _kernel((position - index) * (2.0 / _KERNEL_POINTS))
        total += np.take(bins, start + index % num_bins, axis=1) * weight
    return total
