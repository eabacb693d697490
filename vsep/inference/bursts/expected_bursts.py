"""Detection of weak bursts at expected places with a lower threshold.

The exhaustive search looks at every slope and centre, so that noise alone reaches its threshold
somewhere in some ramp. Where the interferer is known, one slope and a stretch of centres remain,
and noise exceeds a lower threshold as seldom. In noise the score times lambda is an exponential
field; the maxima of such a field above T number, as for the objects' threshold,

    (V T / pi + ...) exp(-T) in two dimensions,   (1 + L sqrt(T / pi)) exp(-T) on a line,

V and L the volume and length of what is searched, measured by how fast templates become unlike
each other: ``pi w / sqrt(3)`` for a sample of the centre and ``pi w^2 / sqrt(180)`` for one of
1/slope, by the variances of the frequency and of its square over a band of width w. Of a burst that
is cut off at the ramp's end only its part of the band counts. For 256 samples and half of the band
13 dB are exceeded in 1.7e-4 of the ramps of noise, 10.1 dB within a sample of an expected place.
"""

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from scipy.optimize import brentq

from vsep._typing import BoolArray, ComplexArray, FloatArray, IntArray, frozen
from vsep.errors import InputError
from vsep.inference.bursts.chirp_search import EDGE_PHASE, MIN_OVERLAP, slope_bank
from vsep.inference.core.row_energies import squared_norms, sum_of_antennas
from vsep.signal.template import SignalModel

CENTRE_STEP = 0.5  # samples between centres tried; a burst of full band changes over two or more
SAME_SLOPE = 0.2  # relative, within which a burst is the expected one
MIN_THRESHOLD = 4.0  # linear; below it a channel component does not stay either


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class ExpectedBursts:
    """Places of expected bursts.

    Parameters
    ----------
    ramps : (B,) int
        In which ramp.
    centres : (B,) float
        Sample at which they cross zero intermediate frequency.
    slopes : (B,) float
        Cycles per sample squared.
    reach : float
        Samples by which a centre may differ.

    Raises
    ------
    InputError
        If the lists differ in length, a slope is zero, or the reach is not between 0 and 100.
    """

    ramps: IntArray
    centres: FloatArray
    slopes: FloatArray
    reach: float

    def __post_init__(self) -> None:
        """Check and freeze the lists."""
        if len({np.shape(each) for each in (self.ramps, self.centres, self.slopes)}) != 1:
            raise InputError("ramps, centres and slopes of expected bursts must be of one length.")
        if not 0.0 <= self.reach <= 100.0:
            raise InputError(f"reach is {self.reach:g} samples; it must lie between 0 and 100.")
        if np.any(np.asarray(self.slopes) == 0.0):
            raise InputError("A slope of the expected bursts is 0; all must differ from it.")
        for name in ("ramps", "centres", "slopes"):
            object.__setattr__(self, name, frozen(np.array(getattr(self, name))))

    def near(self, ramp: int, centre: float, slope: float, model: SignalModel) -> bool:
        """Whether a burst is one of those expected: of their slope, where it overlaps with one."""
        alike = np.abs(self.slopes - slope) <= SAME_SLOPE * np.abs(self.slopes)
        close = np.abs(self.centres - centre) <= self.same(model)
        return bool(np.any((self.ramps == ramp) & alike & close))

    def free(self, ramp: int, centres: FloatArray, model: SignalModel) -> BoolArray:
        """(B,) whether an expected burst lies in a ramp, away from the bursts modelled there."""
        distance = np.abs(self.centres[:, None] - centres)
        taken = np.any(distance <= self.same(model)[:, None], axis=1)
        return np.asarray((self.ramps == ramp) & ~taken)

    def same(self, model: SignalModel) -> FloatArray:
        """(B,) samples within which another burst of the ramp is the expected one."""
        halves: FloatArray = model.normalised_cutoff / np.abs(self.slopes)
        return np.maximum(halves, self.reach)

    def candidates(self) -> tuple[FloatArray, FloatArray]:
        """(B, K) start frequencies and slopes of all centres that are tried."""
        count = int(np.ceil(self.reach / CENTRE_STEP))
        offsets = np.linspace(-self.reach, self.reach, 2 * count + 1)
        centres = self.centres[:, None] + offsets
        slopes = np.broadcast_to(self.slopes[:, None], centres.shape)
        return -slopes * centres, slopes


def expected_scores(
    rows: ComplexArray, starts: FloatArray, slopes: FloatArray, model: SignalModel
) -> FloatArray:
    """(B, K) scores ``|a^H r|^2 / ||a||^2`` of K chirps in each of B rows.

    Parameters
    ----------
    rows : (B, N) or (A, B, N) complex
        What is not modelled yet; of several antennas the scores are summed.
    starts, slopes : (B, K) float
        The chirps. One of which too little lies inside of the ramp scores nothing.
    model : SignalModel
        Filter of the templates.
    """
    shape = starts.shape
    # U(theta) of all candidates
    templates = model.template(starts.ravel(), slopes.ravel()).reshape(*shape, -1)
    energy = squared_norms(templates)
    whole = 2.0 * model.normalised_cutoff / np.abs(slopes)
    enough = energy >= MIN_OVERLAP * np.minimum(whole, model.num_samples)
    products = np.einsum("bkn,...bn->...bk", templates.conj(), rows)  # a^H r
    power = sum_of_antennas(np.abs(products) ** 2)
    scores: FloatArray = np.where(enough, power / np.where(enough, energy, 1.0), 0.0)
    return scores


@lru_cache(maxsize=16)
def searched_volume(model: SignalModel) -> float:
    """Volume V of all that the exhaustive search of a ramp looks at."""
    bank, width = slope_bank(model), 2.0 * model.normalised_cutoff
    inverse_energy = bank.grid.inverse_energy
    valid = inverse_energy > 0.0
    energy = np.where(valid, 1.0 / np.where(valid, inverse_energy, 1.0), 0.0)
    share = np.minimum(energy * np.abs(bank.slopes)[:, None] / width, 1.0)
    step = 2.0 * EDGE_PHASE / model.normalised_cutoff**2  # of 1/slope
    density = np.pi**2 * width**3 / math.sqrt(540.0)  # of maxima per unit of centre and 1/slope
    return density * step * float(np.sum(share**3 * bank.spacings[:, None]))


def expected_threshold(model: SignalModel, threshold: float, reach: float) -> float:
    """Threshold at an expected place that noise exceeds as often as a whole ramp's search its own.

    Parameters
    ----------
    model : SignalModel
        Size and assumed filter.
    threshold : float
        Of the exhaustive search, linear, of one antenna.
    reach : float
        Samples to both sides that are searched.

    Examples
    --------
    >>> from vsep.signal.filters import RaisedCosineFilter
    >>> model = SignalModel(num_ramps=1, num_samples=256, sample_rate_hz=1e7,
    ...                     anti_aliasing_filter=RaisedCosineFilter(cutoff_hz=2.5e6, rolloff=0.25))
    >>> [round(expected_threshold(model, 20.0, reach), 1) for reach in (1.0, 8.0)]
    [10.2, 12.1]
    """
    length = 2.0 * reach * np.pi * 2.0 * model.normalised_cutoff / np.sqrt(3.0)  # L
    # log of the expected false alarms of an exhaustive search
    allowed = np.log(searched_volume(model) * threshold / np.pi) - threshold

    def excess(level: float) -> float:
        return float(np.log1p(length * np.sqrt(level / np.pi)) - level - allowed)

    if excess(MIN_THRESHOLD) <= 0.0:
        return MIN_THRESHOLD
    return float(brentq(excess, MIN_THRESHOLD, 2.0 * threshold + 50.0))
