"""The bursts of one ramp while a step changes them, and those of all ramps as kernels take them."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import accumulate

import numpy as np

from vsep._arrays import ComplexArray, FloatArray, IntArray
from vsep.inference.chirp_refinement import PlacedChirp
from vsep.kernels.ramps import FlatRamps


@dataclass(slots=True, eq=False)
class RampWork:
    """The bursts of one ramp inside a step: their columns, and the posterior once computed.

    Column i belongs to the chirp ``owners[i]`` and the grid bin ``bins[i]``; ``signals`` (B, N) is
    what the columns of each chirp add up to.
    """

    ramp: int
    chirps: list[PlacedChirp] = field(default_factory=list)
    owners: IntArray = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    bins: IntArray = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    precisions: FloatArray = field(default_factory=lambda: np.zeros(0))
    amplitudes: ComplexArray = field(default_factory=lambda: np.zeros(0, dtype=np.complex128))
    covariance: ComplexArray = field(default_factory=lambda: np.zeros((0, 0), dtype=np.complex128))
    signals: ComplexArray = field(default_factory=lambda: np.zeros((0, 0), dtype=np.complex128))
    trace: float = 0.0
    log_determinant: float = 0.0

    @property
    def templates(self) -> ComplexArray:
        """(B, N) templates of the chirps."""
        if len(self.chirps) == 1:
            return self.chirps[0].template[None]
        return np.stack([chirp.template for chirp in self.chirps])

    @property
    def signal(self) -> ComplexArray:
        """(N,) sum of the bursts."""
        total: ComplexArray = (
            self.signals[0] if len(self.signals) == 1 else self.signals.sum(axis=0)
        )
        return total

    def own(self, index: int) -> IntArray:
        """Return the columns of one burst."""
        return np.flatnonzero(self.owners == index)

    def remove_burst(self, index: int) -> None:
        """Take one burst out with its columns; the covariance is that of the next posterior."""
        gone = self.own(index)
        self.bins, self.precisions = np.delete(self.bins, gone), np.delete(self.precisions, gone)
        self.amplitudes = np.delete(self.amplitudes, gone)
        owners = np.delete(self.owners, gone)
        self.owners = owners - (owners > index)
        self.signals = np.delete(self.signals, index, axis=0)
        del self.chirps[index]


def flat_ramps(ramps: Sequence[RampWork], twiddle: ComplexArray) -> FlatRamps:
    """All bursts and columns of some ramps, at least one, in flat arrays.

    Parameters
    ----------
    ramps : sequence of RampWork
        With a burst each.
    twiddle : (M,) complex
        Values of the channel grid's atoms.
    """
    return FlatRamps(
        np.array([chirp.template for ramp in ramps for chirp in ramp.chirps]),
        _first_places([len(ramp.chirps) for ramp in ramps]),
        np.concatenate([ramp.owners for ramp in ramps]),
        np.concatenate([ramp.bins for ramp in ramps]),
        np.concatenate([ramp.precisions for ramp in ramps]),
        _first_places([len(ramp.bins) for ramp in ramps]),
        twiddle,
    )


def _first_places(counts: Sequence[int]) -> IntArray:
    return np.array([0, *accumulate(counts)])
