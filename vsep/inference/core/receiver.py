"""Errors of the own oscillator and receivers, and a frame without them.

The receiver of `vsep.signal.impairments` delivers ``r = y + epsilon conj(y) + d`` of a frame whose
ramps the own oscillator has turned, ``y = exp(j phi_p) s``. Sources are fitted to

    s = exp(-j phi_p) (r - d - epsilon conj(r - d)) / (1 - |epsilon|^2).

The phase of a ramp is common to its objects and its bursts. The channel of a burst has a phase of
its own in every ramp, so that bursts tell nothing of phi_p, and lose nothing when it is taken off.
A constant and a linear trend of phi_p are what weights and Doppler frequencies are as well: phi_p
has neither.
"""

from dataclasses import dataclass

import numpy as np

from vsep._typing import ComplexArray, FloatArray, frozen


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class ReceiverErrors:
    """Estimated errors of oscillator and receivers; what is not evident is zero.

    Parameters
    ----------
    ramp_phases : (P,) float
        phi_p in rad, one for all antennas.
    phase_std : float
        Standard deviation in rad of the prior of phi_p; zero where there is no jitter.
    image_factors : (A,) complex
        epsilon of every antenna.
    offsets : (A,) complex
        d of every antenna, the same in all ramps: the carrier that leaks into the mixer is that of
        every ramp.

    Examples
    --------
    >>> ideal = np.array([[1.0 + 2.0j, 3.0 - 1.0j]])
    >>> errors = ReceiverErrors(ramp_phases=np.array([0.3]), phase_std=0.3,
    ...                         image_factors=np.array([0.1j]), offsets=np.array([2.0 + 0j]))
    >>> turned = np.exp(0.3j) * ideal
    >>> received = turned + 0.1j * turned.conj() + 2.0
    >>> np.allclose(errors.corrected(received), ideal)
    True
    """

    ramp_phases: FloatArray
    phase_std: float
    image_factors: ComplexArray
    offsets: ComplexArray

    def __post_init__(self) -> None:
        """Freeze the arrays."""
        for name in ("ramp_phases", "image_factors", "offsets"):
            object.__setattr__(self, name, frozen(np.array(getattr(self, name))))

    def corrected(self, received: ComplexArray) -> ComplexArray:
        """Return a frame (A P, N) or (P, N) without the errors."""
        num_ramps, num_samples = len(self.ramp_phases), received.shape[-1]
        frame = received.reshape(-1, num_ramps, num_samples)
        if np.any(self.offsets):
            frame = frame - self.offsets[:, None, None]
        if np.any(self.image_factors):
            factors = self.image_factors[:, None, None]
            frame = (frame - factors * frame.conj()) / (1.0 - np.abs(factors) ** 2)
        if self.phase_std > 0.0:
            frame = np.exp(-1j * self.ramp_phases)[:, None] * frame
        return frame.reshape(received.shape)

    def doppler_variance(self) -> float:
        """Variance of every Doppler frequency by the linear trend of the jitter.

        In (cycles per ramp)^2: ``12 sigma^2 / (4 pi^2 P (P^2 - 1))``. It is common to all objects.

        Examples
        --------
        >>> phases = np.random.default_rng(1).normal(0.0, 0.005, (20_000, 16))
        >>> trend = np.polyfit(np.arange(16.0), phases.T, 1)[0] / (2.0 * np.pi)
        >>> errors = ReceiverErrors(ramp_phases=phases[0], phase_std=0.005,
        ...                         image_factors=np.zeros(1), offsets=np.zeros(1))
        >>> bool(abs(np.var(trend) / errors.doppler_variance() - 1.0) < 0.05)
        True
        """
        num_ramps = len(self.ramp_phases)
        spread = num_ramps * (num_ramps**2 - 1.0) / 12.0
        return self.phase_std**2 / (4.0 * np.pi**2 * spread)

    def of_antenna(self, antenna: int) -> "ReceiverErrors":
        """Return the errors at one of several antennas."""
        one = slice(antenna, antenna + 1)
        return ReceiverErrors(
            ramp_phases=self.ramp_phases,
            phase_std=self.phase_std,
            image_factors=self.image_factors[one],
            offsets=self.offsets[one],
        )


def no_errors(num_ramps: int, num_antennas: int) -> ReceiverErrors:
    """Return the errors of a perfect receiver."""
    nothing = np.zeros(num_antennas, dtype=np.complex128)
    return ReceiverErrors(
        ramp_phases=np.zeros(num_ramps), phase_std=0.0, image_factors=nothing, offsets=nothing
    )
