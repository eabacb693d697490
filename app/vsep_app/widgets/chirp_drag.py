"""Dragging of chirps: sideways it moves their crossing, at an end it turns their slope."""

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from vsep_app.model.crossing import Courses, Crossing, CrossingPlane
from vsep_app.model.settings import SETTINGS, Settings
from vsep_app.views.pointer import END, REACH_PX, START, Drag

SNAP = 0.02  # MHz/us: a slope so near to the victim's is the victim's
_LEAST_LEVER = 0.05  # of a ramp, from the crossing to the pointer that turns a chirp
SHIFT, SLOPE = "burst_shift", "interferer_slope"


class _Grip(NamedTuple):
    """What is dragged: a setting, the ramp of the chirp, its crossing, and values at the start."""

    name: str
    ramp: int
    crossing_us: float
    time_us: float
    value: float


class ChirpDrag:
    """Moves the slider of burst position or slope with the pointer; its release sets the setting.

    Parameters
    ----------
    settings : Settings
        What is set in the end.
    widgets : mapping of str to widget
        The sliders of both settings, by their names.
    """

    def __init__(self, settings: Settings, widgets: Mapping[str, Any]) -> None:
        self._settings, self._widgets = settings, widgets
        self._grip: _Grip | None = None

    @property
    def can_drag(self) -> bool:
        """Whether there are chirps that follow the sliders."""
        return not any(self._widgets[name].disabled for name in (SHIFT, SLOPE))

    def take(self, drag: Drag, crossing: Crossing) -> None:
        """Follow the pointer over what is drawn."""
        if drag.phase == START:
            self._grip = self._grip_at(drag, crossing) if self.can_drag else None
        grip = self._grip
        if grip is None:
            return
        value = _dragged(grip, drag, crossing.plane)
        if value is not None:
            widget, step = self._widgets[grip.name], SETTINGS[grip.name].step
            value = round(min(max(value, widget.start), widget.end) / step) * step
            widget.value = float(f"{value:.12g}")
        if drag.phase == END:
            self._grip = None
            self._settings.param.update(**{grip.name: self._widgets[grip.name].value})

    def _grip_at(self, drag: Drag, crossing: Crossing) -> _Grip | None:
        """Return what lies under the pointer: the end of a chirp before the chirp itself."""
        plane, true = crossing.plane, crossing.true
        if not len(true.ramps):
            return None
        begin, end = drawn_ends(plane, true)
        scale = np.array([drag.dx, drag.dy])
        pointer = np.array([drag.x, drag.y]) / scale
        begin, end = begin / scale, end / scale
        times = true.handles_us(plane.reach_mhz, plane.ramp_us)
        handles = np.stack(plane.place(true.ramps, times, true.at(times)), axis=1) / scale
        to_end = np.linalg.norm(handles - pointer, axis=1)
        along = end - begin
        length = np.maximum(np.sum(along**2, axis=1), 1e-12)
        share = np.clip(np.sum((pointer - begin) * along, axis=1) / length, 0.0, 1.0)
        to_chirp = np.linalg.norm(begin + share[:, None] * along - pointer, axis=1)
        turns = to_end.min() <= REACH_PX
        index = int(to_end.argmin() if turns else to_chirp.argmin())
        if not turns and to_chirp[index] > REACH_PX:
            return None
        name, ramp = SLOPE if turns else SHIFT, int(true.ramps[index])
        return _Grip(
            name=name,
            ramp=ramp,
            crossing_us=float(true.pivots_us(plane.ramp_us)[index]),
            time_us=plane.read(drag.x, drag.y, ramp)[0],
            value=float(getattr(self._settings, name)),
        )


def drawn_ends(plane: CrossingPlane, courses: Courses) -> tuple[Any, Any]:
    """(B, 2) ends of courses as they are drawn."""
    first, last = courses.within(plane.reach_mhz, plane.ramp_us)
    begin, end = (
        np.stack(plane.place(courses.ramps, times, courses.at(times)), axis=1)
        for times in (first, last)
    )
    return begin, end


def _dragged(grip: _Grip, drag: Drag, plane: CrossingPlane) -> float | None:
    """Return the value that a place of the pointer means; None where it has no meaning."""
    time_us, frequency_mhz = plane.read(drag.x, drag.y, grip.ramp)
    if grip.name == SHIFT:
        return grip.value + time_us - grip.time_us
    lever_us = time_us - grip.crossing_us
    if abs(lever_us) < _LEAST_LEVER * plane.ramp_us:
        return None
    difference = frequency_mhz / lever_us
    return plane.victim_slope + (0.0 if abs(difference) < SNAP else difference)
