"""Where the bursts are: exhaustive search for one chirp per ramp.

With one channel component the cost (71) is the single-component SNR
``lambda |a^H r|^2 / ||a||^2``. For a fixed slope the template is a shifted kernel, so all burst
centres of all ramps cost one correlation by FFT; slopes are spaced uniformly in 1/slope, which
spaces the phase error at the band's edge uniformly.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray
from scipy import fft

from vsep._arrays import ComplexArray, FloatArray, IntArray, frozen
from vsep.kernels.scores import best_centres, polish
from vsep.signal.template import SignalModel

SHORTEST_BURST = 6.0  # samples; shorter ones are clicks without a shape
LONGEST_BURST = 2.0  # ramps; longer ones cover a part of the band only and look like a tone
EDGE_PHASE = 0.25  # rad/pi: phase error at the half-amplitude edge between neighbouring slopes
CENTRE_MARGIN = 0.25  # share of a ramp by which a burst's centre may lie outside of it
COARSE = 4  # every so many slopes one is correlated everywhere
COARSE_REACH = COARSE // 2  # slopes on both sides that it stands for
CENTRE_REACH = 2  # samples by which the best centre of a slope next to it may differ
COARSE_SHARE = 0.4  # of a score: what the coarse slope next to it reaches; 0.47 was the least seen
CLOSE_SHARE = 0.6  # of the best coarse score: what another place must reach to be polished as well
RAMPS_AT_A_TIME = 8  # correlated by one call: fewer calls, and still within the cache
LEAST_OVERLAP = 0.25  # share of the burst's energy that must lie inside the ramp


SingleComplexArray: TypeAlias = NDArray[np.complex64]


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
    kernels : (S, 2 R) complex, single precision
        What a burst looks like around its centre at index R.
    inverse_energy : (S, C) float
        1/||a||^2 inside the ramp; zero where too little of the burst lies inside.
    coarse : (M,) int
        The slopes that are correlated everywhere.
    spectra : (M, F) complex, single precision
        Conjugate spectra of their kernels.
    """

    slopes: FloatArray
    centres: IntArray
    kernels: SingleComplexArray
    inverse_energy: FloatArray
    coarse: IntArray
    spectra: SingleComplexArray


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
    cumulative = np.cumsum(np.abs(kernels) ** 2, axis=1)
    last = num_samples - 1 - centres + reach
    first = -1 - centres + reach
    energy = cumulative[:, np.clip(last, 0, None)] - np.where(
        first >= 0, cumulative[:, np.clip(first, 0, None)], 0.0
    )
    enough = energy >= LEAST_OVERLAP * energy.max(axis=1, keepdims=True)
    inverse_energy = np.where(enough, 1.0 / np.where(enough, energy, 1.0), 0.0)
    middles = np.arange(min(COARSE_REACH, len(inverse_slopes) - 1), len(inverse_slopes), COARSE)
    coarse = np.concatenate([middles, len(inverse_slopes) + middles])
    # Circular correlation: every offset has a place of its own, more is not needed.
    size = fft.next_fast_len(len(offsets))
    shifted = np.zeros((len(coarse), size), dtype=np.complex64)
    shifted[:, offsets % size] = kernels[coarse]
    return SlopeBank(
        slopes=frozen(slopes),
        centres=frozen(centres),
        kernels=kernels.astype(np.complex64),
        inverse_energy=inverse_energy,
        coarse=frozen(coarse),
        spectra=fft.fft(shifted, axis=1).conj(),
    )


def _correlations(
    spectra: SingleComplexArray, kernels: SingleComplexArray
) -> Iterator[SingleComplexArray]:
    """Yield the circular correlations (M, F) of every ramp's spectrum with all coarse kernels.

    Of several antennas, spectra (A, P, F), the root of the sum of their powers is yielded.
    """
    if spectra.ndim == 3:
        for p in range(spectra.shape[1]):
            every = fft.ifft(spectra[:, p, None] * kernels, axis=2, overwrite_x=True)
            power = np.sum(every.real**2 + every.imag**2, axis=0)
            yield np.sqrt(power).astype(np.complex64)
        return
    for first in range(0, len(spectra), RAMPS_AT_A_TIME):
        products = spectra[first : first + RAMPS_AT_A_TIME, None] * kernels
        yield from fft.ifft(products, axis=2, overwrite_x=True)


def squared_norms(rows: ComplexArray) -> FloatArray:
    """(P,) energies of the rows of a (P, N) array, or (A, P) of an (A, P, N) array."""
    return np.asarray(np.sum(rows.real**2 + rows.imag**2, axis=-1))


def tone_scores(rows: ComplexArray) -> FloatArray:
    """(P,) what the best single tone of every row scores, on a grid of half a cell.

    Of several antennas, rows (A, P, N), their sum.
    """
    num_samples = rows.shape[-1]
    tones = np.abs(fft.fft(rows, 2 * num_samples, axis=-1)) ** 2 / num_samples
    if tones.ndim == 3:
        tones = tones.sum(axis=0)
    return np.asarray(tones.max(axis=1))


def find_single_chirps(
    residual: ComplexArray, model: SignalModel, *, least_score: float = 0.0
) -> ChirpCandidates:
    """Best single chirp of every ramp of a (P, N) residual, by one FFT a coarse slope and ramp.

    Every `COARSE`-th slope is correlated with the ramp; the slopes and centres around the best are
    tried one by one. Single precision is enough to choose among places of a grid.

    Parameters
    ----------
    residual : (P, N) or (A, P, N) complex
        Received signal minus what is modelled already. What several antennas received of a ramp is
        searched for one chirp with a weight for each; scores are sums over the antennas.
    model : SignalModel
        Size, sampling and assumed filter.
    least_score : float
        What a chirp must score, at least as much as the best tone, to be of use: where none comes
        close, the coarse place is returned. Zero if every chirp is of use.
    """
    bank = slope_bank(model)
    size, first = bank.spectra.shape[1], int(bank.centres[0])
    coarse_inverse_energy = bank.inverse_energy[bank.coarse]
    tone_score = tone_scores(residual)
    worthwhile = COARSE_SHARE * np.maximum(least_score, tone_score) * (least_score > 0.0)
    rows = residual.astype(np.complex64)
    spectra = fft.fft(rows, size, axis=-1)
    every = rows if rows.ndim == 3 else rows[None]
    found = np.empty((3, every.shape[1]))
    for p, correlations in enumerate(_correlations(spectra, bank.spectra)):
        columns, scores = best_centres(correlations, first, coarse_inverse_energy)
        row, best = int(np.argmax(scores)), float(scores.max())
        place = int(bank.coarse[row]), int(columns[row]), best
        if best >= worthwhile[p]:
            close = scores >= CLOSE_SHARE * best
            place = polish(
                every[:, p],
                bank.kernels,
                bank.inverse_energy,
                first,
                bank.coarse[close],
                columns[close],
                (COARSE_REACH, CENTRE_REACH),
            )
        slope = bank.slopes[place[0]]
        found[:, p] = -slope * bank.centres[place[1]], slope, place[2]
    return ChirpCandidates(found[0], found[1], found[2], tone_score)
