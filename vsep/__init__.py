"""Variational separation of object signals and mutual interference of automotive FMCW radars."""

from vsep._arrays import InputError
from vsep._version import __version__
from vsep.files.frame import Frame, read_frame, write_frame
from vsep.inference.object_only import ObjectOnlySeparator
from vsep.inference.run import iterate, run
from vsep.inference.separator import FactorisedSeparator
from vsep.inference.uncertainty import dispersion_std
from vsep.signal.filters import ButterworthFilter, MeasuredFilter, NoFilter, RaisedCosineFilter
from vsep.signal.presets import preset, simulate_preset
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
