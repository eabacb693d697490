"""Windows of a residual, as long as extended objects are, in which a group is evident.

Cells are a whole cell apart in range and half a cell in velocity; every window is cells in a row of
one velocity. The false-alarm rate is shared equally by the lengths of windows and, of each, by the
windows that hold an object that was found and those that do not: where there is a point already,
less is needed to see that it belongs to something larger.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from vsep._typing import BoolArray, FloatArray
from vsep.grouping.evidence import cell_evidence, evidence_threshold

LENGTHS_M: Final = (2.0, 4.0)
MIN_CELLS: Final = 4
BESIDE: Final = 2  # rows to either side of a window that are of the same velocity


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class Cells:
    """Powers of a residual over those of the noise.

    Parameters
    ----------
    powers : (R, N) float
        Sums over the antennas; rows half a cell of velocity apart, the first follows the last one;
        columns a cell of range.
    num_antennas : int
        A.
    """

    powers: FloatArray
    num_antennas: int

    def rows_beside(self, row: int) -> list[int]:
        """Rows of the same velocity as one of them, itself among them."""
        count = len(self.powers)
        return sorted({each % count for each in range(row - BESIDE, row + BESIDE + 1)})


@dataclass(frozen=True, kw_only=True, slots=True)
class Window:
    """Cells in a row that hold a group."""

    row: int
    first: int
    num_cells: int
    evidence: float  #: nats, against noise
    margin: float  #: by which it exceeds its threshold

    def overlaps(self, other: "Window", cells: Cells) -> bool:
        """Whether two windows have cells of one velocity in common."""
        apart = self.first + self.num_cells <= other.first
        apart = apart or other.first + other.num_cells <= self.first
        return not apart and other.row in cells.rows_beside(self.row)


def evident_windows(
    cells: Cells,
    found: Sequence[tuple[int, int]],
    cell_m: float,
    rate: float,
) -> list[Window]:
    """Return windows in which a group is evident, the most evident first; none overlap.

    What is left of a window without its strongest cell and the two beside it must speak for a
    group as well: a single line is none.

    Parameters
    ----------
    cells : Cells
        The residual.
    found : sequence of (int, int)
        Rows and columns of the objects that were found.
    cell_m : float
        Length of a cell.
    rate : float
        False alarms in a frame of noise.
    """
    lengths = window_lengths(cell_m, cells.powers.shape[1])
    windows = [
        window
        for num_cells in lengths
        for window in _of_length(cells, found, num_cells, rate / len(lengths))
    ]
    chosen: list[Window] = []
    for window in sorted(windows, key=lambda each: -each.margin):
        if not any(window.overlaps(other, cells) for other in chosen):
            chosen.append(window)
    return chosen


def window_lengths(cell_m: float, num_columns: int) -> list[int]:
    """Lengths of windows in cells; none where a group would be hardly more than a cell.

    Examples
    --------
    >>> window_lengths(0.19, 256), window_lengths(2.0, 256)
    ([11, 22], [])
    """
    lengths = {int(length // cell_m) + 1 for length in LENGTHS_M}
    return sorted(each for each in lengths if MIN_CELLS <= each <= num_columns // 2)


def _of_length(
    cells: Cells, found: Sequence[tuple[int, int]], num_cells: int, rate: float
) -> list[Window]:
    evidence = cell_evidence(cells.powers, num_cells, cells.num_antennas)
    sums = np.cumsum(np.pad(evidence, ((0, 0), (1, 0))), axis=1)
    sums = sums[:, num_cells:] - sums[:, :-num_cells]
    near = _near_objects(cells, found, num_cells, sums.shape[1])
    size = num_cells, cells.num_antennas
    num_near = int(np.count_nonzero(near))
    share = 0.5 * rate if num_near else rate
    thresholds = np.full(sums.shape, _threshold(share, len(sums), near.size - num_near, size))
    if num_near:
        runs = len(found) * (2 * BESIDE + 1)
        thresholds[near] = _threshold(share, runs, num_near, size)
    margins = sums - thresholds
    return [
        Window(
            row=int(row),
            first=int(first),
            num_cells=num_cells,
            evidence=float(sums[row, first]),
            margin=float(margins[row, first]),
        )
        for row, first in np.argwhere(margins > 0.0)
        if _has_further_lines(evidence[row, first : first + num_cells])
    ]


def _threshold(rate: float, num_rows: int, num_windows: int, size: tuple[int, int]) -> float:
    return evidence_threshold(rate, size[0], num_rows, max(num_windows - num_rows, 0), size[1])


def _near_objects(
    cells: Cells, found: Sequence[tuple[int, int]], num_cells: int, num_windows: int
) -> BoolArray:
    """Which windows (R, num_windows) hold an object."""
    near = np.zeros((len(cells.powers), num_windows), dtype=np.bool_)
    for row, column in found:
        near[cells.rows_beside(row), max(column - num_cells + 1, 0) : column + 1] = True
    return near


def _has_further_lines(evidence: FloatArray) -> bool:
    strongest = int(np.argmax(evidence))
    one = evidence[max(strongest - 1, 0) : strongest + 2]
    return bool(evidence.sum() - one.sum() > 0.0)
