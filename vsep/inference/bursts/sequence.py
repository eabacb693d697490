"""Bursts of a state: flat arrays for the kernels, records for everybody else."""

from collections.abc import Iterator, Sequence
from itertools import pairwise
from typing import Final, NamedTuple, overload

import numpy as np

from vsep._typing import ComplexArray, FloatArray, IntArray, frozen
from vsep.inference.bursts.chirp_refinement import PlacedChirps, place_chirps
from vsep.inference.core.state import BurstComponents
from vsep.signal.template import SignalModel

MANY_BURSTS: Final = 4  # in a ramp


class FlatBursts(NamedTuple):
    """B bursts in the order of rows, and the K columns of their channels in that order.

    ``rows`` (B,) are those of the frame; `owners` (K,) the burst of every column; `covariances`
    (sum of K^2,) hold one matrix for the columns of every interfered row.
    """

    rows: IntArray
    start_frequency: FloatArray
    slope: FloatArray
    energies: FloatArray
    owners: IntArray
    bins: IntArray
    precisions: FloatArray
    amplitudes: ComplexArray
    covariances: ComplexArray


class BurstLayout(NamedTuple):
    """Where bursts and columns stand in flat arrays: see `vsep.inference.bursts.table`."""

    interfered: IntArray
    first_burst: IntArray
    ramps_of_bursts: IntArray
    num_columns: IntArray
    first_column: IntArray


class BurstSequence(Sequence[BurstComponents]):
    """Bursts after a step; a record of a burst is made when it is first asked for.

    Parameters
    ----------
    flat : FlatBursts
        Nobody changes its arrays any more.
    num_ramps : int
        Rows of one antenna.
    placed : tuple of PlacedChirps and SignalModel, or None
        The bursts with the templates that the model gave them; they stay in this process.
    layout : BurstLayout, optional
        Of these bursts, where it is known; it stays in this process.
    """

    __slots__ = ("_components", "_placed", "flat", "layout", "num_ramps")

    def __init__(
        self,
        flat: FlatBursts,
        num_ramps: int,
        placed: tuple[PlacedChirps, SignalModel] | None = None,
        layout: BurstLayout | None = None,
    ) -> None:
        self.flat, self.num_ramps, self._placed, self.layout = flat, num_ramps, placed, layout
        self._components: tuple[BurstComponents, ...] | None = None

    def __reduce__(self) -> tuple[type["BurstSequence"], tuple[FlatBursts, int]]:
        """Leave out what can be made again."""
        return BurstSequence, (self.flat, self.num_ramps)

    def chirps(self, model: SignalModel) -> PlacedChirps:
        """Return the bursts with their templates, those that are there where they would be equal.

        Raised cosines are evaluated burst by burst: however many there are, the bits are the same.
        """
        if self._placed is not None and self._placed[1] is model:
            return self._placed[0]
        return place_chirps(self.flat.start_frequency, self.flat.slope, model)

    def with_channels(self, bursts: Sequence[BurstComponents]) -> "BurstSequence":
        """Return the same bursts as they are given, with other channels."""
        flat = burst_sequence(bursts, self.num_ramps).flat
        return BurstSequence(flat, self.num_ramps, self._placed)

    def __len__(self) -> int:
        """Return the number of bursts."""
        return len(self.flat.rows)

    @overload
    def __getitem__(self, index: int) -> BurstComponents: ...

    @overload
    def __getitem__(self, index: slice) -> tuple[BurstComponents, ...]: ...

    def __getitem__(self, index: int | slice) -> BurstComponents | tuple[BurstComponents, ...]:
        """Return one burst or several."""
        if self._components is None:
            self._components = tuple(self._made())
        return self._components[index]

    def _made(self) -> Iterator[BurstComponents]:
        """Make the record of every burst."""
        flat, num_ramps = self.flat, self.num_ramps
        bins, precisions = frozen(flat.bins.copy()), frozen(flat.precisions.copy())
        amplitudes = frozen(flat.amplitudes.copy())
        for burst, (columns, covariance) in enumerate(self._channels()):
            row = int(flat.rows[burst])
            yield BurstComponents(
                ramp=row % num_ramps,
                antenna=row // num_ramps,
                start_frequency=float(flat.start_frequency[burst]),
                slope=float(flat.slope[burst]),
                energy=float(flat.energies[burst]),
                active_bins=bins[columns],
                amplitudes=amplitudes[columns],
                covariance=covariance,
                precisions=precisions[columns],
            )

    def _channels(self) -> Iterator[tuple[slice | IntArray, ComplexArray]]:
        """Yield the columns of every burst and their covariance, read-only."""
        flat, place = self.flat, 0
        covariances = frozen(flat.covariances.copy())
        # Interfered rows hold one covariance matrix each.
        begins = np.flatnonzero(np.diff(flat.rows, prepend=-1, append=-1)).tolist()
        ends = np.searchsorted(flat.owners, begins).tolist()
        for (begin, end), (first, last) in zip(pairwise(begins), pairwise(ends), strict=True):
            size = last - first
            covariance = covariances[place : place + size**2].reshape(size, size)
            place += size**2
            if end - begin == 1:
                yield slice(first, last), covariance
                continue
            for burst in range(begin, end):
                # Several bursts share a row: each gets its block.
                inside = np.flatnonzero(flat.owners[first:last] == burst)
                yield first + inside, covariance[np.ix_(inside, inside)]


def is_crowded(bursts: Sequence[BurstComponents], num_ramps: int) -> bool:
    """Whether some ramp holds `MANY_BURSTS`: channels have been fitted to bursts beside them."""
    if len(bursts) < MANY_BURSTS:
        return False
    return bool(np.bincount(burst_sequence(bursts, num_ramps).flat.rows).max() >= MANY_BURSTS)


def burst_sequence(bursts: Sequence[BurstComponents], num_ramps: int) -> BurstSequence:
    """Bursts given one by one as a sequence, without the covariances, which no step needs."""
    if isinstance(bursts, BurstSequence):
        return bursts
    none = np.zeros(0)
    flat = FlatBursts(
        rows=np.array([b.antenna * num_ramps + b.ramp for b in bursts], dtype=np.int64),
        start_frequency=np.array([burst.start_frequency for burst in bursts]),
        slope=np.array([burst.slope for burst in bursts]),
        energies=np.array([burst.energy for burst in bursts]),
        owners=np.repeat(np.arange(len(bursts)), [len(burst.active_bins) for burst in bursts]),
        bins=np.concatenate([none.astype(np.int64), *(burst.active_bins for burst in bursts)]),
        precisions=np.concatenate([none, *(burst.precisions for burst in bursts)]),
        amplitudes=np.concatenate(
            [none.astype(np.complex128), *(burst.amplitudes for burst in bursts)]
        ),
        covariances=none.astype(np.complex128),
    )
    return BurstSequence(flat, num_ramps)
