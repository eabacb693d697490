"""Cache of the results of the last maps, so that a map asked for again goes on."""

import threading
from collections import OrderedDict

from vsep._validation import require_range
from vsep.separability.cells import CellResult
from vsep.separability.map_spec import Cell, MapSpec

_MAX_MAPS = 32


class MapCache:
    """Results by map; those longest not asked for are dropped. Threads may share it.

    Parameters
    ----------
    most : int
        Number of maps kept.
    """

    def __init__(self, most: int = _MAX_MAPS) -> None:
        require_range("Number of maps", most, 1, 10**6)
        self._most = most
        self._lock = threading.Lock()
        self._cell_results: OrderedDict[MapSpec, dict[Cell, CellResult]] = OrderedDict()

    def of(self, spec: MapSpec) -> dict[Cell, CellResult]:
        """Return the results of a map, and count it as asked for."""
        with self._lock:
            return dict(self._asked(spec))

    def add(self, spec: MapSpec, cell_result: CellResult) -> None:
        """Keep what was found in one cell."""
        with self._lock:
            self._asked(spec)[cell_result.cell] = cell_result

    def _asked(self, spec: MapSpec) -> dict[Cell, CellResult]:
        found = self._cell_results.setdefault(spec, {})
        self._cell_results.move_to_end(spec)
        while len(self._cell_results) > self._most:
            self._cell_results.popitem(last=False)
        return found
