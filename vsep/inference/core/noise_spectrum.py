"""Noise spectrum over beat frequency, estimated from what both sources leave of a frame.

A receiver's noise is shaped by its filters and rises towards zero frequency. Lines in noise of a
smooth spectrum are estimated as well by the weights of white noise, but what a line must exceed,
and how far its place can be trusted, is the level at its beat frequency.

The logarithm of the spectrum is a sum of bumps of several widths, of the assumed filter's shape and
of the logarithm of the frequency: a generalised linear model of the periodogram, which is
Gamma-distributed (Whittle's likelihood). Terms are added one by one as long as the score test of
the next is convincing; without any the noise is white.
"""

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from scipy import fft

from vsep._typing import ComplexArray, FloatArray, frozen
from vsep.inference.core.skirt import estimate_skirt
from vsep.signal.template import SignalModel

CONVINCING = 20.0  # score statistic, chi-square with one degree of freedom, of a first term ...
STILL_CONVINCING = 12.0  # ... where the noise was not white before ...
FURTHER = 8.0  # ... and of a further one, whose uncertainty the thresholds account for
MAX_TERMS = 24
LOWER_SHARE = 0.75  # of the Doppler cells, the quieter ones: weak objects are not noise
FEWEST_ROWS = 8  # with fewer, lines and noise cannot be told apart
NARROWEST_BUMP = 4.0  # half width in cells
# Close to zero frequency noise rises from cell to cell: a smooth level is uncertain by a fifth.
STEEP_CELLS, STEEP_VARIANCE = 2, 0.04
LOWEST_RESPONSE = 0.01  # of the filter, relative to its largest: noise leaks into the stop band
CLIPPED = 8.0  # deviations over the fitted level: a cell that is more is no noise
FIT_STEPS = 12
LOWEST_LEVEL = (
    0.25  # of the mean: in a stop band spurs and what leaks from the ramps' ends are no lines
)


@dataclass(frozen=True, slots=True, eq=False)
class NoiseSpectrum:
    """Noise power over beat frequency, common to all antennas.

    Parameters
    ----------
    power : (N,) float
        Variance of a sample's noise if the whole spectrum had the level at beat n/N; its mean is
        the noise power.
    variance : (N,) float
        Relative variance of the estimate.
    own_skirt : float
        Share of an object's power in a sample by which its own phase noise has raised the level at
        its beat; zero without phase noise.
    phase_noise : float
        Standard deviation of the phase noise that the level holds, in rad.

    Examples
    --------
    >>> spectrum = NoiseSpectrum(np.array([2.0, 1.0, 1.0, 4.0]), np.full(4, 0.01))
    >>> spectrum.level(np.array([0.0, -0.25, 0.125]))
    array([2. , 4. , 1.5])
    """

    power: FloatArray
    variance: FloatArray
    own_skirt: float = 0.0
    phase_noise: float = 0.0

    def __post_init__(self) -> None:
        """Freeze the arrays."""
        for name in ("power", "variance"):
            object.__setattr__(self, name, frozen(np.array(getattr(self, name), np.float64)))

    def level(self, beats: FloatArray) -> FloatArray:
        """Noise power at beat frequencies in cycles per sample, between the cells linearly."""
        return _between(self.power, beats)

    def cautious_level(self, beats: FloatArray, threshold: float) -> FloatArray:
        """Return the level that noise exceeds T times as often as a known level.

        Over a level estimated with the relative variance v, an exponential variable follows a
        Pareto law: ``(1 + T' v)^(-1/v) = exp(-T)``, so that ``T' = (exp(T v) - 1) / v``.

        Examples
        --------
        >>> spectrum = NoiseSpectrum(np.ones(8), np.full(8, 0.01))
        >>> spectrum.cautious_level(np.zeros(1), 12.0).round(4)
        array([1.0625])
        """
        exponent = threshold * np.maximum(_between(self.variance, beats), 1e-9)
        return np.asarray(self.level(beats) * np.expm1(exponent) / exponent)

    def scaled(self, factor: float) -> "NoiseSpectrum":
        """Return the spectrum times a factor."""
        return replace(self, power=self.power * factor)

    def differs_from(self, other: "NoiseSpectrum") -> bool:
        """Whether this spectrum is another by more than its own uncertainty."""
        change = np.log(self.power / other.power) ** 2
        return bool(np.any(change > self.variance))

    def burst_level(self, model: SignalModel) -> float:
        """Noise power that the template of a burst across the band sees, (12).

        Its spectrum is nearly the filter's: ``sum |G|^2 S / sum |G|^2``.
        """
        weights = filter_power(model)
        return float(weights @ self.power / weights.sum())


def filter_power(model: SignalModel) -> FloatArray:
    """(N,) squared magnitude of the assumed filter at the beats n/N, relative to its largest."""
    # A beat of nu is a rotation by exp(-j 2 pi nu n): the frequency -nu at the filter.
    frequency = np.asarray(-np.fft.fftfreq(model.num_samples) * model.sample_rate_hz, np.float64)
    power = np.abs(model.anti_aliasing_filter.response(frequency)) ** 2
    return np.asarray(power / power.max())


def _between(values: FloatArray, beats: FloatArray) -> FloatArray:
    """Values at beats between the cells, linearly and around the circle."""
    size = len(values)
    place = np.asarray(beats) * size
    left = np.floor(place).astype(np.int64)
    share = place - left
    return np.asarray((1.0 - share) * values[left % size] + share * values[(left + 1) % size])


def estimate_noise_spectrum(
    noise_residual: ComplexArray,
    model: SignalModel,
    *,
    convincing: float = CONVINCING,
    lines: tuple[FloatArray, FloatArray] | None = None,
) -> NoiseSpectrum | None:
    """Noise spectrum of rows that hold nothing but noise and a few weak lines.

    Parameters
    ----------
    noise_residual : (A, P, N) complex
        What objects and bursts leave of the ramps to look at.
    model : SignalModel
        Sampling and assumed filter.
    convincing : float
        Score statistic that the first term needs.
    lines : tuple of two (L,) float, optional
        Beats of the objects and their powers in a sample: around them phase noise is looked for.

    Returns
    -------
    NoiseSpectrum or None
        None where nothing speaks against white noise.

    Examples
    --------
    >>> from vsep.signal.filters import NoFilter
    >>> model = SignalModel(num_ramps=16, num_samples=128, sample_rate_hz=1e6,
    ...                     anti_aliasing_filter=NoFilter())
    >>> draws = np.random.default_rng(1).standard_normal((2, 1, 16, 128))
    >>> white = draws[0] + 1j * draws[1]
    >>> estimate_noise_spectrum(white, model) is None
    True
    >>> sloped = white + 0.9 * np.roll(white, 1, axis=2)
    >>> level = estimate_noise_spectrum(sloped, model).level(np.array([0.0, 0.25]))
    >>> true_level = 2.0 * abs(1.0 + 0.9 * np.array([1.0, 1j])) ** 2
    >>> abs(10.0 * np.log10(level / true_level)).round()
    array([0., 0.])
    """
    if noise_residual.shape[0] * noise_residual.shape[1] < FEWEST_ROWS:
        return None
    periodogram, looks = quiet_periodogram(noise_residual)
    skirt = None if lines is None else estimate_skirt(periodogram, looks, *lines)
    if skirt is None:
        return _smooth_spectrum(periodogram, looks, model, convincing)
    smooth = _smooth_spectrum(periodogram / skirt.shape, looks, model, convincing)
    if smooth is None:
        level = float(np.mean(periodogram / skirt.shape))
        smooth = NoiseSpectrum(np.full(len(periodogram), level), np.full(len(periodogram), 0.0))
    return NoiseSpectrum(
        smooth.power * skirt.shape,
        smooth.variance + skirt.variance,
        skirt.own_level,
        skirt.phase_std,
    )


def _smooth_spectrum(
    periodogram: FloatArray, looks: float, model: SignalModel, convincing: float
) -> NoiseSpectrum | None:
    """Spectrum without lines; None where nothing speaks against white noise."""
    terms, centred, norms = spectral_terms(model.num_samples, filter_power(model).tobytes())
    # Against white noise, which is nearly always all there is to do
    excess = _excess(periodogram, np.full(periodogram.shape, np.log(periodogram.mean())), looks)
    if float((looks * (centred @ excess) ** 2 / norms).max()) <= convincing:
        return None
    means = terms.mean(axis=1)
    energies = norms + len(periodogram) * means**2
    active: list[int] = []
    basis = np.ones((1, len(periodogram)))
    coefficients = np.array([np.log(np.mean(periodogram))])
    for _ in range(MAX_TERMS):
        excess = _excess(periodogram, coefficients @ basis, looks)
        # score test: what of each term the active ones do not explain already
        orthonormal = np.linalg.qr(basis.T)[0]
        explained = terms @ orthonormal
        left = energies - np.einsum("jk,jk->j", explained, explained)
        beside = terms @ excess - explained @ (orthonormal.T @ excess)
        usable = left > 0.05 * energies
        score = np.where(usable, looks * beside**2 / np.maximum(left, 1e-12), 0.0)
        best = int(np.argmax(score))
        if score[best] <= (FURTHER if active else convincing):
            break
        active.append(best)
        basis = np.concatenate([basis, terms[best : best + 1]])
        coefficients = _fitted(periodogram, basis, np.append(coefficients, 0.0), looks)
    # Fisher information of the coefficients is `looks` times the Gram matrix of the terms.
    orthonormal = np.linalg.qr(basis.T)[0]
    variance = np.einsum("nk,nk->n", orthonormal, orthonormal) / looks
    variance[np.arange(-STEEP_CELLS, STEEP_CELLS + 1)] += STEEP_VARIANCE
    power = np.exp(coefficients @ basis)
    return NoiseSpectrum(np.maximum(power, LOWEST_LEVEL * power.mean()), variance)


def quiet_periodogram(noise_residual: ComplexArray) -> tuple[FloatArray, float]:
    """Mean periodogram over the quieter Doppler cells, without bias, and its number of looks.

    Parameters
    ----------
    noise_residual : (A, P, N) complex
        The ramps.

    Returns
    -------
    periodogram : (N,) float
        Of the beats n/N.
    looks : float
        Relative variance of a cell is one over this.
    """
    num_samples = noise_residual.shape[2]
    spectra = fft.ifft2(noise_residual, axes=(1, 2), norm="ortho")
    power = (spectra.real**2 + spectra.imag**2).reshape(-1, num_samples)
    rows = len(power)
    count = int(np.ceil(LOWER_SHARE * rows))
    # Along rows of memory it takes a third of the time.
    ordered = np.partition(np.ascontiguousarray(power.T), count - 1, axis=1)
    lowest = np.ascontiguousarray(ordered[:, :count].T).mean(axis=0)
    # mean of the `count` lowest of `rows` exponential variables of mean one
    steps = np.cumsum(1.0 / np.arange(rows, rows - count, -1))
    return lowest / steps.mean(), LOWER_SHARE * rows


@lru_cache(maxsize=8)
def spectral_terms(
    num_samples: int, filter_bytes: bytes
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """(J, N) terms of the log spectrum: the filter's, that of 1/f noise, bumps of dyadic widths.

    Also the terms without their means, and the squared norms (J,) of these.
    """
    beats = np.fft.fftfreq(num_samples)
    response = np.frombuffer(filter_bytes)
    rows = [np.log(np.maximum(np.abs(beats), 0.5 / num_samples))]
    if response.min() < LOWEST_RESPONSE * 10.0:
        rows.append(np.log(response + LOWEST_RESPONSE))
    width = num_samples / 4.0
    while width >= NARROWEST_BUMP:
        for centre in np.arange(0.0, num_samples, width / 2.0):
            apart = (np.arange(num_samples) - centre + num_samples / 2) % num_samples
            apart -= num_samples / 2
            inside = np.abs(apart) < width
            rows.append(np.where(inside, 0.5 + 0.5 * np.cos(np.pi * apart / width), 0.0))
        width /= 2.0
    terms = np.array(rows)
    centred = terms - terms.mean(axis=1, keepdims=True)
    return frozen(terms), frozen(centred), frozen(np.einsum("jn,jn->j", centred, centred))


def _excess(periodogram: FloatArray, log_level: FloatArray, looks: float) -> FloatArray:
    """Relative excess of the periodogram over a level, with outliers of few looks clipped."""
    ratio = periodogram * np.exp(-log_level)
    return np.asarray(np.minimum(ratio, 1.0 + CLIPPED / np.sqrt(looks)) - 1.0)


def _fitted(
    periodogram: FloatArray, basis: FloatArray, coefficients: FloatArray, looks: float
) -> FloatArray:
    """Maximise Whittle's likelihood by Fisher scoring, whose matrix is that of the basis."""
    inverse = np.linalg.pinv(basis.T)
    for _ in range(FIT_STEPS):
        # The logarithm bounds a step where the level is far off.
        step = inverse @ np.minimum(_excess(periodogram, coefficients @ basis, looks), 2.0)
        coefficients = coefficients + step
        if float(np.abs(step).max()) < 1e-3:
            break
    return coefficients
