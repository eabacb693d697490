"""Exhaustive search for one chirp per ramp.

With one channel component the cost (71) is the single-component SNR
``lambda |a^H r|^2 / ||a||^2``. For a fixed slope the template is a shifted kernel, so all burst
centres of all ramps cost one correlation by FFT; slopes are spaced uniformly in 1/slope, which
spaces the phase error at the band's edge uniformly.
"""

from dataclasses import dataclass, fields
from functools import lru_cache

import numpy as np
from scipy import fft

from vsep._typing import BoolArray, ComplexArray, FloatArray, IntArray, frozen
from vsep.inference.core.row_energies import sum_of_antennas
from vsep.inference.core.schedule import LONG
from vsep.kernels.scores import ChirpGrid, best_chirps, coarse_scores, correlation_spectra
from vsep.signal.keystone import SingleComplexArray
from vsep.signal.sampled_bursts import sampled_bursts
from vsep.signal.template import SignalModel

MIN_BURST = 6.0  # samples; shorter ones are clicks without a shape
MAX_BURST = 2.0  # ramps; longer ones cover a part of the band only and look like a tone
EDGE_PHASE = 0.25  # rad/pi: phase error at the half-amplitude edge between neighbouring slopes
CENTRE_MARGIN = 0.25  # share of a ramp by which a burst's centre may lie outside of it
COARSE = 4  # every so many slopes one is correlated everywhere
COARSE_REACH = COARSE // 2  # slopes on both sides that it stands for
CENTRE_REACH = 2  # samples by which the best centre of a slope next to it may differ
COARSE_SHARE = 0.4  # of a score: what the coarse slope next to it reaches; 0.47 was the least seen
CLOSE_SHARE = 0.6  # of the best coarse score: what another place must reach to be polished as well
# Values of correlations at a time: more leave the cache, and are given back after a search.
CORRELATED_AT_A_TIME = 2**17
SLOPES_AT_A_TIME = 16  # made by one call: a bank of all at once would be many times its size
MIN_OVERLAP = 0.25  # share of the burst's energy that must lie inside the ramp


@dataclass(frozen=True, slots=True, eq=False)
class ChirpCandidates:
    """Best single chirp of each ramp: arrays of length P.

    ``score`` is ``|a^H r|^2 / ||a||^2``, the SNR times 1/lambda; ``tone_score`` is the same for the
    best single tone, which is what an object not modelled yet looks like; ``limit`` is what the
    best chirp scores at most, should that one be better than the grid's.
    """

    start_frequency: FloatArray
    slope: FloatArray
    score: FloatArray
    tone_score: FloatArray
    limit: FloatArray

    def with_others(self, places: BoolArray, others: "ChirpCandidates") -> "ChirpCandidates":
        """Return candidates with others in some places (P,) bool."""
        arrays = {each.name: getattr(self, each.name).copy() for each in fields(self)}
        for name, values in arrays.items():
            values[places] = getattr(others, name)
        return ChirpCandidates(**arrays)


@dataclass(frozen=True, slots=True, eq=False)
class SlopeBank:
    """All searched chirps.

    Attributes
    ----------
    slopes : (S,) float
        Cycles per sample squared, both signs.
    spacings : (S,) float
        Between the inverses of the slopes, in units of that between bursts shorter than a ramp.
    centres : (C,) int
        Burst centres in samples.
    grid : ChirpGrid
        What the bursts look like, for the kernels.
    """

    slopes: FloatArray
    spacings: FloatArray
    centres: IntArray
    grid: ChirpGrid

    def near(self, slopes: FloatArray) -> ChirpGrid:
        """Return the grid with the coarse slopes next to some (K,) only."""
        places = np.abs(1.0 / self.slopes - 1.0 / slopes[:, None]).argmin(axis=1)
        apart = np.abs(self.grid.coarse[:, None] - places).min(axis=1)
        chosen = apart <= COARSE
        return self.grid._replace(
            coarse=self.grid.coarse[chosen], spectra=self.grid.spectra[chosen]
        )


@lru_cache(maxsize=16)
def slope_bank(model: SignalModel) -> SlopeBank:
    """Kernels for every slope worth searching; the same for all frames of one model."""
    num_samples = model.num_samples
    width = 2.0 * model.normalised_cutoff  # of the band, cycles per sample
    spacing = 2.0 * EDGE_PHASE / model.normalised_cutoff**2
    # From the shortest to the longest burst worth searching, uniform in 1/slope
    longest = num_samples if num_samples >= LONG else MAX_BURST * num_samples
    inverse_slopes = np.arange(MIN_BURST / width, longest / width, spacing)
    spacings = np.ones(len(inverse_slopes))
    if num_samples >= LONG:  # of what is longer than the ramp a part is seen: spaced by its length
        ramp = num_samples / width
        longer = np.exp(np.arange(0.0, np.log(MAX_BURST), spacing / ramp))
        inverse_slopes = np.concatenate([inverse_slopes, ramp * longer])
        spacings = np.concatenate([spacings, longer])
    slopes: FloatArray = np.concatenate([1.0 / inverse_slopes, -1.0 / inverse_slopes])
    margin = int(CENTRE_MARGIN * num_samples)
    centres = np.arange(-margin, num_samples + margin)
    reach = num_samples + margin
    offsets = np.arange(-reach, reach)  # kernel support: any sample seen from any centre
    kernels = np.empty((len(slopes), len(offsets)), dtype=np.complex64)
    inverse_energy = np.empty((len(slopes), len(centres)), dtype=np.float32)
    for begin in range(0, len(slopes), SLOPES_AT_A_TIME):
        some = slice(begin, begin + SLOPES_AT_A_TIME)
        chirps = _chirps_around_centre(slopes[some, None], offsets, model)
        kernels[some] = chirps
        inverse_energy[some] = _inverse_energies(chirps, centres, reach, num_samples)
    middles = np.arange(min(COARSE_REACH, len(inverse_slopes) - 1), len(inverse_slopes), COARSE)
    coarse = np.concatenate([middles, len(inverse_slopes) + middles])
    # Circular correlation: every offset has a place of its own, more is not needed.
    size = fft.next_fast_len(len(offsets))
    shifted = np.zeros((len(coarse), size), dtype=np.complex64)
    shifted[:, (offsets - margin) % size] = kernels[coarse]
    grid = ChirpGrid(
        kernels=np.stack([kernels.real, kernels.imag], axis=1),
        inverse_energy=inverse_energy,
        first=-margin,
        coarse=coarse,
        spectra=fft.fft(shifted, axis=1, norm="forward").conj(),
        reach=(COARSE_REACH, CENTRE_REACH),
        close_share=CLOSE_SHARE,
    )
    return SlopeBank(frozen(slopes), frozen(np.tile(spacings, 2)), frozen(centres), grid)


def _chirps_around_centre(
    slopes: FloatArray, offsets: IntArray, model: SignalModel
) -> ComplexArray:
    """(S, M) what bursts of slopes (S, 1) look like at sample offsets from their centre."""
    rate = model.sample_rate_hz
    smooth = model.anti_aliasing_filter.smooth
    if smooth is not None:
        centre = np.full(len(slopes), -float(offsets[0]))
        parameters = -slopes[:, 0] * centre, slopes[:, 0], centre
        bursts = sampled_bursts(smooth, parameters, rate, len(offsets), derivatives=False)
        if bursts is not None:
            return np.asarray(bursts[0])
    envelope = model.anti_aliasing_filter.modified_response(
        slopes * offsets * rate, slopes * rate**2
    )
    return np.asarray(np.exp(1j * np.pi * slopes * offsets**2) * envelope)


def _inverse_energies(
    chirps: ComplexArray, centres: IntArray, reach: int, num_samples: int
) -> FloatArray:
    """(S, C) 1/||a||^2 inside a ramp by the centre; zero where too little lies inside."""
    cumulative = np.cumsum(np.abs(chirps) ** 2, axis=1)
    last = num_samples - 1 - centres + reach
    first = -1 - centres + reach
    energy = cumulative[:, np.clip(last, 0, None)] - np.where(
        first >= 0, cumulative[:, np.clip(first, 0, None)], 0.0
    )
    enough = energy >= MIN_OVERLAP * energy.max(axis=1, keepdims=True)
    return np.asarray(np.where(enough, 1.0 / np.where(enough, energy, 1.0), 0.0))


def tone_scores(rows: ComplexArray) -> FloatArray:
    """(P,) what the best single tone of every row scores, on a grid of half a cell.

    Of several antennas, rows (A, P, N), their sum.
    """
    return np.asarray(sum_of_antennas(tone_powers(rows)).max(axis=1))


def tone_powers(rows: ComplexArray | SingleComplexArray) -> FloatArray:
    """|a^H r|^2 / ||a||^2 of the tones of that grid, along the last axis."""
    num_samples = rows.shape[-1]
    spectra = fft.fft(rows, 2 * num_samples, axis=-1)
    return np.asarray((spectra.real**2 + spectra.imag**2) / num_samples)


def find_single_chirps(
    residual: ComplexArray,
    model: SignalModel,
    *,
    least_score: float = 0.0,
    known_slopes: FloatArray | None = None,
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
    known_slopes : (K,) float, optional
        Next to which slopes to look only.
    """
    bank = slope_bank(model)
    grid = bank.grid if known_slopes is None else bank.near(known_slopes)
    tone_score = tone_scores(residual)
    # What a coarse slope must score for its neighbours to reach the threshold
    worthwhile = COARSE_SHARE * np.maximum(least_score, tone_score) * (least_score > 0.0)
    rows = residual.astype(np.complex64, order="C").reshape(-1, *residual.shape[-2:])
    # r in the frequency domain, shared by all slopes
    spectra = fft.fft(rows, grid.spectra.shape[1], axis=-1)
    (num_antennas, num_ramps), (num_slopes, size) = rows.shape[:2], grid.spectra.shape
    step = max(CORRELATED_AT_A_TIME // (num_antennas * num_slopes * size), 1)
    stride = -(-num_slopes // -(-num_antennas * num_slopes * size // CORRELATED_AT_A_TIME))
    coarse = np.empty((min(step, num_ramps), num_slopes, len(bank.centres)), dtype=np.float32)
    best = np.empty(coarse.shape[:2], dtype=np.float32)
    slopes, columns = np.empty((2, num_ramps), dtype=np.int64)
    score = np.empty(num_ramps)
    for first in range(0, num_ramps, step):
        last = min(first + step, num_ramps)
        count = last - first
        for begin in range(0, num_slopes, stride):
            kernels = grid.spectra[begin : begin + stride]
            products = correlation_spectra(spectra, kernels, (first, last))
            # a^H r for all centres
            correlations = fft.ifft(products, axis=-1, norm="forward", overwrite_x=True)
            coarse_scores(correlations, grid, begin, coarse, best)
        slopes[first:last], columns[first:last], score[first:last] = best_chirps(
            coarse[:count], best[:count], rows, first, grid, worthwhile
        )
    slope = bank.slopes[slopes]
    # A coarse place that was not followed up stands for chirps that score more.
    limit = np.where(score < worthwhile, score / COARSE_SHARE, score)
    # theta from slope and centre: f_0 = -slope centre
    return ChirpCandidates(-slope * bank.centres[columns], slope, score, tone_score, limit)
