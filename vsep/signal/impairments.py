"""Errors of the victim's own oscillator and of its receivers, in the order of a homodyne receiver.

With the ideal signal s(n, p) of objects, bursts and noise a receiver delivers

    r(n, p) = y(n, p) + epsilon conj(y(n, p)) + d,   y(n, p) = exp(j theta(n, p)) s(n, p).

The phase theta is a constant of every ramp (jitter) and a process within the ramps (phase noise).
The oscillator that mixes down the objects' echoes mixes down the bursts as well, so both are turned
by theta. The image factor epsilon of gain and phase between the I and Q branches and the offset d
of their converters are constants.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from vsep._typing import ComplexArray, FloatArray, frozen
from vsep.parameters import PARAMETERS


@dataclass(frozen=True, kw_only=True, slots=True)
class ReceiverImpairments:
    """What is wrong with an oscillator and its receivers; nothing by default.

    Parameters
    ----------
    phase_jitter_rad : float
        Standard deviation of one phase a ramp, independent from ramp to ramp.
    phase_noise_rad : float
        Standard deviation of the phase noise within a ramp, a first-order low-pass process that
        begins anew with every ramp.
    phase_noise_bandwidth_hz : float
        Frequency at which its spectrum has fallen to half.
    iq_gain_db, iq_phase_deg : float
        By how much the gain of the Q branch is larger than that of the I branch, and by how much
        the angle between them differs from 90 degrees.
    dc_offset : float
        Magnitude of the offset in standard deviations of a sample's noise.

    Examples
    --------
    Half a decibel and three degrees make images 28.3 dB below the lines.

    >>> factor = ReceiverImpairments(iq_gain_db=0.5, iq_phase_deg=3.0).image_factor
    >>> round(float(20.0 * np.log10(abs(factor))), 1)
    -28.2
    """

    phase_jitter_rad: float = 0.0
    phase_noise_rad: float = 0.0
    phase_noise_bandwidth_hz: float = 100e3
    iq_gain_db: float = 0.0
    iq_phase_deg: float = 0.0
    dc_offset: float = 0.0

    def __post_init__(self) -> None:
        """Check the ranges."""
        for setting, name in _SETTINGS.items():
            PARAMETERS[setting].require(getattr(self, name))

    @property
    def image_factor(self) -> complex:
        """Epsilon of the gain g and the phase psi: (1 - g e^(-j psi)) / (1 + g e^(-j psi)).

        With the branches I = Re s and Q = g Im(s e^(j psi)); the gain of s is left out.
        """
        gain = 10.0 ** (self.iq_gain_db / 20.0) * np.exp(-1j * np.deg2rad(self.iq_phase_deg))
        return complex((1.0 - gain) / (1.0 + gain))


_SETTINGS = {
    "phase_jitter": "phase_jitter_rad",
    "phase_noise": "phase_noise_rad",
    "phase_noise_bandwidth": "phase_noise_bandwidth_hz",
    "iq_gain": "iq_gain_db",
    "iq_phase": "iq_phase_deg",
    "dc_offset": "dc_offset",
}


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class TrueReceiver:
    """What oscillator and receivers did to a simulated frame.

    Parameters
    ----------
    ramp_phases_rad : (P,) float
        Mean of theta over each ramp, by jitter and phase noise.
    phase_noise_rad : float
        Standard deviation of what is left of theta within the ramps.
    image_factor : complex
        epsilon.
    offset : complex or (A,) complex
        d, at every antenna.
    """

    ramp_phases_rad: FloatArray
    phase_noise_rad: float
    image_factor: complex
    offset: ComplexArray

    def of_antenna(self, antenna: int) -> "TrueReceiver":
        """Return what happened at one of several antennas."""
        return replace(self, offset=self.offset[antenna])


def impairments_of(options: Mapping[str, Any]) -> ReceiverImpairments | None:
    """Return the impairments among keywords in SI units; None where there is none.

    Examples
    --------
    >>> impairments_of({"phase_jitter_rad": 0.0, "num_objects": 3}) is None
    True
    >>> impairments_of({"phase_jitter_rad": 0.005}).phase_jitter_rad
    0.005
    """
    own = {name: options[name] for name in _SETTINGS.values() if name in options}
    width = "phase_noise_bandwidth_hz"
    none = all(value == 0.0 for name, value in own.items() if name != width)
    return None if none else ReceiverImpairments(**own)


def impaired(
    signal: ComplexArray,
    impairments: ReceiverImpairments,
    *,
    noise_power: float,
    sample_rate_hz: float,
    rng: np.random.Generator,
) -> tuple[ComplexArray, TrueReceiver]:
    """Return what a receiver delivers of an ideal signal.

    Parameters
    ----------
    signal : (P, N) or, of several antennas with one oscillator, (A, P, N) complex
        Objects, bursts and noise.
    impairments : ReceiverImpairments
        What is wrong.
    noise_power : float
        Of a sample, which the offset is relative to.
    sample_rate_hz : float
        f_s.
    rng : numpy.random.Generator
        Draws phases and the angle of every offset.

    Returns
    -------
    received : complex array
        Of the shape of the signal.
    TrueReceiver
        What was drawn.
    """
    num_ramps, num_samples = signal.shape[-2:]
    draws = rng.standard_normal((num_ramps, num_samples + 1))
    jitter = impairments.phase_jitter_rad * draws[:, :1]
    decay = np.exp(-2.0 * np.pi * impairments.phase_noise_bandwidth_hz / sample_rate_hz)
    noise = draws[:, 1:] * np.sqrt(1.0 - decay**2)
    noise[:, 0] = draws[:, 1]  # stationary from the first sample on
    for n in range(1, num_samples):  # `scipy.signal` takes a quarter of a second to load
        noise[:, n] += decay * noise[:, n - 1]
    theta = jitter + impairments.phase_noise_rad * noise
    angles = rng.uniform(0.0, 2.0 * np.pi, signal.shape[:-2])
    offset = impairments.dc_offset * np.sqrt(noise_power) * np.exp(1j * angles)
    turned = np.exp(1j * theta) * signal
    received = turned + impairments.image_factor * np.conj(turned) + offset[..., None, None]
    phases = theta.mean(axis=1)
    return received, TrueReceiver(
        ramp_phases_rad=frozen(phases),
        phase_noise_rad=float(np.std(theta - phases[:, None])),
        image_factor=impairments.image_factor,
        offset=frozen(np.asarray(offset, dtype=np.complex128)),
    )
