"""Where the bursts are: exhaustive search for one chirp per ramp.

With one channel component the cost (71) is the single-component SNR
``lambda |a^H r|^2 / ||a||^2``. For a fixed slope the template is a shifted kernel, so all burst
centres of all ramps cost one correlation by FFT; slopes are spaced uniformly in 1/slope, which
spaces the phase error at the band's edge uniformly.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from scipy import fft

from vsep._arrays import ComplexArray, FloatArray, IntArray, frozen
from vsep.signal.template import SignalModel

SHORTEST_BURST = 6.0  # samples; shorter ones are clicks without a shape
LONGEST_BURST = 2.0  # ramps; longer ones cover a part of the band only and look like a tone
EDGE_PHASE = 0.25  # rad/pi: phase error at the half-amplitude edge between neighbouring slopes
CENTRE_MARGIN = 0.25  # share of a ramp by which a burst's centre may lie outside of it
LEAST_OVERLAP = 0.25  # share of the burst's energy that must lie inside the ramp


@dataclass(frozen=True, slots=True, eq=False)
class ChirpCandidates:
    """Best single chirp of each ramp: arrays of length P.

    ``score`` is ``|a^H r|^2 / ||a||^2``, the SNR times 1/lambda; ``tone_score`` is the same for the
    best single tone, which is what an object not modelled yet looks like.
    """

    start_frequency: FloatArray
    slope: FloatArray
    score: FloatArray
    tone_score: FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class SlopeBank:
    """Kernels of all searched slopes.

    Attributes
    ----------
    slopes : (S,) float
        Cycles per sample squared, both signs.
    centres : (C,) int
        Burst centres in samples.
    spectra : (S, F) complex
        Conjugate spectra of the kernels.
    inverse_energy : (S, C) float
        1/||a||^2 inside the ramp; zero where too little of the burst lies inside.
    """

    slopes: FloatArray
    centres: IntArray
    spectra: ComplexArray
    inverse_energy: FloatArray


@lru_cache(maxsize=16)
def slope_bank(model: SignalModel) -> SlopeBank:
    """Kernels for every slope worth searching; the same for all frames of one model."""
    num_samples = model.num_samples
    width = 2.0 * model.normalised_cutoff
    spacing = 2.0 * EDGE_PHASE / model.normalised_cutoff**2
    inverse_slopes = np.arange(SHORTEST_BURST / width, LONGEST_BURST * num_samples / width, spacing)
    slopes: FloatArray = np.concatenate([1.0 / inverse_slopes, -1.0 / inverse_slopes])
    margin = int(CENTRE_MARGIN * num_samples)
    centres = np.arange(-margin, num_samples + margin)
    reach = num_samples + margin
    offsets = np.arange(-reach, reach)  # kernel support: any sample seen from any centre
    rate = model.sample_rate_hz
    envelope = model.anti_aliasing_filter.modified_response(
        slopes[:, None] * offsets * rate, slopes[:, None] * rate**2
    )
    kernels = np.exp(1j * np.pi * slopes[:, None] * offsets**2) * envelope
    size = fft.next_fast_len(num_samples + len(offsets))
    shifted = np.zeros((len(slopes), size), dtype=np.complex128)
    shifted[:, offsets % size] = kernels
    cumulative = np.cumsum(np.abs(kernels) ** 2, axis=1)
    last = num_samples - 1 - centres + reach
    first = -1 - centres + reach
    energy = cumulative[:, np.clip(last, 0, None)] - np.where(
        first >= 0, cumulative[:, np.clip(first, 0, None)], 0.0
    )
    enough = energy >= LEAST_OVERLAP * energy.max(axis=1, keepdims=True)
    inverse_energy = np.where(enough, 1.0 / np.where(enough, energy, 1.0), 0.0)
    return SlopeBank(
        slopes=frozen(slopes),
        centres=frozen(centres),
        spectra=frozen(fft.fft(shifted, axis=1).conj()),
        inverse_energy=frozen(inverse_energy),
    )


def find_single_chirps(residual: ComplexArray, model: SignalModel) -> ChirpCandidates:
    """Best single chirp of every ramp of a (P, N) residual, by one FFT a slope and ramp.

    Costs O(S P N log N) for S slopes.
    """
    bank = slope_bank(model)
    size = bank.spectra.shape[1]
    spectra = fft.fft(residual, size, axis=1)
    positions = bank.centres % size
    found = []
    for spectrum in spectra:
        correlation = fft.ifft(spectrum * bank.spectra, axis=1)[:, positions]
        score = (correlation.real**2 + correlation.imag**2) * bank.inverse_energy
        row, column = np.unravel_index(int(np.argmax(score)), score.shape)
        slope = bank.slopes[row]
        found.append((-slope * bank.centres[column], slope, score[row, column]))
    start_frequency, slope, score = np.array(found).T
    tones = np.abs(fft.fft(residual, 2 * model.num_samples, axis=1)) ** 2 / model.num_samples
    return ChirpCandidates(start_frequency.copy(), slope.copy(), score.copy(), tones.max(axis=1))
