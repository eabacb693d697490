"""Errors of oscillator and receivers of a state, estimated anew as long as a run has not settled.

With the objects' signal x(n, p) of a step and the residual e(n, p) of the corrected frame

- the phases are those of `vsep.inference.core.phase_estimate`;
- the image factors are those of `vsep.inference.core.image_estimate`;
- the offset is the mean of e, of variance 1/(lambda P N);
- the transient is renewed, see `vsep.inference.core.settling`, where a run has begun with one.

Each counts only where it is evident. The phases are what the strongest object says for the most
part; where the others are strong enough to be asked they must agree, or it is something of this
object.
"""

import math

import numpy as np

from vsep._typing import BoolArray, ComplexArray, FloatArray
from vsep.inference.core.image_estimate import image_factors, is_evident, possible_images
from vsep.inference.core.phase_estimate import PhaseEstimate, PhaseProducts
from vsep.inference.core.receiver import PhasePrior, ReceiverErrors, no_errors
from vsep.inference.core.settling import transient_of
from vsep.inference.core.state import ObjectComponents, SeparationState
from vsep.signal.atoms import line_factors, synthesize
from vsep.signal.dithered_atoms import coupled_signals
from vsep.signal.template import SignalModel
from vsep.units import wrap_frequency

FEWEST_RAMPS = 8  # in fewer, phases, images and offsets are too easily something else
THOROUGHLY = 2, 8, 14, 20  # iterations in which errors are looked for, as long as none is evident
JITTER_ALSO = (
    6,
    10,
    12,
)  # in which jitter alone is: it makes objects as soon as the true ones are found
FIRST_WITHIN = 6  # from which phase noise is looked for: the strongest objects have been found
OTHERS_ASKED = 10.0  # evidence that an error should make in the other objects, to ask them
EARLIEST_SNR = 300.0  # of the strongest object: a weaker one shows no error that matters
AT_ZERO_DEVIATIONS = 5.0  # of beat and Doppler frequency: an object nearer to zero is an offset
AT_ZERO_CELLS = 0.003
CELL_STD = math.sqrt(6.0) / (2.0 * math.pi)  # deviation in cells times the root of the SNR
SAME_BEAT, CROWDED, CROWD = (
    0.7,
    100.0,
    3,
)  # cells, ratio of powers, objects of a stronger one's beat
ABOVE_SKIRT = 20.0  # times the level that phases make: a stronger object is none of their making
LAST_TRANSIENT = 14  # iteration; then it and resting objects trade what makes no difference
SETTLED = 0.02  # of the noise that an error explains, by the expected energy of one parameter


def receiver_errors_due(state: SeparationState) -> bool:
    """Whether errors are looked at in a step that looks at the noise as well."""
    due = state.receiver is not None or state.iteration in (*THOROUGHLY, *JITTER_ALSO)
    # The step after a change is an odd one, which begins with no search for bursts: images of
    # bursts are modelled as bursts, and have to go before others are looked for in their place.
    return due and state.iteration % 2 == 0


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
    if model.num_ramps < FEWEST_RAMPS:
        return None
    if float(objects.powers.max()) * model.num_antennas * noise_precision < EARLIEST_SNR:
        return last if last is not None and last.transients is not None else None
    return _Evidence(state, objects, object_signal, noise_residual, noise_precision, model).errors()


class _Evidence:
    """What a residual says of the errors that the last estimate has not taken off."""

    def __init__(
        self,
        state: SeparationState,
        objects: ObjectComponents,
        object_signal: ComplexArray,
        noise_residual: ComplexArray,
        noise_precision: float,
        model: SignalModel,
    ) -> None:
        self.objects, self.iteration = objects, state.iteration
        self.model, self.noise_precision = model, noise_precision
        self.shape = model.num_antennas, *model.shape
        self.signal = object_signal.reshape(self.shape)
        self.residual = noise_residual.reshape(self.shape)
        self.found = state.receiver is not None
        self.last = state.receiver or no_errors(model.num_ramps, model.num_antennas)
        self.thoroughly = self.found or state.iteration in THOROUGHLY
        self._nothing = np.zeros(objects.num_components, np.bool_)
        self.powers = objects.powers * model.num_antennas

    def errors(self) -> ReceiverErrors | None:
        """Return the next estimate; the last one itself where the change does not matter."""
        turning = self._phases()
        offsets, factors = self.last.offsets, self.last.image_factors
        if turning is not None or self.thoroughly:
            offsets, factors = self._offsets(), self._image_factors()
        transients = self._transients()
        if turning is None and transients is None and not (factors.any() or offsets.any()):
            return None
        none = no_errors(self.shape[1], self.shape[0])
        found = ReceiverErrors(
            phases=none.phases if turning is None else turning.phases,
            prior=none.prior if turning is None else turning.prior,
            image_factors=factors,
            offsets=offsets,
            # a real parameter explains half of the noise of a sample
            explained=0.0 if turning is None else 0.5 * turning.num_effective / self.signal.size,
            transients=transients,
        )
        return self.last if self.found and self._settled(found) else found

    def _settled(self, found: ReceiverErrors) -> bool:
        """Whether the change explains next to no noise."""
        last, energy = self.last, float(self.powers.sum())
        turned = energy * float(np.mean((found.phases - last.phases) ** 2))
        imaged = energy * float(np.mean(np.abs(found.image_factors - last.image_factors) ** 2))
        size = self.signal[0].size
        shifted = size * float(np.sum(np.abs(found.offsets - last.offsets) ** 2))
        settling = 0.0
        if found.transients is not None and last.transients is not None:
            change = np.abs(found.transients - last.transients) ** 2
            settling = self.shape[1] * float(change.sum()) / (1 + np.count_nonzero(change))
        explained = self.noise_precision * np.array(
            [turned / self.shape[1], imaged, shifted, settling]
        )
        same = found.phases.shape == last.phases.shape and found.turns == last.turns
        return same and bool(np.all(explained < SETTLED))

    def _without(self, suspects: BoolArray) -> tuple[ComplexArray, ComplexArray]:
        """Return signal and residual as they are without some of the objects."""
        if not suspects.any():
            return self.signal, self.residual
        made = self._made_by(suspects)
        return self.signal - made, self.residual + made

    def _made_by(self, which: BoolArray) -> ComplexArray:
        """Return the signal (A, P, N) of some of the objects."""
        objects, migration = self.objects, self.model.migration
        weights = objects.amplitudes[which].reshape(np.count_nonzero(which), -1)
        if not self.model.is_stationary:
            points = np.stack([objects.beats[which], objects.dopplers[which]], axis=1)
            made = coupled_signals(points, weights, migration, *self.model.shape)
            return made.reshape(self.shape)
        beat = line_factors(objects.beats[which], self.shape[2])
        doppler = line_factors(objects.dopplers[which], self.shape[1])
        return np.array([synthesize(own, beat, doppler) for own in weights.T])

    def _offsets(self) -> ComplexArray:
        """Offset d of every antenna: an object at zero beat and Doppler, and the mean of e.

        It has no delay and no velocity, so that it cannot be told from an offset and needs not be.
        In a single ramp nothing has a velocity, and the other radar's tone may have no delay.
        """
        objects = self.objects
        far = np.abs(objects.beats).min() * self.shape[2] > 1.0
        if self.shape[1] == 1 or (far and not self.last.offsets.any()):
            return self.last.offsets
        snr = self.powers * self.noise_precision
        reach = AT_ZERO_DEVIATIONS * CELL_STD / np.sqrt(np.maximum(snr, 1.0)) + AT_ZERO_CELLS
        cells = np.abs(objects.beats) * self.shape[2], np.abs(objects.dopplers) * self.shape[1]
        # Beside an offset that is known a weak object is the rest of it.
        strong = (snr > EARLIEST_SNR) | self.last.offsets.any()
        at_zero = (np.maximum(*cells) < reach) & strong
        if not (at_zero.any() or np.any(self.last.offsets)):
            return self.last.offsets
        mean = self._turned(self._without(at_zero)[1]).mean(axis=(1, 2))
        return np.asarray(self.last.offsets + mean + self.last.image_factors * mean.conj())

    def _transients(self) -> ComplexArray | None:
        """Transient of every antenna: what the objects leave of what is equal in all ramps."""
        last = self.last.transients
        if last is None or self.iteration > LAST_TRANSIENT:
            return last
        mean = self._turned(self.residual).mean(axis=1)
        factors = self.last.image_factors[:, None]
        return transient_of(last + mean + factors * mean.conj())

    def _turned(self, signal: ComplexArray) -> ComplexArray:
        """Return a signal as it is behind the mixer."""
        if not self.last.turns:
            return signal
        return np.asarray(np.exp(1j * self.last.phases) * signal)

    def _image_factors(self) -> ComplexArray:
        """Epsilon of every antenna, zero where it is not evident."""
        last, precision = self.last.image_factors, self.noise_precision
        # What may be an image, or the rest of one, must not tell that there is none.
        shape = self.shape[1], self.shape[2]
        suspects = possible_images(self.objects, self.powers, shape, precision)
        residual = self._turned(self._turned(self._without(suspects)[1]))
        known = last.any() or suspects.any()
        if not (known or is_evident(self.signal, residual, precision)):
            return last
        return image_factors(
            self.objects, self.powers, residual, last, precision, self.model.migration
        )

    def _phases(self) -> PhaseEstimate | None:
        """Phases of the oscillator, None where none are evident."""
        found, last = self._estimate(self._nothing), self.last.prior
        if self.last.turns and (found is None or last.noise_std > 0.0 or not found.prior.noise_std):
            return found
        if found is None and self.thoroughly:
            crowd = self._beside_stronger()
            if np.count_nonzero(crowd) >= CROWD:
                found = self._estimate(crowd)
        suspects = self._nothing
        while found is not None:
            more = suspects | self._made_by_phases(found.prior)
            if np.array_equal(more, suspects):
                break
            suspects = more
            found = self._estimate(suspects) or found
        return found if found is not None and self._others_agree(found.phases) else None

    def _estimate(self, suspects: BoolArray) -> PhaseEstimate | None:
        signals = self._without(suspects)
        return PhaseProducts(*signals, self.last.phases, self.noise_precision).estimate(
            within_ramps=self.iteration >= FIRST_WITHIN and self.thoroughly,
            last=self.last.prior if self.last.turns else None,
        )

    def _beside_stronger(self) -> BoolArray:
        """(L,) which objects have the beat of a much stronger one, as what jitter makes has."""
        apart = wrap_frequency(self.objects.beats[:, None] - self.objects.beats)
        same = np.abs(apart) * self.shape[2] < SAME_BEAT
        return np.asarray((same & (CROWDED * self.powers[:, None] < self.powers)).any(axis=1))

    def _made_by_phases(self, prior: PhasePrior) -> BoolArray:
        """(L,) which objects may be what the phases make of stronger ones."""
        apart = self.objects.beats[:, None] - self.objects.beats
        stronger = np.where(self.powers > self.powers[:, None], self.powers, 0.0)
        skirts = np.sum(prior.spectrum(apart, self.shape[2]) * stronger, axis=1)
        return np.asarray(self.powers < ABOVE_SKIRT * skirts / self.signal[0].size)

    def _others_agree(self, phases: FloatArray) -> bool:
        """Whether phases suit the objects beside the strongest one, as far as these tell."""
        strongest = np.arange(len(self.powers)) == np.argmax(self.powers)
        others = self.signal - self._made_by(strongest)
        energy = (others.real**2 + others.imag**2).sum(axis=0)
        # twice the likelihood ratio of the phases and none, of these objects alone
        explained = 2.0 * self.noise_precision * float(np.sum(energy * phases**2))
        if explained < OTHERS_ASKED + 3.0 * math.sqrt(self.shape[1]):
            return True
        products = (others.conj() * self.residual).imag.sum(axis=0)
        gained = 4.0 * self.noise_precision * float(np.sum(phases * products))
        return gained > explained
