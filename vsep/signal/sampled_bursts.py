"""Burst templates through a smooth response, by one short transform each.

A burst of slope s whose frequency is f at the sample r has the spectrum

    A(g) = exp(j pi/4 sgn s) / sqrt|s| G(g) exp(-j pi (g - f)^2 / s) exp(-j 2 pi g r),

all in cycles per sample, so that both derivatives are factors of it: j 2 pi (g - f) / s by f, and
j pi (g - f)^2 / s^2 - 1 / (2 s) by s. On modes g = m / W the sum over the spectrum has the period W
in the samples: with modes W apart added up, an inverse FFT of length W is the burst at the samples
themselves, and nothing is interpolated.
"""

from functools import lru_cache

import numpy as np
from scipy import fft

from vsep._typing import ComplexArray, FloatArray, IntArray, frozen
from vsep.signal.smooth_response import MAX_GRID, SmoothResponse


def sampled_bursts(
    response: SmoothResponse,
    parameters: tuple[FloatArray, FloatArray, FloatArray],
    sample_rate_hz: float,
    num_samples: int,
    *,
    derivatives: bool = True,
) -> ComplexArray | None:
    """Templates (12) of B bursts and their derivatives, as `SignalModel.template_jet` has them.

    Parameters
    ----------
    response : SmoothResponse
        G.
    parameters : tuple of (B,) float
        Frequency at sample 0, slope, and the sample where the derivatives' frequency is taken.
    sample_rate_hz : float
    num_samples : int
    derivatives : bool
        Whether they are wanted.

    Returns
    -------
    (3, B, N) or (1, B, N) complex, or None
        Template, derivatives by the frequency at the reference and by the slope; None where a chirp
        is so nearly parallel that its transform would be too long.
    """
    start, slope, reference = parameters
    steepness = np.abs(slope) * sample_rate_hz**2
    half_band = max(abs(response.low_hz), abs(response.high_hz))
    # As in `SmoothResponse`: what a burst lasts for, what the response rings for, and once more.
    lasts_s = (3.0 * half_band + 8.0 * np.sqrt(steepness)) / np.maximum(steepness, 1e-300)
    lengths_s = np.maximum(lasts_s, 1.0 / response.step_hz)
    if not np.all(lengths_s * (response.high_hz - response.low_hz) < MAX_GRID):
        return None
    # Powers of two: few different ones
    windows = 2 ** np.ceil(np.log2(lengths_s * sample_rate_hz)).astype(np.int64)
    bursts = np.zeros((3 if derivatives else 1, len(slope), num_samples), dtype=np.complex128)
    for window in np.unique(windows).tolist():
        rows = np.flatnonzero(windows == window)
        chosen = start[rows, None], slope[rows, None], reference[rows, None]
        bursts[:, rows] = _of_one_window(
            response, chosen, sample_rate_hz, num_samples, (window, len(bursts))
        )
    return bursts


def _of_one_window(
    response: SmoothResponse,
    parameters: tuple[FloatArray, FloatArray, FloatArray],
    sample_rate_hz: float,
    num_samples: int,
    sizes: tuple[int, int],
) -> ComplexArray:
    """(D, B, N) of bursts, parameters (B, 1), by transforms of W samples; sizes are W and D."""
    (start, slope, reference), (window, count) = parameters, sizes
    modes, values = _modes(response, sample_rate_hz, window)
    frequency = start + slope * reference
    away = modes / window - frequency  # g - f
    # The template's phase is zero at sample 0.
    first = 2.0 * (frequency - 0.5 * slope * reference) * reference + 0.25 * np.sign(slope)
    first = first - away[:, :1] ** 2 / slope - 2.0 * reference / window * modes[0]
    # Phases of degree two: their ratios have phases of degree one, whose ratios are one number.
    spectra = np.empty((count, *away.shape), dtype=np.complex128)
    ratios = np.empty((len(slope), len(modes) - 1), dtype=np.complex128)
    ratios[:] = np.exp(-2j * np.pi / (slope * window**2))
    ratios[:, :1] = np.exp(
        -1j * np.pi * ((2.0 * away[:, :1] + 1.0 / window) / slope + 2.0 * reference) / window
    )
    spectra[0, :, :1] = np.exp(1j * np.pi * first) / (window * np.sqrt(np.abs(slope)))
    np.cumprod(ratios, axis=1, out=spectra[0, :, 1:])
    np.cumprod(spectra[0], axis=1, out=spectra[0])
    spectra[0] *= values
    if count > 1:
        away *= 2.0 * np.pi / slope
        np.multiply(1j * away, spectra[0], out=spectra[1])
        np.multiply(0.25j / np.pi * away**2 - 0.5 / slope, spectra[0], out=spectra[2])
    folded = np.zeros((count, len(slope), window), dtype=np.complex128)
    cycles = modes // window
    for cycle in range(int(cycles[0]), int(cycles[-1]) + 1):
        some = np.flatnonzero(cycles == cycle)
        place = int(modes[some[0]]) % window
        folded[..., place : place + len(some)] += spectra[..., some[0] : some[-1] + 1]
    signals = fft.ifft(folded, axis=-1, norm="forward", overwrite_x=True)
    n = np.arange(num_samples)
    inside = np.abs(n + start / slope) < 0.5 * window
    return np.asarray(signals[..., n % window] * inside)


@lru_cache(maxsize=32)
def _modes(
    response: SmoothResponse, sample_rate_hz: float, window: int
) -> tuple[IntArray, ComplexArray]:
    """Modes m within the response's support, ascending, and its values at m / W."""
    per_hz = window / sample_rate_hz
    modes = np.arange(np.ceil(response.low_hz * per_hz), np.floor(response.high_hz * per_hz) + 1.0)
    values = response.jet(modes / per_hz)[0]
    return frozen(modes.astype(np.int64)), frozen(np.asarray(values))
