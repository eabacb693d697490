"""Standard deviations of the objects of a state, whatever its noise and its oscillator.

Noise and what phase noise makes of *other* objects are circular. What it makes of an object itself
lies in quadrature to it, where all of its power counts twice: it turns and does not stretch.
The linear trend of the ramps' phases is a Doppler frequency that all objects have in common.
"""

import numpy as np

from vsep.inference.core.state import SeparationState
from vsep.inference.objects.uncertainty import dispersion_std
from vsep.signal.atoms import DispersionStd


def state_deviations(state: SeparationState, shape: tuple[int, int]) -> DispersionStd:
    """Posterior standard deviations of every object's beat and Doppler frequency.

    Parameters
    ----------
    state : SeparationState
        Of any estimator.
    shape : tuple of int
        (P, N).
    """
    objects, spectrum, receiver = state.objects, state.noise_spectrum, state.receiver
    std = dispersion_std(objects, state.effective_precision, shape, state.relative_noise)
    jitter = receiver is not None and receiver.phase_std > 0.0
    if objects.num_components == 0 or not (jitter or (spectrum and spectrum.own_skirt)):
        return std
    beats, dopplers = std.beats**2, std.dopplers**2
    if spectrum is not None and spectrum.own_skirt > 0.0:
        weights = objects.amplitudes.reshape(objects.num_components, -1)
        powers = np.mean(np.abs(weights) ** 2, axis=1) / (shape[0] * shape[1])
        own = spectrum.own_skirt * powers / spectrum.level(objects.beats)
        beats = beats * (1.0 + own)
        # The mean over a ramp is among the ramps' phases where these are estimated.
        dopplers = dopplers * np.maximum(1.0 - own, 0.0) if jitter else dopplers * (1.0 + own)
    if receiver is not None:
        dopplers = dopplers + receiver.doppler_variance()
    return DispersionStd(beats=np.sqrt(beats), dopplers=np.sqrt(dopplers))
