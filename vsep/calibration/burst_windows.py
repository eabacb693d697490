"""Detection of bursts in a recording, and windows around them without the objects.

What stands still (clutter, leakage, the settling transient at the start of a ramp) is the median
over the ramps. A search for single chirps finds the bursts in the residual; moving objects under a
burst are filled in from the samples around it, by sparse recovery in the two-dimensional spectrum.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from vsep._typing import BoolArray, ComplexArray, FloatArray, frozen
from vsep.errors import InputError
from vsep.inference.bursts.chirp_search import find_single_chirps
from vsep.mitigation.method import mitigate
from vsep.mitigation.registry import make_mitigation
from vsep.signal.clutter import static_clutter
from vsep.signal.filters import RaisedCosineFilter
from vsep.signal.template import SignalModel
from vsep.units import from_db

BURSTS_PER_RAMP = 3
MIN_SCORE_DB = 25.0  # of a burst over the noise: weaker ones tell less than the objects disturb
MIN_DB = -20.0  # of the strongest burst
SEARCH_BAND = 0.45  # cut-off of the search's generic filter, in sample rates
REACH = 0.6  # sample rates: how far from its crossing a burst is taken to be in the band
MARGIN = 8  # samples before that
MEMORY = 64  # samples after it: what the receiver rings for
MAX_SHARE = 0.7  # of a ramp's samples that may lie in windows: objects are filled in there


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class Crossing:
    """Crossing of zero frequency by a chirp."""

    ramp: int  #: in which ramp
    sample: float  #: at which of its samples
    slope_hz_per_s: float  #: slope difference as the search found it


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class BurstWindow:
    """The samples around one burst, without objects."""

    ramp: int  #: where it was cut out
    crossing: float  #: sample of the ramp at which the burst crosses zero frequency, roughly
    first: int  #: sample of the ramp at which the window begins
    signals: ComplexArray  #: (A, M) one row an antenna

    def of_antenna(self, antenna: int) -> "BurstWindow":
        """Return the burst as one antenna received it."""
        return replace(self, signals=self.signals[antenna : antenna + 1])


def find_crossings(moving: ComplexArray, sample_rate_hz: float) -> tuple[Crossing, ...]:
    """Find the strong bursts of one antenna.

    `moving` (P, N): without what stands still, in the paper's sign; `sample_rate_hz`: f_s. They are
    ordered by ramp; their slopes may differ.
    """
    model = SignalModel(
        num_ramps=moving.shape[0],
        num_samples=moving.shape[1],
        sample_rate_hz=sample_rate_hz,
        anti_aliasing_filter=RaisedCosineFilter(
            cutoff_hz=SEARCH_BAND * sample_rate_hz, rolloff=0.2
        ),
    )
    residual = moving.copy()
    noise = float(np.median(np.abs(moving) ** 2)) / np.log(2.0)
    least = noise * float(from_db(MIN_SCORE_DB))
    crossings: list[Crossing] = []
    for _ in range(BURSTS_PER_RAMP):
        found = find_single_chirps(residual, model, least_score=least)
        least = max(least, float(from_db(MIN_DB)) * float(found.score.max()))
        usable = (found.score > least) & (found.score > found.tone_score)
        for p in np.flatnonzero(usable):
            sample = -float(found.start_frequency[p] / found.slope[p])
            slope = float(found.slope[p]) * sample_rate_hz**2
            crossings.append(Crossing(ramp=int(p), sample=sample, slope_hz_per_s=slope))
            # Whatever of this burst the generic filter does not explain is no second one.
            first, last = window_span(sample, float(found.slope[p]), moving.shape[1])
            residual[p, first:last] = 0.0
        if not np.any(usable):
            break
    return tuple(sorted(crossings, key=lambda each: (each.ramp, each.sample)))


def window_span(crossing: float, slope: float, num_samples: int) -> tuple[int, int]:
    """First sample of a burst's window, and the one after its last.

    `crossing`: in samples; `slope`: cycles per sample squared; `num_samples`: N.

    Examples
    --------
    >>> window_span(100.0, 0.05, 512), window_span(5.0, 0.05, 512)
    ((80, 177), (0, 82))
    """
    reach = REACH / abs(slope)
    first = int(np.floor(crossing - reach)) - MARGIN
    last = int(np.ceil(crossing + reach)) + MEMORY + 1
    return max(first, 0), max(min(last, num_samples), 0)


def cut_bursts(
    received: ComplexArray, crossings: Sequence[Crossing], slope: float
) -> tuple[BurstWindow, ...]:
    """Cut the windows of bursts out of a recording, without objects.

    `received` (A, P, N): in the paper's sign; `crossings`: of all bursts, as samples under any of
    them are not trusted for the objects; `slope`: slope difference in cycles per sample squared.
    Bursts whose window another one's overlaps are left out, and those half outside. Raises
    `InputError` if the windows leave too few samples of the ramps to tell the objects from.
    """
    num_ramps, num_samples = received.shape[1:]
    spans = [window_span(each.sample, slope, num_samples) for each in crossings]
    count = np.zeros((num_ramps, num_samples), dtype=np.int64)
    for each, (first, last) in zip(crossings, spans, strict=True):
        count[each.ramp, first:last] += 1
    share = float(np.mean(count > 0))
    if share > MAX_SHARE:
        raise InputError(
            f"Bursts cover {100.0 * share:.0f} % of the recording; at most "
            f"{100.0 * MAX_SHARE:.0f} % are allowed, for objects must show beside them."
        )
    moving = received - static_clutter(received)
    bursts = moving - _filled(moving, count > 0)
    return tuple(
        BurstWindow(
            ramp=each.ramp,
            crossing=each.sample,
            first=first,
            signals=frozen(bursts[:, each.ramp, first:last].copy()),
        )
        for each, (first, last) in zip(crossings, spans, strict=True)
        if 0.0 <= each.sample <= num_samples - 1.0 and count[each.ramp, first:last].max() == 1
    )


def _filled(moving: ComplexArray, mask: BoolArray) -> ComplexArray:
    """Fill moving objects (A, P, N) in where the mask (P, N) says."""
    method = make_mitigation("ist")
    return np.stack([mitigate(method, antenna, mask).cleaned for antenna in moving]).astype(
        np.complex128
    )


def strongest_antenna(moving: ComplexArray) -> int:
    """Return the antenna of (A, P, N) with the most energy."""
    energy: FloatArray = np.sum(np.abs(moving) ** 2, axis=(1, 2))
    return int(np.argmax(energy))
