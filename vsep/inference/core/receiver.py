"""Errors of the own oscillator and receivers, and a frame without them.

The receiver of `vsep.signal.impairments` delivers ``r = y + epsilon conj(y) + d`` of a frame that
the own oscillator has turned, ``y = exp(j theta) s``. Sources are fitted to

    s = exp(-j theta) (r - d - epsilon conj(r - d)) / (1 - |epsilon|^2).

The offset d is a constant and, where the receiver settles in every ramp, a transient, see
`vsep.inference.core.settling`.

The phase theta(n, p) is common to objects and bursts. Of the mean over a ramp the bursts tell
nothing, and lose nothing when it is taken off: their channel has a phase of its own in every ramp.
A mean and a linear trend of theta over all ramps, and a trend along all ramps, are what weights,
Doppler and beat frequencies are as well; they stay there.
"""

from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

import numpy as np

from vsep._typing import ComplexArray, FloatArray, frozen
from vsep.units import to_db, wrap_frequency

FINER = 8  # places of a spectrum in a cell


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class PhasePrior:
    """Gaussian prior of theta: a constant of every ramp and a first-order process within it.

    Its autocovariance over k samples of a ramp is ``jitter_std^2 + noise_std^2 exp(-2 pi w k)``.

    Parameters
    ----------
    jitter_std, noise_std : float
        Standard deviations in rad; zero where there is none.
    half_width : float
        w in cycles per sample: where the spectrum of the process has fallen to half.

    Examples
    --------
    >>> PhasePrior(jitter_std=0.005).mean_variance(64)
    2.5e-05
    """

    jitter_std: float = 0.0
    noise_std: float = 0.0
    half_width: float = 0.0

    @property
    def decay(self) -> float:
        """Correlation of neighbouring samples."""
        return float(np.exp(-2.0 * np.pi * self.half_width))

    def mean_variance(self, num_samples: int) -> float:
        """Variance of the mean over a ramp of so many samples."""
        return self.jitter_std**2 + self._variance_of(np.full(num_samples, 1.0 / num_samples))

    def trend_variance(self, num_samples: int) -> float:
        """Variance of the linear trend over the samples of a ramp, in (rad per sample)^2."""
        centred = np.arange(num_samples) - (num_samples - 1) / 2.0
        return self._variance_of(centred / (centred @ centred))

    def spectrum(self, apart: FloatArray, num_samples: int) -> FloatArray:
        """Mean periodogram of theta over a ramp at beats that are so far from a line.

        Examples
        --------
        >>> PhasePrior(jitter_std=0.1).spectrum(np.array([0.0, 1 / 8]), 8).round(6)
        array([0.08, 0.  ])
        """
        lags = np.arange(num_samples)
        covariance = self.jitter_std**2 + self.noise_std**2 * self.decay**lags
        tapered = (1.0 - lags / num_samples) * covariance
        grid = FINER * num_samples
        level = np.maximum(2.0 * np.fft.fft(tapered, grid).real - tapered[0], 0.0)
        places = np.abs(wrap_frequency(apart)) * grid
        return np.asarray(np.interp(places, np.arange(grid), level), np.float64)

    def _variance_of(self, weights: FloatArray) -> float:
        """Variance of a weighted sum of the process."""
        if self.noise_std == 0.0:
            return 0.0
        products = np.correlate(weights, weights, "full")[len(weights) - 1 :]
        covariance = self.noise_std**2 * self.decay ** np.arange(len(weights))
        return float(2.0 * products @ covariance - products[0] * covariance[0])


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class ReceiverErrors:
    """Estimated errors of oscillator and receivers; what is not evident is zero.

    Parameters
    ----------
    phases : (P, 1) or (P, N) float
        theta in rad, one for all antennas.
    prior : PhasePrior
        Of theta.
    image_factors : (A,) complex
        epsilon of every antenna.
    offsets : (A,) complex
        d of every antenna, the same in all ramps: the carrier that leaks into the mixer is that of
        every ramp.
    explained : float
        Share of the noise that the phases explain: lambda is that of the rest.
    transients : (A, N) complex or None
        What the settling of every receiver adds to d over a ramp; None where none is evident.

    Examples
    --------
    >>> ideal = np.array([[1.0 + 2.0j, 3.0 - 1.0j]])
    >>> errors = replace(no_errors(1, 1), phases=np.array([[0.3]]), offsets=np.array([2.0 + 0j]),
    ...                  image_factors=np.array([0.1j]), prior=PhasePrior(jitter_std=0.3))
    >>> turned = np.exp(0.3j) * ideal
    >>> received = turned + 0.1j * turned.conj() + 2.0
    >>> np.allclose(errors.corrected(received), ideal)
    True
    """

    phases: FloatArray
    prior: PhasePrior
    image_factors: ComplexArray
    offsets: ComplexArray
    explained: float = 0.0
    transients: ComplexArray | None = None

    def __post_init__(self) -> None:
        """Freeze the arrays."""
        for name in ("phases", "image_factors", "offsets"):
            object.__setattr__(self, name, frozen(np.array(getattr(self, name))))
        if self.transients is not None:
            object.__setattr__(self, "transients", frozen(np.array(self.transients)))

    @property
    def turns(self) -> bool:
        """Whether there is any phase."""
        return self.prior.jitter_std > 0.0 or self.prior.noise_std > 0.0

    def corrected(self, received: ComplexArray) -> ComplexArray:
        """Return a frame (A P, N) or (P, N) without the errors."""
        num_ramps, num_samples = len(self.phases), received.shape[-1]
        frame = received.reshape(-1, num_ramps, num_samples)
        if np.any(self.offsets):
            frame = frame - self.offsets[:, None, None]
        if self.transients is not None:
            frame = frame - self.transients[:, None]
        if np.any(self.image_factors):
            factors = self.image_factors[:, None, None]
            frame = (frame - factors * frame.conj()) / (1.0 - np.abs(factors) ** 2)
        if self.turns:
            frame = np.exp(-1j * self.phases) * frame
        return frame.reshape(received.shape)

    def beat_variance(self, num_samples: int) -> float:
        """Variance of all beat frequencies by the trend of theta along all ramps."""
        return self.prior.trend_variance(num_samples) / (4.0 * np.pi**2 * len(self.phases))

    def doppler_variance(self, num_samples: int) -> float:
        """Variance of all Doppler frequencies by the trend of theta over the ramps.

        In (cycles per ramp)^2: ``12 var / (4 pi^2 P (P^2 - 1))`` of the variance of a ramp's mean.

        Examples
        --------
        >>> phases = np.random.default_rng(1).normal(0.0, 0.005, (20_000, 16))
        >>> trend = np.polyfit(np.arange(16.0), phases.T, 1)[0] / (2.0 * np.pi)
        >>> errors = replace(no_errors(16, 1), prior=PhasePrior(jitter_std=0.005))
        >>> bool(abs(np.var(trend) / errors.doppler_variance(64) - 1.0) < 0.05)
        True
        """
        num_ramps = len(self.phases)
        spread = num_ramps * (num_ramps**2 - 1.0) / 12.0
        return self.prior.mean_variance(num_samples) / (4.0 * np.pi**2 * spread)

    def figures(self, sample_rate_hz: float, noise_precision: float) -> dict[str, Any]:
        """Return what is evident by name, in the units of the names; of several antennas as lists.

        Parameters
        ----------
        sample_rate_hz : float
            f_s.
        noise_precision : float
            lambda: ``dc_offset`` is in standard deviations of a sample's noise.

        Examples
        --------
        >>> replace(no_errors(8, 1), image_factors=np.array([0.02j])).figures(1e6, 1.0)
        {'iq_gain_db': [0.0], 'iq_phase_deg': [2.292]}
        """
        prior = self.prior
        found: dict[str, Any] = {}
        if prior.jitter_std > 0.0:
            found["phase_jitter_rad"] = _short(prior.jitter_std)
        if prior.noise_std > 0.0:
            found["phase_noise_rad"] = _short(prior.noise_std)
            found["phase_noise_bandwidth_hz"] = _short(prior.half_width * sample_rate_hz)
        if np.any(self.image_factors):
            # epsilon = (1 - g e^(-j psi)) / (1 + g e^(-j psi))
            gains = (1.0 - self.image_factors) / (1.0 + self.image_factors)
            found["iq_gain_db"] = [_short(2.0 * float(to_db(abs(gain)))) for gain in gains]
            found["iq_phase_deg"] = [_short(-float(np.rad2deg(np.angle(gain)))) for gain in gains]
        if np.any(self.offsets):
            size = np.abs(self.offsets) * np.sqrt(noise_precision)
            found["dc_offset"] = [_short(float(offset)) for offset in size]
        if self.transients is not None:
            lasts = [int(np.flatnonzero(own).max(initial=-1)) + 1 for own in self.transients]
            found["settling_s"] = [_short(last / sample_rate_hz) for last in lasts]
        return found

    def of_antenna(self, antenna: int) -> "ReceiverErrors":
        """Return the errors at one of several antennas."""
        one = slice(antenna, antenna + 1)
        return replace(
            self,
            image_factors=self.image_factors[one],
            offsets=self.offsets[one],
            transients=None if self.transients is None else self.transients[one],
        )


def _short(value: float) -> float:
    return float(f"{value:.4g}")


@lru_cache(maxsize=16)
def no_errors(num_ramps: int, num_antennas: int) -> ReceiverErrors:
    """Return the errors of a perfect receiver."""
    nothing = np.zeros(num_antennas, dtype=np.complex128)
    return ReceiverErrors(
        phases=np.zeros((num_ramps, 1)),
        prior=PhasePrior(),
        image_factors=nothing,
        offsets=nothing,
    )
