"""State that an estimator hands from one iteration to the next.

A state holds all the next step needs and nothing else; what is said about the step stands in
`vsep.inference.core.progress`. All arrays are read-only.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np

from vsep._typing import BoolArray, ComplexArray, FloatArray, IntArray, frozen
from vsep.inference.core.noise_spectrum import NoiseSpectrum
from vsep.inference.core.receiver import ReceiverErrors
from vsep.inference.core.search_cache import SearchCache
from vsep.signal.corrected_filter import NUM_SPLINES


def _freeze_arrays(record: Any, *names: str) -> None:
    for name in names:
        value = getattr(record, name)
        if value.flags.writeable:
            object.__setattr__(record, name, frozen(value))


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class ObjectComponents:
    """Posterior of the L object components, q(alpha) with the parameters zeta.

    Parameters
    ----------
    component_ids : (L,) int
        Stable identity, never reused, so that a view can follow one component.
    beats : (L,) float
        Normalised beat frequency in [-1/2, 1/2), cycles per sample.
    dopplers : (L,) float
        Normalised Doppler frequency in [-1/2, 1/2), cycles per ramp; zero for a single ramp.
    amplitudes : (L,) or, of several antennas, (L, A) complex
        Posterior mean (58), weight of a unit-norm atom.
    covariance : (L, L) complex
        Posterior covariance (59), Hermitian; at every antenna.
    precisions : (L,) float
        Prior precisions gamma_alpha.
    curvatures : (L,) float or None
        Of objects that accelerate, see `vsep.signal.chirped_atoms`; None where there are none.
    """

    component_ids: IntArray
    beats: FloatArray
    dopplers: FloatArray
    amplitudes: ComplexArray
    covariance: ComplexArray
    precisions: FloatArray
    curvatures: FloatArray | None = None

    def __post_init__(self) -> None:
        """Freeze the arrays."""
        _freeze_arrays(
            self, "component_ids", "beats", "dopplers", "amplitudes", "covariance", "precisions"
        )
        if self.curvatures is not None:
            _freeze_arrays(self, "curvatures")

    def chosen(self, which: BoolArray) -> "ObjectComponents":
        """Return some of the components, `which` (L,) bool."""
        return replace(
            self,
            component_ids=self.component_ids[which],
            beats=self.beats[which],
            dopplers=self.dopplers[which],
            amplitudes=self.amplitudes[which],
            covariance=self.covariance[np.ix_(which, which)],
            precisions=self.precisions[which],
            curvatures=None if self.curvatures is None else self.curvatures[which],
        )

    @property
    def num_components(self) -> int:
        """Number of components L."""
        return len(self.component_ids)

    @property
    def powers(self) -> FloatArray:
        """(L,) squared magnitudes of the weights; the antennas' mean."""
        powers = self.amplitudes.real**2 + self.amplitudes.imag**2
        return np.asarray(powers if powers.ndim == 1 else powers.mean(axis=1))

    @property
    def component_snr(self) -> FloatArray:
        """(L,) component SNR omega^2/rho - 1 in white noise, linear; the antennas' mean."""
        variance = np.real(np.diagonal(self.covariance))  # C_ll
        rho = 1.0 / (1.0 / variance - self.precisions)  # (23)
        magnitudes = np.abs(self.amplitudes)
        if magnitudes.ndim == 2:
            magnitudes = np.sqrt(np.mean(magnitudes**2, axis=1))
        omega = rho * magnitudes / variance  # (24)
        snr: FloatArray = omega**2 / rho - 1.0
        return snr


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class BurstComponents:
    """One burst and its interference channel, q(beta) with the chirp parameters theta.

    Parameters
    ----------
    ramp : int
        The ramp it lies in; a ramp can hold several.
    start_frequency : float
        Delta f_0 in cycles per sample: the burst's frequency at the ramp's first sample.
    slope : float
        Delta k in cycles per sample squared.
    active_bins : (K,) int
        Active bins of the channel grid of 2N bins: delay of bin k is k/(2N) cycles per sample.
    amplitudes : (K,) complex
        Posterior mean (61).
    covariance : (K, K) complex
        Posterior covariance (62).
    precisions : (K,) float
        Prior precisions gamma_beta.
    energy : float
        Of the burst's samples, the sum of their squared magnitudes.
    antenna : int
        Where it was received; its start frequency and slope are those at the other antennas.
    """

    ramp: int
    start_frequency: float
    slope: float
    active_bins: IntArray
    amplitudes: ComplexArray
    covariance: ComplexArray
    precisions: FloatArray
    energy: float
    antenna: int = 0

    def __post_init__(self) -> None:
        """Freeze the arrays."""
        _freeze_arrays(self, "active_bins", "amplitudes", "covariance", "precisions")

    @property
    def num_components(self) -> int:
        """Number of active channel components K."""
        return len(self.active_bins)

    @property
    def centre(self) -> float:
        """Sample at which the burst crosses zero intermediate frequency."""
        return -self.start_frequency / self.slope


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class FilterCorrection:
    """Posterior of the spline that corrects the assumed filter, shared by all bursts.

    Parameters
    ----------
    active_splines : (K,) int
        Which splines of `vsep.signal.corrected_filter` are active.
    amplitudes : (K,) complex
        Posterior mean of their coefficients.
    covariance : (K, K) complex
        Posterior covariance, the channels marginalised.
    precisions : (K,) float
        Prior precisions.
    trace : float
        Expected energy in the frame of the coefficients' uncertainty, for (65).
    """

    active_splines: IntArray
    amplitudes: ComplexArray
    covariance: ComplexArray
    precisions: FloatArray
    trace: float

    def __post_init__(self) -> None:
        """Freeze the arrays."""
        _freeze_arrays(self, "active_splines", "amplitudes", "covariance", "precisions")

    @property
    def num_splines(self) -> int:
        """Number of active splines K; zero is the assumed filter itself."""
        return len(self.active_splines)

    @property
    def coefficients(self) -> ComplexArray:
        """(NUM_SPLINES,) coefficients of all splines."""
        coefficients = np.zeros(NUM_SPLINES, dtype=np.complex128)
        coefficients[self.active_splines] = self.amplitudes
        return coefficients


NO_CORRECTION: Final = FilterCorrection(
    active_splines=np.zeros(0, dtype=np.int64),
    amplitudes=np.zeros(0, dtype=np.complex128),
    covariance=np.zeros((0, 0), dtype=np.complex128),
    precisions=np.zeros(0),
    trace=0.0,
)


@dataclass(frozen=True, kw_only=True, slots=True, weakref_slot=True, eq=False)
class SeparationState:
    """Everything the next step needs.

    Parameters
    ----------
    iteration : int
        Number of completed iterations.
    objects : ObjectComponents
        The object channel.
    bursts : sequence of BurstComponents
        In the order of antennas and ramps; several in a ramp in the order in which they were found.
    noise_precision : float
        lambda, mean of q(lambda).
    object_signal, interference_signal : (P, N) or, of several antennas, (A P, N) complex
        Phi alpha and U Psi beta, cached because the residuals need them.
    next_component_id : int
        Identity of the next object component.
    filter_correction : FilterCorrection
        What the templates' filter differs by from the assumed one.
    search_pending : bool
        Whether the next step shall search every ramp for bursts although its turn has not come:
        the run was about to converge, and a search at the end of the step found something new.
    search_cache : SearchCache or None
        What the last search for bursts has seen of every ramp, None before the first.
    used_share : float
        Share of the frame's samples that count; below one where an estimator ignores some.
    noise_spectrum : NoiseSpectrum or None
        Noise over beat frequency; None where it is white.
    sample_weights : (P, N) float or None
        How much every sample counts; None where all count fully.
    noise_like : (P, N) or (A P, N) bool or None
        Samples of interference that is no chirps; none is looked for any more in their ramps.
    receiver : ReceiverErrors or None
        Errors of oscillator and receivers, taken off the frame before a step; None without.
    quiet_iterations : int
        Iterations in a row that have added no object and next to no channel component.
    calm_iterations : int
        Iterations in a row that have changed next to nothing, see `vsep.inference.core.estimator`.
    """

    iteration: int
    objects: ObjectComponents
    bursts: Sequence[BurstComponents]
    noise_precision: float
    object_signal: ComplexArray
    interference_signal: ComplexArray
    next_component_id: int
    filter_correction: FilterCorrection = NO_CORRECTION
    search_pending: bool = False
    search_cache: SearchCache | None = None
    used_share: float = 1.0
    noise_spectrum: NoiseSpectrum | None = None
    sample_weights: FloatArray | None = None
    noise_like: BoolArray | None = None
    receiver: ReceiverErrors | None = None
    quiet_iterations: int = 0
    calm_iterations: int = 0

    def __post_init__(self) -> None:
        """Freeze the arrays."""
        _freeze_arrays(self, "object_signal", "interference_signal")

    @property
    def effective_precision(self) -> float:
        """Noise precision at which a whole frame would tell as much as the samples that count."""
        return self.noise_precision * self.used_share

    def corrected(self, received: ComplexArray) -> ComplexArray:
        """Return the frame without the errors of oscillator and receivers."""
        return received if self.receiver is None else self.receiver.corrected(received)

    @property
    def unexplained_share(self) -> float:
        """Share of the noise that no phase of the oscillator has been fitted to."""
        return 1.0 if self.receiver is None else 1.0 - self.receiver.explained

    @property
    def settles(self) -> bool:
        """Whether a receiver's settling in every ramp is taken off the frame."""
        return self.receiver is not None and self.receiver.transients is not None

    def cleaned(self, received: ComplexArray) -> ComplexArray:
        """Return the frame without interference and errors of the receiver.

        Samples hold what the objects predict as far as they do not count.

        Parameters
        ----------
        received : (P, N) or, of several antennas, (A P, N) complex
            The frame.
        """
        left = self.corrected(received) - self.interference_signal
        if self.sample_weights is None:
            return left
        return self.object_signal + self.sample_weights * (left - self.object_signal)

    @property
    def relative_noise(self) -> NoiseSpectrum | None:
        """Noise over beat frequency in units of 1/lambda; None where it is white."""
        return self.noise_relative_to(self.noise_precision)

    def noise_relative_to(self, noise_precision: float) -> NoiseSpectrum | None:
        """Return the noise over beat frequency in units of 1/lambda of another lambda."""
        spectrum = self.noise_spectrum
        return None if spectrum is None else spectrum.scaled(noise_precision)

    @property
    def component_snr(self) -> FloatArray:
        """(L,) estimated component SNR of the objects over the noise at their beats, linear."""
        snr, relative = self.objects.component_snr, self.relative_noise
        if relative is None:
            return snr
        return np.asarray((snr + 1.0) / relative.level(self.objects.beats) - 1.0)

    @property
    def interfered_ramps(self) -> tuple[int, ...]:
        """Indices of the ramps in which a burst is modelled."""
        return tuple(sorted({burst.ramp for burst in self.bursts if burst.num_components}))

    def of_antenna(self, antenna: int, num_antennas: int) -> "SeparationState":
        """Return what this state says of one of the antennas, as a state of one antenna.

        It is for looking at: its noise precision and variances are those of all antennas.
        """
        num_ramps = len(self.object_signal) // num_antennas
        rows = slice(antenna * num_ramps, (antenna + 1) * num_ramps)
        weights = self.objects.amplitudes.reshape(self.objects.num_components, num_antennas)
        return replace(
            self,
            objects=replace(self.objects, amplitudes=weights[:, antenna]),
            bursts=tuple(
                replace(burst, antenna=0) for burst in self.bursts if burst.antenna == antenna
            ),
            object_signal=self.object_signal[rows],
            sample_weights=None if self.sample_weights is None else self.sample_weights[rows],
            noise_like=None if self.noise_like is None else self.noise_like[rows],
            interference_signal=self.interference_signal[rows],
            receiver=None if self.receiver is None else self.receiver.of_antenna(antenna),
        )

    def bursts_in(self, ramp: int) -> tuple[BurstComponents, ...]:
        """Return the bursts modelled in one ramp."""
        return tuple(burst for burst in self.bursts if burst.ramp == ramp)
