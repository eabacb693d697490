"""Constant-false-alarm-rate detection in spectra of one or two dimensions.

Every cell is compared with a multiple of the noise power seen around it: the mean of its training
cells (cell averaging), or one of their order statistics, which neighbouring objects cannot pull up.
Guard cells between keep the cell's own main lobe out. The multiples hold for cells of independent,
exponentially distributed noise power; a window makes neighbours alike and the rate a little higher.
Spectra are periodic, so training cells wrap around.
"""

from dataclasses import dataclass
from typing import Literal, TypeAlias, get_args

import numpy as np
from scipy import ndimage
from scipy.optimize import brentq

from vsep._typing import BoolArray, FloatArray, IntArray
from vsep._validation import require_choice, require_range
from vsep.errors import InputError

Statistic: TypeAlias = Literal["cell-averaging", "ordered-statistic"]


@dataclass(frozen=True, kw_only=True, slots=True)
class Cfar:
    """A detector.

    Examples
    --------
    >>> power = np.ones(32)
    >>> power[7] = 100.0
    >>> detector = Cfar(false_alarm_rate=1e-3, guard=(2,), training=(8,))
    >>> np.flatnonzero(detector.detect(power))
    array([7])
    """

    false_alarm_rate: float = 1e-4  #: probability that a cell of noise alone is detected
    #: cells on either side, one number an axis of the spectrum. Training cells lie outside the
    #: guard cells; a spectrum's axis of length one has neither.
    guard: tuple[int, ...] = (2, 2)
    training: tuple[int, ...] = (4, 8)
    statistic: Statistic = "cell-averaging"  #: "cell-averaging" or "ordered-statistic"
    rank_share: float = 0.75  #: which order statistic, as a share of the training cells

    def __post_init__(self) -> None:
        """Check the settings."""
        require_range("false_alarm_rate", self.false_alarm_rate, 1e-15, 0.5)
        require_range("rank_share", self.rank_share, 0.0, 1.0)
        require_choice("statistic", self.statistic, get_args(Statistic))
        if len(self.guard) != len(self.training) or min(*self.guard, *self.training) < 0:
            raise InputError(
                f"guard is {self.guard} and training {self.training}; both must have one number "
                "an axis, at least 0."
            )

    def detect(self, power: FloatArray) -> BoolArray:
        """Detect the cells whose power stands out.

        Parameters
        ----------
        power : (M,) or (Mp, Mn) float
            A spectrum, linear.

        Raises
        ------
        InputError
            If the spectrum has another number of axes, or is too small for the training cells.
        """
        footprint = self._footprint(np.shape(power))
        num_cells = int(footprint.sum())
        if self.statistic == "cell-averaging":
            weights = footprint / num_cells
            level = ndimage.convolve(power, weights, mode="wrap")
            factor = num_cells * (self.false_alarm_rate ** (-1.0 / num_cells) - 1.0)
        else:
            rank = max(1, round(self.rank_share * num_cells))
            # One axis more: SciPy's filter of a single axis overlooks holes in the footprint.
            level = ndimage.rank_filter(
                power[None], rank - 1, footprint=footprint[None], mode="wrap"
            )[0]
            factor = ordered_factor(self.false_alarm_rate, num_cells, rank)
        detected: BoolArray = power > factor * np.maximum(level, 0.0)
        return detected

    def peaks(self, power: FloatArray) -> IntArray:
        """(K, axes) positions of the detected cells that no neighbour exceeds."""
        highest = ndimage.maximum_filter(power, size=3, mode="wrap")
        return np.argwhere(self.detect(power) & (power >= highest))

    def fits(self, shape: tuple[int, ...]) -> bool:
        """Whether a spectrum of this shape is large enough.

        Examples
        --------
        >>> Cfar().fits((16, 128)), Cfar().fits((4, 32))
        (True, False)
        """
        try:
            self._footprint(shape)
        except InputError:
            return False
        return True

    def _footprint(self, shape: tuple[int, ...]) -> BoolArray:
        """Training cells around the middle of a box."""
        if len(shape) != len(self.guard):
            raise InputError(
                f"The spectrum has {len(shape)} axes; the detector has guard cells for "
                f"{len(self.guard)}."
            )
        single = [length == 1 for length in shape]
        guard = [0 if one else cells for one, cells in zip(single, self.guard, strict=True)]
        outer = [
            0 if one else cells + near
            for one, cells, near in zip(single, self.training, guard, strict=True)
        ]
        if any(2 * reach + 1 > length for reach, length in zip(outer, shape, strict=True)):
            raise InputError(
                f"The spectrum has shape {shape}; guard and training cells need at least "
                f"{tuple(2 * reach + 1 for reach in outer)}."
            )
        footprint = np.ones([2 * reach + 1 for reach in outer], dtype=np.bool_)
        inner = tuple(
            slice(reach - near, reach + near + 1) for reach, near in zip(outer, guard, strict=True)
        )
        footprint[inner] = False
        if not footprint.any():
            raise InputError("There is no training cell; at least one axis must have one.")
        return footprint


def ordered_factor(false_alarm_rate: float, num_cells: int, rank: int) -> float:
    """Multiple of the order statistic that noise exceeds at a rate.

    H. Rohling, Radar CFAR Thresholding in Clutter and Multiple Target Situations, 1983: the rate is
    the product over i < rank of ``(n - i) / (n - i + factor)`` for n cells.

    Examples
    --------
    >>> round(ordered_factor(0.1, 1, 1), 6)
    9.0
    """
    remaining = num_cells - np.arange(rank)

    def excess(log_factor: float) -> float:
        logarithms = np.log1p(np.exp(log_factor) / remaining)
        return float(-np.sum(logarithms) - np.log(false_alarm_rate))

    return float(np.exp(brentq(excess, -50.0, 100.0, xtol=1e-12)))
