"""Errors of oscillator and receivers of a state, estimated anew as long as a run has not settled.

With the objects' signal x(n, p) of a step and the residual e(n, p) of the corrected frame

- the phase of a ramp is that of ``<x_p, x_p + e_p>``, whose variance is 1/(2 lambda |x_p|^2). Its
  Gaussian prior has the variance that makes the phases most likely;
- the image factor is ``<conj(x), e> / |x|^2``, of variance 1/(lambda |x|^2), with x turned by the
  phases, since the image arises behind the mixer;
- the offset is the mean of e, of variance 1/(lambda P N).

Each counts only where it is evident. An unmodelled object turns and stretches what is modelled
alike, a phase turns only: jitter is evident where the phases of the ramps are larger than the noise
allows *and* larger than the relative changes of their amplitudes, by an F test. Either is what the
strongest object says for the most part; where the others are strong enough to be asked they must
agree, or it is something of this object.
"""

import math
from functools import lru_cache

import numpy as np
from scipy import stats

from vsep._typing import BoolArray, ComplexArray, FloatArray
from vsep.inference.core.receiver import ReceiverErrors, no_errors
from vsep.inference.core.state import ObjectComponents, SeparationState
from vsep.signal.atoms import line_factors, synthesize
from vsep.signal.template import SignalModel

FIRST, EVERY = 2, 4  # iterations in which errors are looked for, as long as none is evident
FALSE_JITTER = 1e-5  # how often the F test of a single estimate finds jitter where there is none
IMAGE_EVIDENCE = 20.0  # lambda |x|^2 |epsilon|^2, exponential with mean one where there is no image
LARGEST_IMAGE = 0.25  # a larger factor is no error but a converter of real values
OTHERS_ASKED = 10.0  # evidence that an error should make in the other objects, to ask them
EARLIEST_SNR = 300.0  # of the strongest object: a weaker one shows no error that matters
AT_ZERO_DEVIATIONS = 5.0  # of beat and Doppler frequency: an object nearer to zero is an offset
AT_ZERO_CELLS = 0.003
CELL_STD = math.sqrt(6.0) / (2.0 * math.pi)  # deviation in cells times the root of the SNR
ABOVE_JITTER = 20.0  # times the level that jitter makes: a stronger object is none of its making
IMAGE_CELLS = 0.7  # an object so near to the image of a stronger one may be this image
SETTLED = 0.02  # of the noise that an error explains, by the expected energy of one parameter
PRIOR_STEPS = 30


def receiver_errors_due(state: SeparationState) -> bool:
    """Whether errors are looked at in a step that looks at the noise as well."""
    return state.receiver is not None or state.iteration % EVERY == FIRST


def next_receiver_errors(
    state: SeparationState,
    objects: ObjectComponents,
    object_signal: ComplexArray,
    noise_residual: ComplexArray,
    noise_precision: float,
    model: SignalModel,
) -> ReceiverErrors | None:
    """Errors after a step; None where none is evident.

    Parameters
    ----------
    state : SeparationState
        Where the step started from.
    objects : ObjectComponents
        After the step.
    object_signal, noise_residual : (A P, N) complex
        Phi alpha, and what objects and bursts leave, zero where a sample does not count.
    noise_precision : float
        lambda after the step.
    model : SignalModel
        Size of the frame.
    """
    last = state.receiver
    if not receiver_errors_due(state) or objects.num_components == 0:
        return last
    return _Evidence(objects, object_signal, noise_residual, noise_precision, model, last).errors()


class _Evidence:
    """What a residual says of the errors that the last estimate has not taken off."""

    def __init__(
        self,
        objects: ObjectComponents,
        object_signal: ComplexArray,
        noise_residual: ComplexArray,
        noise_precision: float,
        model: SignalModel,
        last: ReceiverErrors | None,
    ) -> None:
        self.objects, self.model = objects, model
        self.noise_precision = noise_precision
        self.shape = model.num_antennas, *model.shape
        self.signal = object_signal.reshape(self.shape)
        self.residual = noise_residual.reshape(self.shape)
        self.found = last is not None
        self.last = no_errors(model.num_ramps, model.num_antennas) if last is None else last
        weights = objects.amplitudes.reshape(objects.num_components, -1)
        self.powers = np.sum(weights.real**2 + weights.imag**2, axis=1)

    def errors(self) -> ReceiverErrors | None:
        """Return the next estimate; the last one itself where the change does not matter."""
        offsets = self._offsets()
        strong = float(self.powers.max()) * self.noise_precision > EARLIEST_SNR
        phases, phase_std = self._phases() if strong else (self.last.ramp_phases, 0.0)
        factors = self._image_factors() if strong else np.zeros_like(self.last.image_factors)
        if not (phase_std > 0.0 or factors.any() or offsets.any()):
            return None
        found = ReceiverErrors(
            ramp_phases=phases, phase_std=phase_std, image_factors=factors, offsets=offsets
        )
        return self.last if self.found and self._settled(found) else found

    def _settled(self, found: ReceiverErrors) -> bool:
        """Whether the change explains next to no noise."""
        last, energy = self.last, float(self.powers.sum())
        turned = energy * float(np.mean((found.ramp_phases - last.ramp_phases) ** 2))
        imaged = energy * float(np.mean(np.abs(found.image_factors - last.image_factors) ** 2))
        size = self.signal[0].size
        shifted = size * float(np.sum(np.abs(found.offsets - last.offsets) ** 2))
        explained = self.noise_precision * np.array([turned / self.shape[1], imaged, shifted])
        same = (found.phase_std > 0.0) == (last.phase_std > 0.0)
        return same and bool(np.all(explained < SETTLED))

    def _without(self, suspects: BoolArray) -> tuple[ComplexArray, ComplexArray]:
        """Return signal and residual as they are without some of the objects."""
        if not suspects.any():
            return self.signal, self.residual
        beat = line_factors(self.objects.beats[suspects], self.shape[2])
        doppler = line_factors(self.objects.dopplers[suspects], self.shape[1])
        weights = self.objects.amplitudes[suspects].reshape(np.count_nonzero(suspects), -1)
        made = np.array([synthesize(own, beat, doppler) for own in weights.T])
        return self.signal - made, self.residual + made

    def _signal_of(self, index: int) -> ComplexArray:
        one = slice(index, index + 1)
        beat = line_factors(self.objects.beats[one], self.shape[2])
        doppler = line_factors(self.objects.dopplers[one], self.shape[1])
        weights = self.objects.amplitudes[one].reshape(1, -1)
        return np.array([synthesize(own, beat, doppler) for own in weights.T])

    def _offsets(self) -> ComplexArray:
        """Offset d of every antenna: an object at zero beat and Doppler, and the mean of e.

        It has no delay and no velocity, so that it cannot be told from an offset and needs not be.
        """
        objects = self.objects
        snr = self.powers * self.noise_precision
        reach = AT_ZERO_DEVIATIONS * CELL_STD / np.sqrt(np.maximum(snr, 1.0)) + AT_ZERO_CELLS
        at_zero = (np.abs(objects.beats) * self.shape[2] < reach) & (
            np.abs(objects.dopplers) * self.shape[1] < reach
        )
        if not (at_zero.any() or np.any(self.last.offsets)):
            return self.last.offsets
        mean = self._turned(self._without(at_zero)[1]).mean(axis=(1, 2))
        return np.asarray(self.last.offsets + mean + self.last.image_factors * mean.conj())

    def _turned(self, signal: ComplexArray) -> ComplexArray:
        """Return a signal as it is behind the mixer."""
        if self.last.phase_std == 0.0:
            return signal
        return np.asarray(np.exp(1j * self.last.ramp_phases)[:, None] * signal)

    def _image_factors(self) -> ComplexArray:
        """Epsilon of every antenna, zero where it is not evident."""
        suspects = np.zeros(self.objects.num_components, np.bool_)
        unknown = not np.any(self.last.image_factors)
        if unknown and not self._is_evident_image(self.signal, self.residual):
            suspects = self._possible_images()
            if not suspects.any():
                return self.last.image_factors
        signal, residual = self._without(suspects)
        products, energy = self._image_products(signal, residual)
        change = products / energy
        last = self.last.image_factors
        factors = (change + last) / (1.0 + change * last.conj())
        evidence = self.noise_precision * energy * np.abs(factors) ** 2
        evident = (evidence > IMAGE_EVIDENCE) & (np.abs(factors) < LARGEST_IMAGE)
        if not evident.any():
            return np.zeros_like(last)
        own, own_energy = self._image_products(
            self._signal_of(int(np.argmax(self.powers))), residual
        )
        others = np.maximum(energy - own_energy, 1e-300)
        expected = others * np.abs(factors) ** 2
        apart = np.abs(products - own - change * others) ** 2 / others
        differ = (self.noise_precision * expected > OTHERS_ASKED) & (apart > 0.25 * expected)
        return np.where(evident & ~differ, factors, 0.0)

    def _image_products(
        self, signal: ComplexArray, residual: ComplexArray
    ) -> tuple[ComplexArray, FloatArray]:
        """<conj(x), e> behind the mixer and |x|^2, of every antenna."""
        sums = (signal * residual).sum(axis=2)
        if self.last.phase_std > 0.0:
            sums = sums * np.exp(2j * self.last.ramp_phases)
        energy = np.array([np.vdot(own, own).real for own in signal])
        return sums.sum(axis=1), np.maximum(energy, 1e-300)

    def _is_evident_image(self, signal: ComplexArray, residual: ComplexArray) -> bool:
        products, energy = self._image_products(signal, residual)
        return bool(np.any(self.noise_precision * np.abs(products) ** 2 > IMAGE_EVIDENCE * energy))

    def _possible_images(self) -> BoolArray:
        """(L,) which objects lie at the image of a stronger one."""
        objects = self.objects
        mirrored_beats = objects.beats[:, None] + objects.beats
        mirrored_dopplers = objects.dopplers[:, None] + objects.dopplers
        near = np.abs(mirrored_beats - np.rint(mirrored_beats)) * self.shape[2] < IMAGE_CELLS
        near &= np.abs(mirrored_dopplers - np.rint(mirrored_dopplers)) * self.shape[1] < IMAGE_CELLS
        weaker = self.powers[:, None] < LARGEST_IMAGE**2 * self.powers
        return np.asarray((near & weaker).any(axis=1))

    def _phases(self) -> tuple[FloatArray, float]:
        """phi_p and the deviation of its prior, zero where jitter is not evident."""
        nothing = np.zeros(self.shape[1]), 0.0
        if self.shape[1] < 8:
            return nothing
        found = self._jitter(self.signal, self.residual)
        if found is None:
            return nothing
        if self.last.phase_std == 0.0:
            suspects = self._made_by_jitter(found[1])
            if suspects.any():
                again = self._jitter(*self._without(suspects))
                found = found if again is None else again
        return found

    def _made_by_jitter(self, phase_std: float) -> BoolArray:
        """(L,) which objects may be what jitter makes of stronger ones at the same beat."""
        apart = self.objects.beats[:, None] - self.objects.beats
        kernel = np.sinc(apart * self.shape[2]) ** 2
        stronger = np.where(self.powers > self.powers[:, None], self.powers, 0.0)
        level = phase_std**2 / self.shape[1] * np.sum(kernel * stronger, axis=1)
        return np.asarray(self.powers < ABOVE_JITTER * level)

    def _jitter(
        self, signal: ComplexArray, residual: ComplexArray
    ) -> tuple[FloatArray, float] | None:
        """Most probable phases and the deviation of their prior; None without evidence."""
        products = (signal.conj() * residual).sum(axis=(0, 2))
        energy = (signal.real**2 + signal.imag**2).sum(axis=(0, 2))
        energy = np.maximum(energy, 1e-12 * energy.max())
        phases = self.last.ramp_phases + np.angle(energy + products)
        information = 2.0 * self.noise_precision * energy
        limit_chi, limit_f = _limits(self.shape[1] - 2)
        if information @ phases**2 < limit_chi:  # the usual case; a trend makes it larger
            return None
        phases = _without_trend(phases, energy)
        turned = float(information @ phases**2)
        stretched = float(information @ _without_trend(products.real / energy, energy) ** 2)
        if turned < limit_chi or turned < limit_f * stretched:
            return None
        variance = _prior_variance(phases, 1.0 / information)
        if variance == 0.0 or not self._others_agree(phases, signal, residual):
            return None
        probable = phases * variance / (variance + 1.0 / information)
        return _without_trend(probable, energy), math.sqrt(variance)

    def _others_agree(
        self,
        phases: FloatArray,
        signal: ComplexArray,
        residual: ComplexArray,
    ) -> bool:
        """Whether the phases suit the objects beside the strongest one, as far as they tell."""
        strongest = self._signal_of(int(np.argmax(self.powers)))
        others = signal - strongest
        energy = (others.real**2 + others.imag**2).sum(axis=(0, 2))
        told = 2.0 * self.noise_precision * energy
        if float(told @ phases**2) < OTHERS_ASKED + 3.0 * math.sqrt(len(phases)):
            return True
        products = (others.conj() * residual).imag.sum(axis=(0, 2))
        # likelihood ratio of the phases and none, of these objects alone
        whole = 2.0 * self.noise_precision * products + told * self.last.ramp_phases
        return float(2.0 * phases @ whole - told @ phases**2) > 0.0


def _without_trend(values: FloatArray, weights: FloatArray) -> FloatArray:
    """Values of the ramps without their weighted mean and linear trend."""
    mass = weights.sum()
    ramps = np.arange(len(values)) - weights @ np.arange(len(values)) / mass
    centred = values - weights @ values / mass
    moment = weights @ ramps**2
    return np.asarray(centred - ramps * (weights @ (ramps * centred)) / moment)


def _prior_variance(phases: FloatArray, variances: FloatArray) -> float:
    """Most likely variance of the prior of phases that are known with these variances."""
    prior = max(float(np.mean(phases**2 - variances)), float(np.mean(variances)) * 1e-2)
    for _ in range(PRIOR_STEPS):
        share = prior / (prior + variances)
        # expectation-maximisation: the mean of phi_p^2 under its posterior
        prior = float(np.mean((share * phases) ** 2 + share * variances))
    return prior * len(phases) / (len(phases) - 2)


@lru_cache(maxsize=64)
def _limits(free: int) -> tuple[float, float]:
    """Limits of the chi-square and of the F statistic with so many degrees of freedom."""
    return float(stats.chi2.isf(FALSE_JITTER, free)), float(stats.f.isf(FALSE_JITTER, free, free))
