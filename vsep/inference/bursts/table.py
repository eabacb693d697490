"""Working copy of all bursts of a frame and of their channel columns.

What belongs to all bursts stands in flat arrays, ramp after ramp, which is how the kernels take it:
a step then costs a few calls, not a few for every ramp.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from vsep._typing import BoolArray, ComplexArray, FloatArray, IntArray
from vsep.inference.bursts.chirp_refinement import PlacedChirps
from vsep.inference.bursts.sequence import (
    BurstLayout,
    BurstSequence,
    FlatBursts,
    burst_sequence,
)
from vsep.inference.core.state import BurstComponents
from vsep.kernels.ramps import FlatPosterior, FlatRamps
from vsep.signal.filters import RaisedCosineFilter
from vsep.signal.template import SignalModel


@dataclass(frozen=True, slots=True, eq=False)
class RampBursts:
    """Content of one ramp, read only: its B bursts, their K columns and posterior.

    Column i belongs to the chirp ``owners[i]`` and the grid bin ``bins[i]``; ``signals`` (B, N) is
    what the columns of each chirp add up to.
    """

    ramp: int
    chirps: PlacedChirps
    owners: IntArray
    bins: IntArray
    precisions: FloatArray
    amplitudes: ComplexArray
    covariance: ComplexArray
    signals: ComplexArray

    @property
    def templates(self) -> ComplexArray:
        """(B, N) templates of the chirps."""
        return self.chirps.templates

    def own(self, index: int) -> IntArray:
        """Return the columns of one burst."""
        return np.flatnonzero(self.owners == index)


class BurstTable:
    """The B bursts of a frame in the order of rows, and their K columns in that order.

    Of several antennas every row of the frame is a ramp with bursts and channels of its own.

    Parameters
    ----------
    model : SignalModel
        Size, sampling and filter of the templates.
    bursts : sequence of BurstComponents
        Where a step starts from.

    Attributes
    ----------
    rows : (B,) int
        Row of the frame that each burst lies in, ascending.
    chirps : PlacedChirps
        Where the bursts are, and their templates.
    owners, bins : (K,) int
        Burst and grid bin of every column; the columns of a ramp stand together.
    precisions, amplitudes : (K,) float and complex
        Prior precision and mean of their weights.
    covariances, variances : (sum of K^2,), (K,)
        Those of every ramp's columns, and their diagonals; of the last posterior.
    traces, log_determinants : (R,) float
        tr(A C A^H) and log|C| of every ramp.
    signals : (B, N) complex
        What the columns of each burst add up to.
    interfered, first_burst, first_column : (R,), (R + 1,), (R + 1,) int
        The rows that hold bursts, and where their bursts and columns begin.
    ramps_of_bursts, num_columns : (B,) int
        Which of these rows each burst lies in, and how many columns it has.
    """

    def __init__(self, model: SignalModel, bursts: Sequence[BurstComponents]) -> None:
        start = burst_sequence(bursts, model.num_ramps)
        flat = start.flat
        self.rows, self.owners = flat.rows, flat.owners
        # Copies of what a step changes in place: the state that it starts from keeps its own.
        self.bins, self.precisions = flat.bins.copy(), flat.precisions.copy()
        self.amplitudes = flat.amplitudes.copy()
        self.chirps = start.chirps(model)
        none = np.zeros(0)
        self.covariances, self.variances = none.astype(np.complex128), none
        self.traces, self.log_determinants = none, none
        self.signals = np.zeros(self.chirps.templates.shape, dtype=np.complex128)
        if start.layout is None:
            self._lay_out()
        else:
            self.interfered, self.first_burst, self.ramps_of_bursts = start.layout[:3]
            self.num_columns, self.first_column = start.layout[3:]
        if len(self.interfered) < len(self.rows):
            self._group_columns()

    def __len__(self) -> int:
        """Return the number of bursts."""
        return len(self.rows)

    def _lay_out(self) -> None:
        """Find the first burst and the first column of every interfered row, and these rows."""
        # Rows are ascending: a row begins where its number changes.
        begins = np.ones(len(self.rows) + 1, dtype=bool)
        np.not_equal(self.rows[1:], self.rows[:-1], out=begins[1:-1])
        self.first_burst = begins.nonzero()[0]
        self.interfered = self.rows[self.first_burst[:-1]]
        self.ramps_of_bursts = begins[:-1].cumsum() - 1
        self._lay_out_columns()

    def _lay_out_columns(self) -> None:
        self.num_columns = np.bincount(self.owners, minlength=len(self.rows))
        ends = np.zeros(len(self.rows) + 1, dtype=np.int64)
        self.num_columns.cumsum(out=ends[1:])
        self.first_column = ends[self.first_burst]

    def _group_columns(self) -> None:
        """Let the columns of each burst stand together where a ramp has several."""
        # stable: columns of a burst keep their order
        order = np.argsort(self.owners, kind="stable")
        self.owners, self.bins = self.owners[order], self.bins[order]
        self.precisions, self.amplitudes = self.precisions[order], self.amplitudes[order]

    def flat(self, twiddle: ComplexArray) -> FlatRamps:
        """Return what the kernels take of all ramps; `twiddle` (M,) are values of the atoms."""
        return FlatRamps(
            self.chirps.templates,
            self.first_burst,
            self.owners,
            self.bins,
            self.precisions,
            self.first_column,
            twiddle,
        )

    def in_rounds(self) -> Iterator[IntArray]:
        """Yield the places of the first burst of every ramp, then of the second."""
        if len(self.interfered) == len(self.rows):
            if len(self.rows):
                yield np.arange(len(self.rows))
            return
        first = self.first_burst
        for index in range(int(np.diff(first).max())):
            places = first[:-1] + index
            yield places[places < first[1:]]

    def moving(self, places: IntArray, numbers: IntArray) -> tuple[IntArray, IntArray]:
        """(R,) which burst of every ramp is among some (T,), and the number (T,) that it has there.

        Zero and -1 where none is; of the bursts of a ramp there is one at most.
        """
        moving = np.zeros(len(self.interfered), dtype=np.int64)
        if len(places) == len(self.rows) == len(moving):  # one burst in a ramp, and all of them
            return moving, numbers
        ramps, shared = self.ramps_of_bursts[places], moving - 1
        moving[ramps] = places - self.first_burst[ramps]
        shared[ramps] = numbers
        return moving, shared

    def take_posterior(self, fit: FlatPosterior) -> None:
        """Store the posteriors of all ramps."""
        self.covariances, self.variances, self.amplitudes = fit[:3]
        self.traces, self.log_determinants, self.signals = fit[3:]

    def columns_of(self, ramp: int) -> slice:
        """Return where the columns of an interfered ramp stand."""
        return slice(int(self.first_column[ramp]), int(self.first_column[ramp + 1]))

    def covariance_of(self, ramp: int, covariances: ComplexArray) -> ComplexArray:
        """(K, K) covariance of the columns of an interfered ramp, of those of all."""
        sizes = np.diff(self.first_column)
        if len(covariances) != np.sum(sizes**2):
            return np.zeros((0, 0), dtype=np.complex128)
        place, size = int(np.sum(sizes[:ramp] ** 2)), int(sizes[ramp])
        return covariances[place : place + size**2].reshape(size, size)

    def ramps(self) -> dict[int, RampBursts]:
        """Return what every interfered row holds, by its number."""
        return {int(row): self.ramp(ramp) for ramp, row in enumerate(self.interfered)}

    def ramp(self, ramp: int) -> RampBursts:
        """Return what an interfered ramp holds."""
        first, last = int(self.first_burst[ramp]), int(self.first_burst[ramp + 1])
        columns = self.columns_of(ramp)
        return RampBursts(
            ramp=int(self.interfered[ramp]),
            chirps=self.chirps.chosen(np.arange(first, last)),
            owners=self.owners[columns] - first,
            bins=self.bins[columns],
            precisions=self.precisions[columns],
            amplitudes=self.amplitudes[columns],
            covariance=self.covariance_of(ramp, self.covariances),
            signals=self.signals[first:last],
        )

    def frozen(self, model: SignalModel) -> BurstSequence:
        """Return what the next step starts from; `model` is that of the templates."""
        signals, chirps = self.signals, self.chirps
        flat = FlatBursts(
            rows=self.rows,
            start_frequency=chirps.start_frequency,
            slope=chirps.slope,
            energies=np.sum(signals.real**2 + signals.imag**2, axis=1),
            owners=self.owners,
            bins=self.bins,
            precisions=self.precisions,
            amplitudes=self.amplitudes,
            covariances=self.covariances,
        )
        by_burst = isinstance(model.anti_aliasing_filter, RaisedCosineFilter)
        layout = BurstLayout(
            self.interfered,
            self.first_burst,
            self.ramps_of_bursts,
            self.num_columns,
            self.first_column,
        )
        placed = (chirps, model) if by_burst else None
        return BurstSequence(flat, model.num_ramps, placed, layout)

    def add_bursts(self, rows: IntArray, chirps: PlacedChirps) -> IntArray:
        """Add one burst to each of some rows, ascending, after those that are there.

        Returns
        -------
        (T,) int
            Where the new bursts stand.
        """
        if len(self) == 0:  # as in the first search of a run
            self.rows, self.chirps = rows, chirps
            self.signals = np.zeros_like(chirps.templates)
            self._lay_out()
            return np.arange(len(rows))
        places = np.searchsorted(self.rows, rows, side="right")
        # Bursts behind an insertion are renumbered.
        self.owners = self.owners + np.searchsorted(places, self.owners, side="right")
        self.rows = np.insert(self.rows, places, rows)
        self.chirps = self.chirps.with_others(places, chirps)
        self.signals = np.insert(self.signals, places, 0.0, axis=0)
        self._lay_out()
        return places + np.arange(len(places))

    def remove_bursts(self, places: IntArray | BoolArray) -> None:
        """Take bursts out with their columns; posteriors are those of the next ones."""
        stay = np.ones(len(self), dtype=bool)
        stay[places] = False
        kept = stay[self.owners]
        self.owners = (np.cumsum(stay) - 1)[self.owners[kept]]  # numbers among those that stay
        self.bins, self.precisions = self.bins[kept], self.precisions[kept]
        self.amplitudes = self.amplitudes[kept]
        self.rows, self.chirps = self.rows[stay], self.chirps.chosen(stay)
        self.signals = self.signals[stay]
        self._lay_out()

    def add_columns(self, owners: IntArray, bins: IntArray, precisions: FloatArray) -> IntArray:
        """Add one column to each of some ramps, ascending, after those that are there.

        Returns
        -------
        (T,) int
            Where the new columns stand.
        """
        places = self.first_column[self.ramps_of_bursts[owners] + 1]
        self.owners = np.insert(self.owners, places, owners)
        self.bins = np.insert(self.bins, places, bins)
        self.precisions = np.insert(self.precisions, places, precisions)
        self.amplitudes = np.insert(self.amplitudes, places, 0.0)
        self._lay_out_columns()
        return np.asarray(places + np.arange(len(places)))

    def remove_columns(self, places: Sequence[int]) -> None:
        """Take columns out."""
        if len(places) == 0:
            return
        stay = np.ones(len(self.owners), dtype=bool)
        stay[places] = False
        self.owners, self.bins = self.owners[stay], self.bins[stay]
        self.precisions, self.amplitudes = self.precisions[stay], self.amplitudes[stay]
        self._lay_out_columns()

    def keep_strongest_columns(self, rows: BoolArray) -> None:
        """Leave one column of each burst in some of the rows of the frame (R,)."""
        order = np.lexsort((-np.abs(self.amplitudes), self.owners))
        _, first = np.unique(self.owners[order], return_index=True)
        stay = np.zeros(len(self.owners), dtype=np.bool_)
        stay[order[first]] = True
        self.remove_columns(np.flatnonzero(~stay & rows[self.rows][self.owners]).tolist())

    def set_columns(self, owners: IntArray, bins: IntArray, precisions: FloatArray) -> None:
        """Put other columns in place of all; their weights are those of the next posterior."""
        self.owners, self.bins, self.precisions = owners, bins, precisions
        self.amplitudes = np.zeros(len(bins), dtype=np.complex128)
        self._lay_out_columns()
