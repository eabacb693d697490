"""Interference that is no chirps, told by how many chirps it would take.

A chirp is few parameters for many samples and explains most of a burst; several explain several. Of
a phase code, OFDM or a stepped carrier the best chirp explains what it would explain of noise, and
so does the next one. What is left of the loud samples of some ramps by as many chirps as such a
burst could hold decides for the frame; then its ramps are given up, as noise of known support.
"""

from dataclasses import dataclass
from typing import Final

import numpy as np
from scipy import ndimage

from vsep._typing import BoolArray, ComplexArray, FloatArray, IntArray
from vsep.inference.bursts.chirp_search import find_single_chirps, tone_powers
from vsep.inference.core.row_energies import sum_of_antennas
from vsep.signal.template import SignalModel

MOST_PER_SAMPLE: Final = 0.075  # bursts by the samples that they last for; chirps are fewer
LEAST_CHIRPS: Final = 3  # tried in a ramp, however short what it holds
MOST_CHIRPS: Final = 16
FEWEST_RAMPS: Final = 3  # that tell
POORLY: Final = 0.5  # of the energy of loud samples: what the first chirp leaves of no chirp
UNEXPLAINED: Final = 0.09  # what the last one does
MAJORITY: Final = 0.5  # of the interfered ramps
TRIED: Final = 8  # ramps at most
AVERAGED: Final = 9  # samples
LOUD: Final = 10.0  # times the noise: mean power with which a support begins ...
RAISED: Final = 2.0  # ... and up to which it reaches
TOGETHER: Final = 5  # ramps and samples: the mean by which a support grows once objects are known
FAINT: Final = 2.0  # times the noise: mean power up to which it reaches then ...
SEEN: Final = 3.0  # ... and with which another one begins
SHORTEST: Final = 8  # samples
ALONG_THE_RAMP: Final = np.array([[False] * 3, [True] * 3, [False] * 3])


@dataclass(frozen=True, slots=True, eq=False)
class LoudSamples:
    """Where the ramps of a frame are louder than noise.

    Parameters
    ----------
    support : (P, N) bool
        The samples.
    noise : float
        Mean power of the others, of all antennas together.
    """

    support: BoolArray
    noise: float

    def energies(self, rows: ComplexArray, ramps: IntArray) -> FloatArray:
        """(T,) energy beyond that of noise which rows (A, T, N) of some ramps hold there."""
        power = sum_of_antennas(rows.real**2 + rows.imag**2)
        held = np.where(self.support[ramps], power - self.noise, 0.0).sum(axis=1)
        return np.asarray(np.maximum(held, 0.0))


def loud_samples(rows: ComplexArray) -> LoudSamples:
    """Find runs of samples that are louder than noise, of all antennas (A, P, N) together.

    Examples
    --------
    >>> rows = np.ones((1, 4, 64), dtype=np.complex128)
    >>> rows[:, 2, 20:40] = 10.0
    >>> found = loud_samples(rows).support
    >>> np.flatnonzero(found.any(axis=1)).tolist(), bool(found[2, 20:40].all())
    ([2], True)
    """
    power = sum_of_antennas(rows.real**2 + rows.imag**2)
    # Median of a sum of exponential laws, but for 3 %
    noise = float(np.median(power)) * len(rows) / (len(rows) - 1.0 / 3.0)
    around = ndimage.uniform_filter1d(power, AVERAGED, axis=1)
    loud, raised = around > LOUD * noise, around > RAISED * noise
    support = ndimage.binary_propagation(loud, ALONG_THE_RAMP, raised | loud)
    return LoudSamples(np.asarray(support), noise)


def grown_support(support: BoolArray, rows: ComplexArray) -> BoolArray:
    """Support (P, N) of noise-like interference, and what lies beside it above the noise.

    Parameters
    ----------
    support : (P, N) bool
        As known so far.
    rows : (A, P, N) complex
        What the objects leave of the frame.
    """
    ramps = np.flatnonzero(support.any(axis=1))
    power = sum_of_antennas(rows.real**2 + rows.imag**2)
    rest = power[~support]
    if len(rest) == 0:
        return support
    noise = float(np.median(rest)) * len(rows) / (len(rows) - 1.0 / 3.0)
    # Edges hardly move from ramp to ramp, unlike the noise.
    around = ndimage.uniform_filter(power[ramps], TOGETHER)
    grown = support.copy()
    begun = support[ramps] | (around > SEEN * noise)
    raised = begun | (around > FAINT * noise)
    grown[ramps] = ndimage.binary_propagation(begun, ALONG_THE_RAMP, raised)
    return grown


def noise_like_ramps(
    rows: ComplexArray, signal: ComplexArray, found: LoudSamples, model: SignalModel
) -> IntArray:
    """Ramps whose interference is no chirps; none without evidence in several.

    Parameters
    ----------
    rows : (A, P, N) complex
        What the objects leave of the frame.
    signal : (A, P, N) complex
        The bursts that are modelled, one in a ramp at least where it holds any.
    found : LoudSamples
        Of these rows.
    model : SignalModel
        Size, sampling and assumed filter.
    """
    interfered = np.flatnonzero(found.support.sum(axis=1) >= SHORTEST)
    held = found.energies(rows[:, interfered], interfered)
    left = found.energies((rows - signal)[:, interfered], interfered)
    poor = interfered[left > POORLY * held]
    nothing = np.zeros(0, dtype=np.int64)
    if len(poor) < max(FEWEST_RAMPS, MAJORITY * len(interfered)):
        return nothing
    tried = poor[np.unique(np.linspace(0, len(poor) - 1, TRIED).astype(np.int64))]
    unexplained = _left_by_chirps(rows[:, tried], tried, found, model) > UNEXPLAINED
    return poor if np.mean(unexplained) >= MAJORITY else nothing


def _left_by_chirps(
    rows: ComplexArray, ramps: IntArray, found: LoudSamples, model: SignalModel
) -> FloatArray:
    """(T,) share of the energy of loud samples that as many chirps as they could hold leave."""
    counts = MOST_PER_SAMPLE * found.support[ramps].sum(axis=1)
    counts = np.clip(np.ceil(counts), LEAST_CHIRPS, MOST_CHIRPS).astype(np.int64)
    held = np.maximum(found.energies(rows, ramps), 1e-300)
    shares = np.ones(len(ramps))
    for number in range(1, int(counts.max()) + 1):
        best = find_single_chirps(rows, model)
        templates = model.template(best.start_frequency, best.slope)
        # The chirp of a radar of the same slope is a tone.
        is_tone = best.tone_score > best.score
        templates = np.where(is_tone[:, None], _best_tones(rows), templates)
        energies = np.maximum(np.sum(np.abs(templates) ** 2, axis=1), 1e-300)
        weights = np.sum(templates.conj() * rows, axis=2) / energies
        rows = rows - weights[..., None] * templates
        shares = np.where(counts == number, found.energies(rows, ramps) / held, shares)
    return shares


def _best_tones(rows: ComplexArray) -> ComplexArray:
    """(T, N) the tone that explains most of rows (A, T, N), on a grid of half a cell."""
    num_samples = rows.shape[-1]
    bins = sum_of_antennas(tone_powers(rows)).argmax(axis=1)
    cycles = bins[:, None] * np.arange(num_samples) / (2.0 * num_samples)
    return np.asarray(np.exp(2j * np.pi * cycles))
