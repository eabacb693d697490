"""Standard deviations of the objects of a state, whatever its noise and its oscillator.

Noise and what phase noise makes of *other* objects are circular. What it makes of an object itself
lies in quadrature to it, where all of its power counts twice: it turns and does not stretch.

Where the phase is estimated it is what turns the strongest objects. Of a weaker one the part that
turns a stronger one as well is told by its prior only: with the skirt q of the stronger ones in
quadrature, over the noise, half of what there is to know of an object has its noise raised by
1 + q. The trend of the phase over the ramps, and along all of them, is a frequency that all objects
have in common.
"""

import numpy as np

from vsep._typing import FloatArray
from vsep.inference.core.receiver import PhasePrior
from vsep.inference.core.state import SeparationState
from vsep.inference.objects.uncertainty import dispersion_std
from vsep.kernels.moving_atoms import STATIONARY
from vsep.signal.atoms import DispersionStd
from vsep.signal.dithered_atoms import Coupling


def state_deviations(
    state: SeparationState, shape: tuple[int, int], migration: Coupling = STATIONARY
) -> DispersionStd:
    """Posterior standard deviations of every object's beat and Doppler frequency.

    Parameters
    ----------
    state : SeparationState
        Of any estimator.
    shape : tuple of int
        (P, N).
    migration : Migration
        Coupling of delay and Doppler, that of the radar.
    """
    objects, spectrum, receiver = state.objects, state.noise_spectrum, state.receiver
    std = dispersion_std(objects, state.effective_precision, shape, state.relative_noise, migration)
    turns = receiver is not None and receiver.turns
    skirt = spectrum is not None and spectrum.own_skirt > 0.0
    if objects.num_components == 0 or not (turns or skirt):
        return std
    beats, dopplers = std.beats**2, std.dopplers**2
    powers = objects.powers / (shape[0] * shape[1])
    if spectrum is not None and skirt:
        own = spectrum.own_skirt * powers / spectrum.level(objects.beats)
        beats = beats * (1.0 + own)
        # The mean over a ramp is among the phases where these are estimated.
        dopplers = dopplers * np.maximum(1.0 - own, 0.0) if turns else dopplers * (1.0 + own)
    if receiver is not None and turns:
        skirts = _skirts(receiver.prior, objects.beats, powers, shape[1])
        lost = 2.0 * state.effective_precision * skirts
        factor = (2.0 + 2.0 * lost) / (2.0 + lost)
        beats = factor * beats + receiver.beat_variance(shape[1])
        dopplers = factor * dopplers + receiver.doppler_variance(shape[1])
    return DispersionStd(beats=np.sqrt(beats), dopplers=np.sqrt(dopplers))


def curvature_std(state: SeparationState, num_ramps: int) -> FloatArray:
    """Return standard deviations (L,) of the objects' curvatures, zero of those without.

    With the frequency that of mid-frame the curvature is orthogonal to all but the phase. What
    remains of its derivative has the variance ``(P^2 - 1) (P^2 - 4) / 180`` over the ramps.
    """
    curvatures = state.objects.curvatures
    if curvatures is None:
        return np.zeros(state.objects.num_components)
    square = float(num_ramps) ** 2
    information = 8.0 * np.pi**2 * (square - 1.0) * (square - 4.0) / 180.0
    snr = np.maximum(state.component_snr, 1.0)
    return np.where(curvatures == 0.0, 0.0, 1.0 / np.sqrt(information * snr))


def _skirts(
    prior: PhasePrior, beats: FloatArray, powers: FloatArray, num_samples: int
) -> FloatArray:
    """(L,) level that the phase makes of other objects, at the beat of each.

    An object that is weaker than the one at this beat tells less of the phase than that one.
    """
    spectrum = prior.spectrum(beats[:, None] - beats, num_samples)
    np.fill_diagonal(spectrum, 0.0)
    told = np.minimum(powers / powers[:, None], 1.0)
    return np.asarray(np.sum(told * powers * spectrum, axis=1))
