"""Records of presets: radar, interferer, what is drawn at random, defaults and ranges.

A module that defines a preset imports this one and `vsep.presets.channels`, no more.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np

from vsep.parameters import PARAMETERS
from vsep.parameters.record import Range
from vsep.signal.radar import ChirpSequence, InterfererSequence
from vsep.signal.scene import Channel, Interferer

DrawObjects: TypeAlias = Callable[[np.random.Generator, int | None], Channel]
DrawPaths: TypeAlias = Callable[[np.random.Generator], Channel]
DrawInterferer: TypeAlias = Callable[[int, float, float], Interferer]


@dataclass(frozen=True, kw_only=True)
class Preset:
    """What simulated and recorded presets have in common."""

    #: as programs spell it, as a form shows it, and one sentence
    name: str
    label: str
    help: str
    radar: ChirpSequence  #: the victim
    interferer: InterfererSequence  #: the other radar, with its usual slope
    #: what forms offer for the interferer's slope, the half-amplitude frequency of the
    #: anti-aliasing filter, and the shift of the crossing inside a ramp
    slope_range_hz_per_s: Range
    cutoff_range_hz: Range
    shift_range_s: Range
    #: usual levels, (25) and (26)
    snr_db: float = PARAMETERS["snr_db"].default
    sir_db: float = PARAMETERS["sir_db"].default
    #: of the raised cosine that is its anti-aliasing filter; half of the amplitude passes at a
    #: quarter of the sampling rate
    filter_rolloff: float = PARAMETERS["filter_rolloff"].default

    max_iterations: int = PARAMETERS["max_iterations"].default  #: usual limit of a run

    @property
    def filter_cutoff_hz(self) -> float:
        """Half-amplitude frequency of the anti-aliasing filter."""
        return self.radar.sample_rate_hz / 4.0

    def defaults(self) -> dict[str, Any]:
        """Return the settings that choosing it sets, by their names in `PARAMETERS`."""
        cutoff_hz = self.filter_cutoff_hz
        return {
            "snr_db": self.snr_db,
            "sir_db": self.sir_db,
            "interferer_slope": self._shown("interferer_slope", self.interferer.slope_hz_per_s),
            "max_iterations": self.max_iterations,
            "burst_shift": PARAMETERS["burst_shift"].default,
            "filter_cutoff": self._shown("filter_cutoff", cutoff_hz),
            "assumed_cutoff": self._shown("assumed_cutoff", cutoff_hz),
        }

    def ranges(self) -> dict[str, Range]:
        """Return the ranges of the settings that depend on it, by their names in `PARAMETERS`."""
        ends = {
            "interferer_slope": self.slope_range_hz_per_s,
            "filter_cutoff": self.cutoff_range_hz,
            "assumed_cutoff": self.cutoff_range_hz,
            "burst_shift": self.shift_range_s,
        }
        return {
            name: (self._shown(name, low), self._shown(name, high))
            for name, (low, high) in ends.items()
        }

    @staticmethod
    def _shown(name: str, value_si: float) -> float:
        return PARAMETERS[name].shown(value_si)


@dataclass(frozen=True, kw_only=True)
class SimulatedPreset(Preset):
    """A preset whose objects, interference paths and noise are drawn.

    Examples
    --------
    >>> from dataclasses import replace
    >>> from vsep.presets.registry import simulated_preset
    >>> mine = replace(simulated_preset("simulation-1"), name="mine", snr_db=20.0)
    >>> mine.defaults()["snr_db"], mine.radar.shape
    (20.0, (1, 256))
    """

    #: draws the object channel with a generator and a number of objects, None for the usual one
    draw_objects: DrawObjects
    draw_paths: DrawPaths  #: draws the interference channel
    num_objects: int  #: usual number of objects
    num_cars: int = 0  #: usual number of extended objects beside them
    acceleration_mps2: float = 0.0  #: by which all gain or lose velocity, usually
    object_delay_s: float = float("nan")  #: delay of the first object, NaN where it is drawn
    family: str = ""  #: scene of studies in which presets of one family take turns
    waveform: str = PARAMETERS["interferer_waveform"].default  #: what the other radar sends
    #: transmitters with phase steps, of `vsep.parameters.DOPPLER_DIVISIONS`
    doppler_division: str = PARAMETERS["doppler_division"].default
    num_interferers: int = 1  #: the further ones are drawn by `vsep.presets.scenes`
    noise_scene: str = ""  #: scene of studies that is noise alone, of the size of its frames

    def defaults(self) -> dict[str, Any]:
        """Return the settings that choosing it sets, by their names in `PARAMETERS`."""
        return {
            **Preset.defaults(self),
            "num_objects": self.num_objects,
            "num_cars": self.num_cars,
            "object_acceleration": self.acceleration_mps2,
            "interferer_waveform": self.waveform,
            "doppler_division": self.doppler_division,
        }


@dataclass(frozen=True, kw_only=True)
class RecordedPreset(Preset):
    """A recorded frame, to which simulated bursts are added."""

    frame_file: str  #: the frame; one of those that the program ships by its path below ``assets/``
    #: makes the other radar from a seed, its slope in Hz/s and the shift of its crossing in s
    draw_interferer: DrawInterferer
