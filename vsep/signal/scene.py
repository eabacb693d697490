"""Scene: paths of the object channel, interferers with their channels, and levels."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from vsep._typing import BoolArray, ComplexArray, FloatArray, IntArray, frozen
from vsep._validation import require_choice
from vsep.errors import InputError
from vsep.parameters import PARAMETERS, WAVEFORMS
from vsep.signal.impairments import TrueReceiver
from vsep.signal.radar import InterfererSequence


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class Channel:
    """A multipath channel: the spectral lines of (5) or (29).

    Parameters
    ----------
    delays_s : (L,) float
        Two-way delays of objects, or one-way excess delays of interference paths.
    dopplers_hz : (L,) float
        Doppler frequencies nu, positive for a growing distance.
    weights : (L,) complex
        Path weights; only their ratios matter, SNR and SIR set the levels.
    groups : (L,) int or None
        Number of the extended object that a line is of, -1 of points; None where all are points.
    doppler_rates_hz_per_s : (L,) float or None
        Change of the Doppler frequencies, which are those in mid-frame then; None without.
    """

    delays_s: FloatArray
    dopplers_hz: FloatArray
    weights: ComplexArray
    groups: IntArray | None = None
    doppler_rates_hz_per_s: FloatArray | None = None

    def __post_init__(self) -> None:
        """Freeze the arrays; they must be of one length and finite."""
        arrays: tuple[Any, ...] = (self.delays_s, self.dopplers_hz, self.weights)
        lengths = [np.shape(array) for array in arrays]
        if self.doppler_rates_hz_per_s is not None:
            rates = frozen(np.array(self.doppler_rates_hz_per_s, dtype=np.float64))
            object.__setattr__(self, "doppler_rates_hz_per_s", rates)
            arrays += (rates,)
            lengths.append(rates.shape)
        if self.groups is not None:
            lengths.append(np.shape(self.groups))
            object.__setattr__(self, "groups", frozen(np.array(self.groups, dtype=np.int64)))
        if len(set(lengths)) != 1 or len(lengths[0]) != 1:
            raise InputError(f"delays, dopplers, weights have shapes {lengths}; all must be (L,).")
        if not all(np.all(np.isfinite(array)) for array in arrays):
            raise InputError(
                "A channel holds NaN or infinity; delays, dopplers and weights must be finite."
            )
        object.__setattr__(self, "delays_s", frozen(np.array(self.delays_s, dtype=np.float64)))
        dopplers_hz = np.array(self.dopplers_hz, dtype=np.float64)
        object.__setattr__(self, "dopplers_hz", frozen(dopplers_hz))
        object.__setattr__(self, "weights", frozen(np.array(self.weights, dtype=np.complex128)))

    @property
    def num_paths(self) -> int:
        """Number of spectral lines L."""
        return len(self.delays_s)


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class Interferer:
    """One interfering radar and the channel between it and the victim.

    Parameters
    ----------
    sequence : InterfererSequence
        When it sends, and its chirps.
    channel : Channel
        From it to the victim.
    waveform : str
        One of `vsep.parameters.WAVEFORMS`, see `vsep.signal.transmitters`.
    seed : int
        Draws hops, codes and symbols.
    """

    sequence: InterfererSequence
    channel: Channel
    waveform: str = PARAMETERS["interferer_waveform"].default
    seed: int = 0

    def __post_init__(self) -> None:
        """Check the waveform."""
        require_choice("The waveform", self.waveform, tuple(WAVEFORMS))


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class Scene:
    """Objects, interferers and their levels.

    Parameters
    ----------
    objects : Channel
        The object channel.
    interferers : tuple of Interferer
        None, one or several; their relative levels are set by their channel weights.
    snr_db : float
        (25), total energy of the object signal over the noise power of one sample.
    sir_db : float
        (26), total energy of the object signal over that of the interference.
    """

    objects: Channel
    interferers: tuple[Interferer, ...] = ()
    snr_db: float
    sir_db: float = PARAMETERS["sir_db"].default

    def __post_init__(self) -> None:
        """Check the levels."""
        PARAMETERS["snr_db"].require(self.snr_db)
        PARAMETERS["sir_db"].require(self.sir_db)


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class TrueBurst:
    """One crossing of the victim's band, with the parameters of (12) in Hz."""

    ramp: int  #: the victim's ramp p
    start_frequency_hz: float  #: intermediate frequency at the ramp's first sample
    slope_hz_per_s: float  #: Delta k, slope of the interferer minus that of the victim


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class GroundTruth:
    """Ground truth of a simulated frame; no estimator ever receives it.

    Parameters
    ----------
    beats, dopplers : (L,) float
        Normalised frequencies in [-1/2, 1/2), cycles per sample and per ramp.
    amplitudes : (L,) or, of several antennas, (L, A) complex
        Weights of unit-norm atoms (10). Empty arrays where the objects are not known.
    object_signal, interference_signal : (P, N) or (A, P, N) complex
        The two sources. Of a real frame the object signal is the frame itself, noise included.
    bursts : tuple of TrueBurst
        Every crossing of the pass band.
    noise_precision : float
        lambda in 1/power; NaN for a real frame.
    angles_deg : (L,) float or None
        Directions of the objects, where a line of antennas received them.
    interferer_angles_deg : (I,) float or None
        Directions of the interferers, likewise.
    receiver : TrueReceiver or None
        What oscillator and receivers did to the frame, where they were not perfect.
    waveforms : tuple of str
        What the interferers sent, see `vsep.parameters.WAVEFORMS`. Those that send no chirps make
        no `bursts`; `perfect_mask` says where their noise is.
    groups : (L,) int or None
        As `Channel.groups`.
    curvatures : (L,) float or None
        Half of the changes of the Doppler frequencies from ramp to ramp; None without.
    """

    beats: FloatArray
    dopplers: FloatArray
    amplitudes: ComplexArray
    object_signal: ComplexArray
    interference_signal: ComplexArray
    bursts: tuple[TrueBurst, ...]
    noise_precision: float
    angles_deg: FloatArray | None = None
    interferer_angles_deg: FloatArray | None = None
    receiver: TrueReceiver | None = None
    waveforms: tuple[str, ...] = ()
    groups: IntArray | None = None
    curvatures: FloatArray | None = None

    def of_antenna(self, antenna: int) -> "GroundTruth":
        """Return what one of several antennas received; directions stay."""
        return replace(
            self,
            amplitudes=self.amplitudes[:, antenna],
            object_signal=self.object_signal[antenna],
            interference_signal=self.interference_signal[antenna],
            receiver=None if self.receiver is None else self.receiver.of_antenna(antenna),
        )

    def interfered_samples(self, relative_level: float = 1e-3) -> BoolArray:
        """(P, N) mask of samples whose interference power exceeds `relative_level` of its peak."""
        power = np.abs(self.interference_signal) ** 2
        peak = power.max(initial=0.0)
        mask: BoolArray = (power > relative_level * peak) & (peak > 0.0)
        return mask

    def perfect_mask(self, share_of_noise: float = 1.0) -> BoolArray:
        """(P, N) mask of the samples that a repair must replace, as nobody but the truth knows it.

        A sample counts as interfered where the power of the interference exceeds this share of the
        noise power. Keeping a sample that holds less costs less than losing it. A real frame has no
        known noise power: there it is 30 dB below the interference's peak, `interfered_samples`.
        """
        if np.isnan(self.noise_precision):
            return self.interfered_samples()
        power = np.abs(self.interference_signal) ** 2
        mask: BoolArray = power * self.noise_precision > share_of_noise
        return mask


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class Observation:
    """A received frame, and the truth where it is known.

    Parameters
    ----------
    received : (P, N) or, of several antennas, (A, P, N) complex
        r(n, p) in the paper's sign, slow time first.
    truth : GroundTruth or None
        Known for simulated frames only.
    """

    received: ComplexArray
    truth: GroundTruth | None = None
