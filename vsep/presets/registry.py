"""The presets by name: those of Table I, a recorded frame, and what other distributions bring.

A distribution adds presets by entry points of the group ``vsep.presets``, each a record.
"""

from collections.abc import Callable
from typing import Final

from vsep._entry_points import load_entries, require_loadable
from vsep.errors import InputError, shown
from vsep.presets import (
    braking,
    extended_car,
    measurement,
    moving_car,
    real_frame,
    simulation_1,
    simulation_2,
    transmitters,
)
from vsep.presets.record import Preset, SimulatedPreset

GROUP: Final = "vsep.presets"
_OWN: Final[dict[str, Preset]] = {
    preset.name: preset
    for preset in (
        simulation_1.PRESET,
        *simulation_2.PRESETS,
        measurement.PRESET,
        moving_car.PRESET,
        *transmitters.PRESETS,
        extended_car.PRESET,
        braking.PRESET,
        real_frame.PRESET,
    )
}
PRESETS: Final[dict[str, Preset]] = {
    **_OWN,
    **{
        preset.name: preset
        for preset in load_entries(GROUP).values()
        if isinstance(preset, Preset) and preset.name not in _OWN
    },
}
PRESET_NAMES: Final = tuple(
    name for name, preset in PRESETS.items() if isinstance(preset, SimulatedPreset)
)
"""The simulated ones."""
DEFAULT_PRESET: Final = PRESET_NAMES[0]


def simulated_preset(preset: str | SimulatedPreset) -> SimulatedPreset:
    """Return a simulated preset by its name; a record is returned as it is.

    Raises `InputError` if there is none of that name.

    Examples
    --------
    >>> simulated_preset("simulation-2-a").radar.shape
    (16, 128)
    """
    found = PRESETS.get(preset) if isinstance(preset, str) else preset
    if not isinstance(found, SimulatedPreset):
        require_loadable(GROUP, str(preset))
        raise InputError(
            f"The preset is {shown(preset)}; it must be one of {', '.join(PRESET_NAMES)}."
        )
    return found


def _gathered(scene_of: Callable[[SimulatedPreset], str]) -> dict[str, tuple[SimulatedPreset, ...]]:
    found: dict[str, tuple[SimulatedPreset, ...]] = {}
    for name in PRESET_NAMES:
        preset = simulated_preset(name)
        if scene := scene_of(preset):
            found[scene] = (*found.get(scene, ()), preset)
    return found


NOISE_SCENES: Final = _gathered(lambda preset: preset.noise_scene)
"""Scenes of noise alone, with the presets whose frames have their size."""
SCENES: Final = (
    _gathered(lambda preset: preset.name) | _gathered(lambda preset: preset.family) | NOISE_SCENES
)
"""All scenes that a point of a study can have, with the presets that take turns in them."""
