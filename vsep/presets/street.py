"""Simulated street: a sequence of frames of any length, with the truth, from one seed.

The own car drives at constant speed. Oncoming cars pass it, two kinds in turn, each with a radar of
its own chirp slope that sends in bursts of some milliseconds; cyclists are overtaken, pedestrians
step out beside the road, and poles and parked cars stand along it. Every frame follows from its
number alone: places are closed forms of time, and what is drawn belongs to one object.

An object of 0 dBsm in front of the car at 10 m has unit energy in the frame; energies fall with the
fourth power of the distance, those of interferers with the second.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from vsep._typing import ComplexArray, FloatArray
from vsep._validation import require_range
from vsep.errors import InputError
from vsep.parameters import PARAMETERS
from vsep.presets.street_traffic import (
    FILTER,
    OTHER_SLOPE_HZ_PER_S,
    RADAR,
    points_of_street,
    sending_radars,
)
from vsep.signal.atoms import line_factors, synthesize
from vsep.signal.bursts import multiplicative_bursts
from vsep.signal.filters import AntiAliasingFilter
from vsep.signal.motion import CYCLE_S
from vsep.signal.radar import SPEED_OF_LIGHT_MPS
from vsep.signal.scene import Channel, Interferer, Observation, Scene
from vsep.signal.simulate import simulate
from vsep.units import to_db

SNR_DB: Final = 50.0
SIR_DB: Final = -25.0
MOST_FRAMES: Final = 1_000_000
_NOISE = 1000  # key of what is drawn for it, beside those of the traffic


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class StreetFrame:
    """One frame of the street.

    Parameters
    ----------
    number : int
        Its place in the sequence, from 0; frames are `vsep.signal.motion.CYCLE_S` apart.
    names : tuple of str
        Of the true objects, in the order of the truth; a name stays with its object.
    scene : Scene
        Objects in view and interferers that send.
    observation : Observation
        What the radar receives, and the truth.
    assumed_filter : AntiAliasingFilter
        The filter for an estimator to assume.
    """

    number: int
    names: tuple[str, ...]
    scene: Scene
    observation: Observation
    assumed_filter: AntiAliasingFilter


def street_frame(
    number: int,
    *,
    seed: int,
    snr_db: float = SNR_DB,
    sir_db: float = SIR_DB,
    interference: bool = True,
    interferer_slope_hz_per_s: float = OTHER_SLOPE_HZ_PER_S,
    anti_aliasing_filter: AntiAliasingFilter = FILTER,
    assumed_filter: AntiAliasingFilter = FILTER,
) -> StreetFrame:
    """Simulate one frame of the street.

    Parameters
    ----------
    number : int
        From 0.
    seed : int
        Draws what stands along the street, when others pass, phases and noise.
    snr_db : float
        Energy of an object of 0 dBsm at 10 m over the noise power of a sample, dB.
    sir_db : float
        The same energy over that of one whole burst of an interferer at 10 m, dB.
    interference : bool
        Whether the other radars send.
    interferer_slope_hz_per_s : float
        Chirp slope of the oncoming cars' radars.
    anti_aliasing_filter, assumed_filter : AntiAliasingFilter
        The one that shapes the bursts, and the one that an estimator is told.

    Raises
    ------
    InputError
        If a number is out of its range.

    Examples
    --------
    >>> frame = street_frame(40, seed=1)
    >>> frame.observation.received.shape, "cyclist 1" in frame.names
    ((32, 256), True)
    """
    require_range("frame_number", number, 0, MOST_FRAMES)
    PARAMETERS["seed"].require(seed, "seed")
    for name, value in (("snr_db", snr_db), ("sir_db", sir_db)):
        PARAMETERS[name].require(value)
    if interferer_slope_hz_per_s == RADAR.slope_hz_per_s:
        raise InputError(
            f"The interferer's slope is {interferer_slope_hz_per_s:g} Hz/s, the radar's own; it "
            "must be another one."
        )
    time_s = number * CYCLE_S
    points = [point for point in points_of_street(seed, time_s) if point.in_view]
    interferers: list[Interferer] = []
    if interference:
        interferers = sending_radars(seed, time_s, interferer_slope_hz_per_s)
    amplitudes = np.array([point.amplitude for point in points])
    delays_s = np.array([2.0 * point.range_m / SPEED_OF_LIGHT_MPS for point in points])
    dopplers = np.array([point.radial_mps for point in points])
    phases = np.array([point.phase for point in points])
    objects = Channel(
        delays_s=delays_s,
        dopplers_hz=dopplers * (2.0 * RADAR.start_frequency_hz / SPEED_OF_LIGHT_MPS),
        weights=amplitudes * np.exp(1j * (phases - 2.0 * np.pi * _turns(delays_s))),
    )
    bursts = sum(_energy(_bursts(each, anti_aliasing_filter)) for each in interferers)
    energy = _energy(_object_signal(objects))
    scene = Scene(
        objects=objects,
        interferers=tuple(interferers),
        snr_db=snr_db + float(to_db(energy)),
        # The energy of all bursts together; each has a level of its own by its distance.
        sir_db=sir_db + (float(to_db(energy / bursts)) if bursts > 0.0 else 0.0),
    )
    noise = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(_NOISE, number)))
    observation = simulate(RADAR, scene, anti_aliasing_filter=anti_aliasing_filter, rng=noise)
    return StreetFrame(
        number=number,
        names=tuple(point.name for point in points),
        scene=scene,
        observation=observation,
        assumed_filter=assumed_filter,
    )


def street_frames(*, seed: int, num_frames: int, **options: Any) -> Iterator[StreetFrame]:
    """Yield the first frames of the street.

    Parameters
    ----------
    seed : int
        As for `street_frame`.
    num_frames : int
        How many.
    **options
        As for `street_frame`.

    Raises
    ------
    InputError
        If a number is out of its range.
    """
    require_range("num_frames", num_frames, 1, MOST_FRAMES)
    for number in range(num_frames):
        yield street_frame(number, seed=seed, **options)


def _turns(delays_s: FloatArray) -> FloatArray:
    """Phases that the carrier has turned on the way, in cycles."""
    return np.asarray(RADAR.start_frequency_hz * delays_s % 1.0)


def _object_signal(objects: Channel) -> ComplexArray:
    beats = RADAR.beat_from_delay(objects.delays_s)
    dopplers = RADAR.doppler_from_hz(objects.dopplers_hz)
    factors = (
        line_factors(beats, RADAR.num_samples),
        line_factors(dopplers, RADAR.num_ramps),
    )
    return synthesize(objects.weights, *factors)


def _bursts(interferer: Interferer, anti_aliasing_filter: AntiAliasingFilter) -> ComplexArray:
    return multiplicative_bursts(RADAR, interferer, anti_aliasing_filter)


def _energy(signal: ComplexArray) -> float:
    return float(np.sum(np.abs(signal) ** 2))
