"""Search for chirps longer than a ramp, which look like tones.

Their crossing of the band may lie far outside of the ramp. Within it their envelope is next to
constant, so that a ramp times the conjugate of a chirp of the right slope is a tone.
"""

from functools import lru_cache
from typing import Final, NamedTuple

import numpy as np
from scipy import fft

from vsep._typing import BoolArray, ComplexArray, FloatArray, IntArray, frozen
from vsep.inference.bursts.chirp_search import ChirpCandidates, tone_powers
from vsep.inference.core.row_energies import row_energies, sum_of_antennas
from vsep.signal.keystone import SingleComplexArray
from vsep.signal.template import SignalModel

FEW_RAMPS: Final = 4  # fewer do not tell a tone in one ramp from an object
LONE: Final = 10.0  # times the usual ramp: power of a tone that is in one ramp only
LEAST_SWEEP: Final = 4.0  # cells of 1/N within the ramp; what sweeps less may be a tone
CLEARLY_MORE: Final = 1.5  # than the best tone
LEAST_SHARE: Final = 0.3  # of the energy of the ramp: what a fit leaves of a burst has no shape
SPACING: Final = 0.5  # 1/N^2 between slopes: an eighth of a half-turn at the ends of the ramp
COARSE: Final = 4  # every so many slopes one is tried first
COARSE_REACH: Final = np.arange(-(COARSE // 2), COARSE // 2 + 1)  # slopes that it stands for
# Of a score: what the coarse slope next to it reaches. A quarter of a half-turn at the ends of the
# ramp costs 5 %, and a tone half-way between two of the grid 19 %.
COARSE_SHARE: Final = 0.6


def lone_tones(rows: ComplexArray) -> BoolArray:
    """(P,) whether the best tone of a ramp is hardly there in the others: no object is like that.

    Parameters
    ----------
    rows : (P, N) or, of several antennas, (A, P, N) complex
        What the objects leave of all ramps of a frame.

    Examples
    --------
    >>> rows = np.ones((8, 64), dtype=np.complex128)
    >>> rows[3] += 10.0 * np.exp(0.6j * np.arange(64))
    >>> np.flatnonzero(lone_tones(rows)).tolist()
    [3]
    """
    power = sum_of_antennas(tone_powers(rows))
    if len(power) < FEW_RAMPS:
        return np.zeros(len(power), dtype=np.bool_)
    best = power.argmax(axis=1)
    usual = np.median(power[:, best], axis=0)  # of all ramps, at the beat of each one's best tone
    return np.asarray(power.max(axis=1) > LONE * usual)


def with_long_chirps(
    found: ChirpCandidates, rows: ComplexArray, lone: BoolArray, model: SignalModel
) -> ChirpCandidates:
    """Return candidates with long chirps in their place where those explain clearly more.

    Parameters
    ----------
    found : ChirpCandidates
        Of T ramps.
    rows : (T, N) or (A, T, N) complex
        These ramps.
    lone : (T,) bool
        Where to look.
    model : SignalModel
        Size, sampling and assumed filter.
    """
    starts, slopes = found.start_frequency.copy(), found.slope.copy()
    score = found.score.copy()
    least = np.maximum(CLEARLY_MORE * found.tone_score, LEAST_SHARE * row_energies(rows))
    for place in np.flatnonzero(lone).tolist():
        enough = max(least[place], score[place])
        start, slope, best = _best_long_chirp(rows[..., place, :], model, enough)
        if best > enough:
            starts[place], slopes[place], score[place] = start, slope, best
    limit = np.maximum(found.limit, score)
    return ChirpCandidates(starts, slopes, score, found.tone_score, limit)


def _best_long_chirp(
    row: ComplexArray, model: SignalModel, least: float
) -> tuple[float, float, float]:
    """Start frequency, slope and score of the best chirp that takes longer than the ramp.

    Every `COARSE`-th slope is tried in single precision, those around the good ones in double.
    Where none can score more than `least`, the score is zero.
    """
    num_samples = model.num_samples
    steepest = 2.0 * model.normalised_cutoff / num_samples  # the band within the ramp
    grid = _slope_grid(num_samples, int(steepest * num_samples**2 / SPACING))
    scores = _summed(tone_powers(grid.coarse_chirps * row.astype(np.complex64)[..., None, :]))
    best = scores.max(axis=1)
    if best.max(initial=0.0) <= COARSE_SHARE * least:
        return 0.0, 0.0, 0.0
    around = grid.coarse[best >= COARSE_SHARE * best.max(), None] + COARSE_REACH
    chosen = np.unique(np.clip(around, 0, len(grid.slopes) - 1))
    slopes = grid.slopes[chosen]
    power = _summed(tone_powers(_conjugate_chirps(slopes, num_samples) * row[..., None, :]))
    index, column = np.unravel_index(int(np.argmax(power)), power.shape)
    start = fft.fftfreq(2 * num_samples)[column]
    return float(start), float(slopes[index]), float(power[index, column])


class _SlopeGrid(NamedTuple):
    """Slopes (S,) of chirps longer than a ramp; those tried first, and conjugates of theirs."""

    slopes: FloatArray
    coarse: IntArray
    coarse_chirps: SingleComplexArray


@lru_cache(maxsize=8)
def _slope_grid(num_samples: int, count: int) -> _SlopeGrid:
    """Grid of all slopes up to `count` times the spacing, of both signs."""
    steps = np.arange(LEAST_SWEEP / SPACING, count)
    slopes = np.concatenate([steps, -steps]) * SPACING / num_samples**2
    # The last slope of either sign has a place of its own: it may be far from the one before.
    places = np.arange(len(slopes)) % max(len(steps), 1)
    coarse = np.flatnonzero((places % COARSE == COARSE // 2) | (places == len(steps) - 1))
    chirps = _conjugate_chirps(slopes[coarse], num_samples).astype(np.complex64)
    return _SlopeGrid(frozen(slopes), frozen(coarse), frozen(chirps))


def _conjugate_chirps(slopes: FloatArray, num_samples: int) -> ComplexArray:
    return np.asarray(np.exp(-1j * np.pi * slopes[:, None] * np.arange(num_samples) ** 2))


def _summed(power: FloatArray) -> FloatArray:
    return power if power.ndim == 2 else np.asarray(power.sum(axis=0))
