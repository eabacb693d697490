"""Delay and range-Doppler spectra of frames.

In the paper's sign an object turns as exp(-j 2 pi beat n): its spectrum is the *inverse* DFT
(footnote 5 of the paper). Powers are scaled so that the peak of an object's line is its
abs(amplitude)^2 for a unit-norm atom; white noise of power sigma^2 a sample then has the mean power
sigma^2 with a rectangular window and, in each dimension, 1.5 times that with a Hann window.
"""

from typing import Literal, NamedTuple, TypeAlias

import numpy as np
from scipy.fft import fft, ifft

from vsep._typing import ComplexArray, FloatArray, IntArray
from vsep._validation import require_range
from vsep.errors import InputError
from vsep.kernels.moving_atoms import STATIONARY, Migration
from vsep.signal.atoms import doppler_course
from vsep.signal.dithered_atoms import Coupling, RampDither
from vsep.signal.dithered_spectra import dithered_spectrum
from vsep.signal.keystone import keystone_dopplers, keystone_transform

Window: TypeAlias = Literal["hann", "rectangular"]


class DelaySpectrum(NamedTuple):
    """Power over the beat frequency."""

    beats: FloatArray  #: (M,) ascending, in cycles per sample
    power: FloatArray  #: (..., M) linear; the leading axes are those of the signal


class RangeDopplerMap(NamedTuple):
    """Power over Doppler and beat frequency."""

    dopplers: FloatArray  #: (Mp,) ascending, in cycles per ramp
    beats: FloatArray  #: (Mn,) ascending, in cycles per sample
    power: FloatArray  #: (Mp, Mn) linear


class Spectrogram(NamedTuple):
    """Power over time and frequency."""

    times: FloatArray  #: (T,) ascending, in samples: middles of the windows
    frequencies: FloatArray  #: (M,) ascending, in cycles per sample
    power: FloatArray  #: (T, M) linear


def delay_spectrum(
    signal: ComplexArray,
    zero_padding: int = 4,
    window: Window = "hann",
    *,
    lowest_beat: float = -0.5,
) -> DelaySpectrum:
    """Compute the power spectrum along fast time.

    Parameters
    ----------
    signal : (N,) or (P, N) complex
        One ramp or several; each has its own spectrum.
    zero_padding : int
        M/N, from 1 to 64.
    window : str
        "hann" (side lobes fall at 18 dB an octave) or "rectangular".
    lowest_beat : float
        The axis runs from here over one cycle per sample.

    Returns
    -------
    DelaySpectrum
        Of one ramp of a frame of P ramps an object keeps abs(amplitude)^2 / P.

    Raises
    ------
    InputError
        If the signal has no sample or more than two axes, or an argument is out of its range.

    Examples
    --------
    >>> import numpy as np
    >>> signal = 2.0 * np.exp(-2j * np.pi * 0.125 * np.arange(64)) / 8.0
    >>> beats, power = delay_spectrum(signal)
    >>> float(beats[np.argmax(power)]), float(power.max().round(9))
    (0.125, 4.0)
    """
    array = _checked(signal, (1, 2))
    beats, spectrum = _line_spectrum(array, zero_padding, window, lowest_beat)
    return DelaySpectrum(beats, np.abs(spectrum) ** 2)


def range_doppler_map(
    signal: ComplexArray,
    zero_padding: int = 4,
    window: Window = "hann",
    *,
    lowest_beat: float = -0.5,
    migration: Coupling = STATIONARY,
    doppler: float | None = None,
) -> RangeDopplerMap:
    """Compute the power over Doppler and beat frequency, both axes windowed and zero-padded.

    Parameters
    ----------
    signal : (P, N) complex
        A frame. A single ramp has a single Doppler bin, at zero.
    zero_padding, window, lowest_beat
        As for `delay_spectrum`; the Doppler axis runs from -1/2.
    migration : Coupling
        That of the radar, which is compensated; none by default. Of dithered ramps the map is the
        transform over their true starts.
    doppler : float, optional
        Doppler frequency in cycles per ramp, of any size, along which it is compensated: an object
        of this velocity is one peak, at its beat frequency at mid-frame and its Doppler frequency
        modulo one. By default every row is compensated along its own velocity, and the axis is
        that of `keystone_dopplers`.

    Raises
    ------
    InputError
        If the signal is not two-dimensional or an argument is out of its range.
    """
    array = _checked(signal, (2,))
    if isinstance(migration, RampDither):
        return _dithered_map(array, zero_padding, window, lowest_beat, migration, doppler)
    if migration.coupling != 0.0:
        if doppler is None:
            return _keystone_map(array, zero_padding, window, lowest_beat, migration)
        # What its phase has beyond that of an object that stays in its cell
        course = doppler_course(array.shape, migration)
        array = array * np.exp(2j * np.pi * doppler * (course - np.arange(len(array))[:, None]))
    beats, delays = _line_spectrum(array, zero_padding, window, lowest_beat)
    slow_padding = zero_padding if len(array) > 1 else 1
    dopplers, spectrum = _line_spectrum(delays.T, slow_padding, window, -0.5)
    return RangeDopplerMap(dopplers, beats, np.ascontiguousarray(np.abs(spectrum.T) ** 2))


def spectrogram(signal: ComplexArray, window_samples: int, *, zero_padding: int = 4) -> Spectrogram:
    """Compute the power of the short-time Fourier transform of one ramp, with a Hann window.

    Parameters
    ----------
    signal : (N,) complex
        One ramp. Frequencies are intermediate frequencies: a burst of increasing frequency rises,
        an object in the paper's sign lies at minus its beat frequency.
    window_samples : int
        W, from 2 to N; one window for every sample, with zeros beyond the ramp.
    zero_padding : int
        M/W, from 1 to 64.

    Raises
    ------
    InputError
        If the signal is no ramp, or an argument is out of its range.

    Examples
    --------
    >>> import numpy as np
    >>> times, frequencies, power = spectrogram(np.exp(0.5j * np.pi * np.arange(64)), 16)
    >>> float(frequencies[power[32].argmax()]), power.shape
    (0.25, (64, 64))
    """
    array = _checked(signal, (1,))
    require_range("window_samples", window_samples, 2, len(array))
    require_range("zero_padding", zero_padding, 1, 64)
    before = (window_samples - 1) // 2
    padded = np.pad(array, (before, window_samples - 1 - before))
    windows = np.lib.stride_tricks.sliding_window_view(padded, window_samples)
    num_bins = zero_padding * window_samples
    weights = hann_window(window_samples)
    spectrum = fft(windows * (weights / np.linalg.norm(weights)), n=num_bins, axis=-1)
    frequencies = (np.arange(num_bins) - num_bins // 2) / num_bins
    power = np.abs(np.roll(spectrum, num_bins // 2, axis=-1)) ** 2
    return Spectrogram(np.arange(len(array), dtype=np.float64), frequencies, power)


def _keystone_map(
    signal: ComplexArray,
    zero_padding: int,
    window: Window,
    lowest_beat: float,
    migration: Migration,
) -> RangeDopplerMap:
    num_ramps, num_samples = signal.shape
    weights = window_weights(num_ramps, window)[:, None] * window_weights(num_samples, window)
    scaled = signal * (weights * (signal.size / weights.sum()))
    first = migration._replace(folds=0)
    products = keystone_transform(scaled[None].astype(np.complex64), first, int(zero_padding))[0]
    bins, order = _bins(int(zero_padding) * num_samples, lowest_beat)
    power = np.abs(products[:, order]).astype(np.float64) ** 2
    return RangeDopplerMap(keystone_dopplers(signal.shape, first, int(zero_padding)), bins, power)


def _dithered_map(
    signal: ComplexArray,
    zero_padding: int,
    window: Window,
    lowest_beat: float,
    dither: RampDither,
    doppler: float | None,
) -> RangeDopplerMap:
    if dither.motion.coupling != 0.0:
        weights = window_weights(len(signal), window)[:, None]
        weights = weights * window_weights(signal.shape[1], window)
        scaled = signal * (weights * (np.sqrt(signal.size) / weights.sum()))
        beats, order = _bins(int(zero_padding) * signal.shape[1], lowest_beat)
        dopplers = _bins(int(zero_padding) * len(signal), -0.5)[0]
        moving = dithered_spectrum(scaled[None], dither, dopplers, len(beats), along=doppler)[0]
        return RangeDopplerMap(dopplers, beats, np.abs(moving[:, order]) ** 2)
    beats, delays = _line_spectrum(signal, zero_padding, window, lowest_beat)
    dopplers = _bins(int(zero_padding) * len(signal), -0.5)[0]
    weights = window_weights(len(signal), window)
    delays *= np.exp(2j * np.pi * dither.samples[:, None] * dither.unambiguous(beats))
    turns = np.exp(2j * np.pi * dopplers[:, None] * dither.ramps)
    spectrum = (turns * (weights * (np.sqrt(len(signal)) / weights.sum()))) @ delays
    return RangeDopplerMap(dopplers, beats, np.abs(spectrum) ** 2)


def hann_window(num_samples: int) -> FloatArray:
    """Weights of a Hann window without its two zeros: a single sample has weight one.

    Examples
    --------
    >>> hann_window(3).round(3)
    array([0.5, 1. , 0.5])
    """
    phase = np.pi * (np.arange(num_samples) + 1.0) / (num_samples + 1.0)
    return np.asarray(np.sin(phase) ** 2)


def _checked(signal: ComplexArray, num_axes: tuple[int, ...]) -> ComplexArray:
    array = np.asarray(signal, dtype=np.complex128)
    if array.ndim not in num_axes or array.size == 0:
        allowed = " or ".join(str(count) for count in num_axes)
        raise InputError(
            f"The signal has shape {array.shape}; it must have {allowed} axes and not be empty."
        )
    return array


def _line_spectrum(
    signal: ComplexArray, zero_padding: int, window: Window, lowest: float
) -> tuple[FloatArray, ComplexArray]:
    """Frequencies, ascending, and the windowed inverse DFT along the last axis."""
    require_range("zero_padding", zero_padding, 1, 64)
    num_samples = signal.shape[-1]
    num_bins = int(zero_padding) * num_samples
    weights = window_weights(num_samples, window)
    scaled = signal * (weights * (np.sqrt(num_samples) / weights.sum()))
    spectrum = ifft(scaled, n=num_bins, axis=-1, norm="forward")
    frequencies, order = _bins(num_bins, lowest)
    return frequencies, spectrum[..., order]


def _bins(num_bins: int, lowest: float) -> tuple[FloatArray, IntArray]:
    """Frequencies, ascending from the lowest one, and where a transform has them."""
    require_range("lowest_beat", lowest, -1.0, 0.0, "cycles per sample")
    bins = np.arange(num_bins) + int(np.ceil(lowest * num_bins))
    return bins / num_bins, bins % num_bins


def window_weights(num_samples: int, window: Window) -> FloatArray:
    """(N,) weights of a window by its name; `InputError` if there is none of that name."""
    if window == "rectangular":
        return np.ones(num_samples)
    if window == "hann":
        return hann_window(num_samples)
    raise InputError(f"The window is {window!r}; it must be 'hann' or 'rectangular'.")
