"""Ramps whose interference is no chirps are given up: their loud samples do not count."""

from typing import Final

import numpy as np
from scipy import ndimage

from vsep._typing import BoolArray, ComplexArray, FloatArray, IntArray
from vsep.inference.bursts.noise_like import (
    MAJORITY,
    MOST_PER_SAMPLE,
    POORLY,
    grown_support,
    loud_samples,
    noise_like_ramps,
)
from vsep.inference.bursts.sequence import MANY_BURSTS
from vsep.inference.bursts.workspace import InterferenceWorkspace
from vsep.inference.core.progress import EventKind
from vsep.inference.core.row_energies import row_energies, squared_norms

BADLY: Final = 0.01  # of a row's energy: what chirps leave at most, with one component each
LOUD: Final = 1e-4  # of a row's peak power: what is noise-like for certain, and two samples beside
SUPPORT: Final = 1e-3  # of a row's peak power: where bursts are
MOST: Final = 0.9  # of the samples of a frame
LOUD_ROW: Final = 2.0  # times the usual one: energy of a row of more than noise and objects


def given_up(work: InterferenceWorkspace) -> IntArray:
    """Ramps whose interference is no chirps."""
    if work.noise_like is None:
        return np.zeros(0, dtype=np.int64)
    rows = np.flatnonzero(work.noise_like.any(axis=1))
    return np.unique(rows % work.model.num_ramps)


class NoiseLike:
    """Interference that is no chirps, as a search for bursts sees it.

    Parameters
    ----------
    work : InterferenceWorkspace
        The bursts; changed in place.
    residual : (A P, N) complex
        Received signal minus the objects.
    threshold : float
        Of bursts, for the record.
    """

    def __init__(
        self, work: InterferenceWorkspace, residual: ComplexArray, threshold: float
    ) -> None:
        self.work, self.residual, self.threshold = work, residual, threshold
        self.shape = work.model.num_antennas, *work.model.shape

    def grow(self) -> None:
        """Leave out what lies beside noise-like interference, as far as objects show it."""
        work = self.work
        if work.noise_like is None:
            return
        before = np.asarray(work.noise_like.reshape(self.shape).any(axis=0))
        support = grown_support(before, self.residual.reshape(self.shape))
        grown = work.noise_like | np.tile(support, (self.shape[0], 1))
        if grown.mean() <= MOST:
            work.noise_like = grown

    def give_up_at_once(self) -> None:
        """Give up ramps that no number of chirps would explain, before more are begun there."""
        work = self.work
        rows = self.residual.reshape(self.shape)
        if work.noise_like is not None:
            rows = rows.copy()
            rows[:, given_up(work)] = 0.0
        if not self._is_asked(rows):
            return
        found = loud_samples(rows)
        ramps = noise_like_ramps(rows, work.signal.reshape(self.shape), found, work.model)
        if len(ramps):
            loud = np.zeros(work.model.shape, dtype=np.bool_)
            loud[ramps] = found.support[ramps]
            self._give_up(np.tile(loud, (self.shape[0], 1)))

    def _is_asked(self, rows: ComplexArray) -> bool:
        """Whether some rows (A, P, N) are loud, and bursts explain little of them."""
        with_bursts = self.work.table.interfered
        if len(with_bursts) == 0:
            energies = row_energies(rows)
            usual = np.median(energies[energies > 0.0]) if energies.any() else 0.0
            return bool(energies.max() > LOUD_ROW * usual)
        poor = int(np.count_nonzero(self._left()[with_bursts] > POORLY))
        return poor >= MAJORITY * len(with_bursts)

    def _left(self) -> FloatArray:
        """(R,) share of the energy of the rows that their bursts leave."""
        received = np.maximum(squared_norms(self.residual), 1e-300)
        return np.asarray(squared_norms(self.residual - self.work.signal) / received)

    def give_up_many_bursts(self) -> None:
        """Give up ramps that bursts fit badly, however many: what is there is no chirps.

        Chirps are few parameters for many samples, and fit them.
        """
        work = self.work
        if not work.crowded:
            return
        many = work.bursts_per_row >= MANY_BURSTS
        power = work.signal.real**2 + work.signal.imag**2
        lasting = np.sum(power > SUPPORT * power.max(axis=1, keepdims=True), axis=1)
        many &= work.bursts_per_row > MOST_PER_SAMPLE * lasting
        rows = np.flatnonzero(many & (self._left() > BADLY))
        if len(rows) == 0:
            return
        loud = np.zeros(work.model.rows_shape, dtype=np.bool_)
        loud[rows] = ndimage.binary_dilation(
            power[rows] > LOUD * power[rows].max(axis=1, keepdims=True),
            np.ones((1, 5), dtype=np.bool_),
        )
        self._give_up(loud)

    def _give_up(self, loud: BoolArray) -> None:
        """Leave out samples (A P, N) of some rows from now on, and the bursts of their ramps."""
        work = self.work
        loud = loud if work.noise_like is None else work.noise_like | loud
        if loud.mean() > MOST:
            return  # what is left would tell nothing
        work.noise_like, work.has_given_up = loud, True
        gone = np.flatnonzero(np.isin(work.table.rows[: work.num_shared], given_up(work)))
        for ramp in work.table.rows[gone].tolist():
            work.record(EventKind.CHIRP_DROPPED, ramp, 0.0, self.threshold)
        work.remove_bursts(gone)
        work.synthesize()
