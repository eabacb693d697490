"""Variational separation of object signals and mutual interference of automotive FMCW radars.

Names are loaded when they are first used: importing the package alone costs next to nothing.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from vsep._version import __version__

if TYPE_CHECKING:
    from vsep.errors import InputError
    from vsep.files.frame import Frame, read_frame, write_frame
    from vsep.inference.core.run import iterate, run
    from vsep.inference.factorised import FactorisedSeparator
    from vsep.inference.objects.object_only import ObjectOnlySeparator
    from vsep.inference.objects.uncertainty import dispersion_std
    from vsep.presets.scenes import preset, simulate_preset
    from vsep.signal.filters import ButterworthFilter, MeasuredFilter, NoFilter, RaisedCosineFilter
    from vsep.signal.radar import ChirpSequence, InterfererSequence
    from vsep.signal.scene import Channel, GroundTruth, Interferer, Observation, Scene
    from vsep.signal.simulate import add_interference, simulate
    from vsep.signal.template import SignalModel

__all__ = [
    "ButterworthFilter",
    "Channel",
    "ChirpSequence",
    "FactorisedSeparator",
    "Frame",
    "GroundTruth",
    "InputError",
    "Interferer",
    "InterfererSequence",
    "MeasuredFilter",
    "NoFilter",
    "ObjectOnlySeparator",
    "Observation",
    "RaisedCosineFilter",
    "Scene",
    "SignalModel",
    "__version__",
    "add_interference",
    "dispersion_std",
    "iterate",
    "preset",
    "read_frame",
    "run",
    "simulate",
    "simulate_preset",
    "write_frame",
]

_HOMES = {
    "ButterworthFilter": "vsep.signal.filters",
    "Channel": "vsep.signal.scene",
    "ChirpSequence": "vsep.signal.radar",
    "FactorisedSeparator": "vsep.inference.factorised",
    "Frame": "vsep.files.frame",
    "GroundTruth": "vsep.signal.scene",
    "InputError": "vsep.errors",
    "Interferer": "vsep.signal.scene",
    "InterfererSequence": "vsep.signal.radar",
    "MeasuredFilter": "vsep.signal.filters",
    "NoFilter": "vsep.signal.filters",
    "ObjectOnlySeparator": "vsep.inference.objects.object_only",
    "Observation": "vsep.signal.scene",
    "RaisedCosineFilter": "vsep.signal.filters",
    "Scene": "vsep.signal.scene",
    "SignalModel": "vsep.signal.template",
    "add_interference": "vsep.signal.simulate",
    "dispersion_std": "vsep.inference.objects.uncertainty",
    "iterate": "vsep.inference.core.run",
    "preset": "vsep.presets.scenes",
    "read_frame": "vsep.files.frame",
    "run": "vsep.inference.core.run",
    "simulate": "vsep.signal.simulate",
    "simulate_preset": "vsep.presets.scenes",
    "write_frame": "vsep.files.frame",
}


def __getattr__(name: str) -> Any:
    """Load a public name from its module, the first time that it is asked for."""
    if name not in _HOMES:
        raise AttributeError(f"module 'vsep' has no attribute {name!r}")
    value = getattr(import_module(_HOMES[name]), name)
    globals()[name] = value
    return value
