"""True objects that are moved, added and taken away in the map; they live in the address."""

from collections.abc import Callable
from typing import Any

import numpy as np

from vsep.parameters import MAX_OBJECTS
from vsep.presets.places import Place, places_text
from vsep_app.model.markers import Markers
from vsep_app.model.settings import Settings
from vsep_app.views.pointer import END, REACH_PX, START, Drag


class ObjectDrag:
    """Sets the places of the objects by what is done in the map.

    Parameters
    ----------
    settings : Settings
        What is set in the end.
    widget : widget
        The field of the places, which is disabled where there are none to set.
    moved : callable
        Called while an object moves.
    """

    def __init__(self, settings: Settings, widget: Any, moved: Callable[[], None]) -> None:
        self._settings, self._widget, self._moved = settings, widget, moved
        self._places: list[Place] = []
        self._chosen: int | None = None
        #: The places while one of them moves, as the setting will have them.
        self.moving: str | None = None

    def take(self, drag: Drag, true_objects: Markers) -> None:
        """Follow the pointer over the map that shows these objects."""
        if drag.phase == START:
            self._choose(drag, true_objects)
        index = self._chosen
        if index is None or index >= len(self._places):
            return
        if drag.phase != START:
            level_db = self._places[index].level_db
            self._places[index] = Place(drag.x, drag.y, level_db)
            self.moving = places_text(self._places)
            self._moved()
        if drag.phase == END:
            placed, self.moving = self.moving, None
            self._settings.placed = placed
            self._moved()

    def add(self, x: float, y: float, true_objects: Markers) -> None:
        """Add an object as strong as the median of those there are; it can be deleted at once."""
        places = places_of(true_objects)
        if not self._widget.disabled and 0 < len(places) < MAX_OBJECTS:
            level_db = float(np.median([place.level_db for place in places]))
            self._places, self._chosen = [*places, Place(x, y, level_db)], len(places)
            self._settings.placed = places_text(self._places)

    def choose(self, drag: Drag, true_objects: Markers) -> None:
        """Take the object at the pointer as that which `delete` takes away."""
        self._choose(drag, true_objects)

    def delete(self) -> None:
        """Take the object away that was chosen or moved last; the only one stays."""
        index, self._chosen = self._chosen, None
        if index is not None and 1 < len(self._places) > index:
            del self._places[index]
            self._settings.placed = places_text(self._places)

    def _choose(self, drag: Drag, true_objects: Markers) -> None:
        self._chosen, self._places = None, places_of(true_objects)
        if self._widget.disabled or not self._places:
            return
        away = np.hypot(
            (true_objects.ranges_m - drag.x) / drag.dx,
            (true_objects.velocities_mps - drag.y) / drag.dy,
        )
        if away.min() <= REACH_PX:
            self._chosen = int(away.argmin())


def places_of(true_objects: Markers) -> list[Place]:
    """Return the places of true objects, levels against the strongest."""
    if not len(true_objects.ranges_m):
        return []
    levels_db = true_objects.levels_db - true_objects.levels_db.max()
    columns = true_objects.ranges_m, true_objects.velocities_mps, levels_db
    return [Place(*map(float, each)) for each in zip(*columns, strict=True)]
