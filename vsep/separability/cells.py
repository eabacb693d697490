"""Trials of an estimator in the cells of a map, from coarse to fine.

The corners of large blocks come first, then those of blocks half as wide: a picture of the whole
map is there early, and gets finer.
"""

import threading
from collections import defaultdict
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from vsep.separability.map_spec import Cell, MapSpec
from vsep.studies.engine import run_on_processes
from vsep.studies.groups import number
from vsep.studies.study import Point, Trial
from vsep.studies.trial import DONE, Row


@dataclass(frozen=True, kw_only=True, slots=True)
class CellResult:
    """What the trials of one cell gave, added up."""

    cell: Cell  #: (int, int) column and row
    #: trials made, and those of them without a result
    num_trials: int
    num_failed: int = 0
    #: true objects, and those within the cut-off of GOSPA, one resolution cell by default
    num_objects: int
    num_found: int
    num_false: int  #: false alarms
    squared_errors: float  #: sum over the found objects of beat plus Doppler error squared
    squared_bounds: float  #: sum over the trials of their mean bound on that

    @property
    def detection(self) -> float:
        """Share of the true objects that were found; NaN without a result."""
        return self.num_found / self.num_objects if self.num_objects else float("nan")

    @property
    def false_alarms(self) -> float:
        """False alarms a frame; NaN without a result."""
        finished = self.num_trials - self.num_failed
        return self.num_false / finished if finished else float("nan")

    @property
    def rmse_over_crlb(self) -> float:
        """Root mean squared error of what was found over the root CRLB; NaN if nothing was."""
        if not self.num_found or not self.squared_bounds > 0.0:
            return float("nan")
        bound = self.squared_bounds / (self.num_trials - self.num_failed)
        return float(np.sqrt(self.squared_errors / self.num_found / bound))


def cells_coarse_to_fine(num_columns: int, num_rows: int) -> list[Cell]:
    """Return all cells, those of coarse grids first.

    Examples
    --------
    >>> cells_coarse_to_fine(3, 2)
    [(0, 0), (2, 0), (1, 0), (0, 1), (1, 1), (2, 1)]
    """
    order: dict[Cell, None] = {}
    for step in _steps(num_columns, num_rows):
        for row in range(0, num_rows, step):
            order.update(((column, row), None) for column in range(0, num_columns, step))
    return list(order)


def compute_map(
    spec: MapSpec,
    *,
    workers: int = 1,
    stop: threading.Event | None = None,
    known: Collection[Cell] = (),
) -> Iterator[CellResult]:
    """Run the trials of a map's cells and yield each cell as it is finished.

    Parameters
    ----------
    spec : MapSpec
        The map.
    workers : int
        Local processes.
    stop : threading.Event, optional
        Set by another thread it ends the processes at once, and there are no more cells.
    known : collection of (int, int)
        Cells that need not be made.

    Yields
    ------
    CellResult
        Coarse grids first. Cells of one and the same scene are made once.
    """
    cells: defaultdict[Point, list[Cell]] = defaultdict(list)
    for cell in cells_coarse_to_fine(spec.x.count, spec.y.count):
        if cell not in known:
            cells[spec.point(cell)].append(cell)
    rows: defaultdict[Point, list[Row]] = defaultdict(list)
    if spec.trials == 0 or not cells:
        return
    trials = _trials(spec, list(cells.values()))
    for (row,) in run_on_processes(trials, workers=workers, stop=stop):
        point = Point(**row["point"])
        rows[point].append(row)
        if len(rows[point]) == spec.trials:
            cell_result = summarise_cell(cells[point][0], rows.pop(point))
            yield from (replace(cell_result, cell=cell) for cell in cells[point])


def summarise_cell(cell: Cell, rows: Sequence[Row]) -> CellResult:
    """Add up the rows of a cell, one a trial."""
    finished = [row for row in rows if row["status"] == DONE]
    errors = np.array([error for row in finished for error in row["errors"]], dtype=np.float64)
    bounds = np.array([number(row["root_crlb"]) for row in finished], dtype=np.float64)
    return CellResult(
        cell=cell,
        num_trials=len(rows),
        num_failed=len(rows) - len(finished),
        num_objects=sum(row["num_objects_true"] for row in finished),
        num_found=len(errors),
        num_false=sum(row["false_alarms"] for row in finished),
        squared_errors=float(np.sum(errors**2)),
        squared_bounds=float(np.sum(bounds**2)),
    )


def coarser(cell: Cell, num_columns: int, num_rows: int) -> Iterator[Cell]:
    """Yield a cell and then, grid by grid, the coarser ones whose blocks it lies in."""
    for step in reversed(_steps(num_columns, num_rows)):
        yield cell[0] // step * step, cell[1] // step * step


def _steps(num_columns: int, num_rows: int) -> list[int]:
    """Spacings of the grids: the largest power of two within the map, halved down to one."""
    largest = max(num_columns, num_rows, 2) - 1
    return [2**power for power in range(largest.bit_length() - 1, -1, -1)]


def _trials(spec: MapSpec, groups: list[list[Cell]]) -> Iterator[Trial]:
    for group in groups:
        for realization in range(spec.trials):
            yield spec.trial(group[0], realization)
