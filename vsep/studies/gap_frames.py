"""Sequences of frames with gaps: large frames of slowly moving objects, a block lost in every ramp.

Ten objects over a range of 20 dB, at speeds of up to 9.5 m/s, a frame every 50 ms. The block of a
ramp, a share of it, begins anywhere and wraps around the ramp's end; noise and blocks are new in
each frame. A block holds a chirp of another radar, so that a detector can look for it.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from vsep._typing import BoolArray, ComplexArray
from vsep.presets.registry import simulated_preset
from vsep.signal.filters import NoFilter
from vsep.signal.motion import moving_scenes
from vsep.signal.radar import ChirpSequence
from vsep.signal.scene import Channel, GroundTruth, Scene
from vsep.signal.simulate import simulate
from vsep.units import from_db, to_db

_OBJECTS = 10
_LEVEL_RANGE = 2.0  # decades of power
_DELAYS_S, _DOPPLERS_HZ = (20e-9, 230e-9), (-5e3, 5e3)


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class GapFrame:
    """A frame whose flagged samples hold a chirp of another radar."""

    received: ComplexArray  #: (P, N)
    intact: ComplexArray  #: (P, N) the same without the chirps
    mask: BoolArray  #: (P, N) True where a sample is hit
    truth: GroundTruth  #: of the intact frame


def gap_radar(num_ramps: int, num_samples: int) -> ChirpSequence:
    """Return the radar of Simulation II with frames of another size."""
    own = simulated_preset("simulation-2-a").radar
    return replace(own, num_ramps=num_ramps, num_samples=num_samples)


def gap_sequence(
    rng: np.random.Generator,
    radar: ChirpSequence,
    *,
    share: float,
    snr_db: float,
    sir_db: float,
    num_frames: int,
) -> Iterator[GapFrame]:
    """Yield the frames of a sequence.

    Parameters
    ----------
    rng : numpy.random.Generator
        Draws everything.
    radar : ChirpSequence
        Its size is that of the frames.
    share : float
        Of every ramp that is lost.
    snr_db, sir_db : float
        Of a sample: objects over noise, and objects over chirp where it is.
    num_frames : int
        How many.
    """
    weights = 10.0 ** (-0.5 * _LEVEL_RANGE * rng.uniform(size=_OBJECTS))
    objects = Channel(
        delays_s=rng.uniform(*_DELAYS_S, _OBJECTS),
        dopplers_hz=rng.uniform(*_DOPPLERS_HZ, _OBJECTS),
        weights=weights * np.exp(2j * np.pi * rng.uniform(size=_OBJECTS)),
    )
    num_samples = radar.num_ramps * radar.num_samples
    scene = Scene(objects=objects, snr_db=snr_db + float(to_db(num_samples)))
    for now in moving_scenes(radar, scene, num_frames):
        observation = simulate(radar, now, anti_aliasing_filter=NoFilter(), rng=rng)
        truth = observation.truth
        assert truth is not None  # simulated
        mask, chirps = _chirps(rng, radar, share)
        level = np.sqrt(np.mean(np.abs(truth.object_signal) ** 2) / from_db(sir_db))
        intact = observation.received
        yield GapFrame(
            received=np.where(mask, intact + level * chirps, intact),
            intact=intact,
            mask=mask,
            truth=truth,
        )


def _chirps(
    rng: np.random.Generator, radar: ChirpSequence, share: float
) -> tuple[BoolArray, ComplexArray]:
    """Blocks (P, N), and chirps of unit power that sweep the whole band within a block."""
    length = max(round(share * radar.num_samples), 1)
    start = rng.integers(0, radar.num_samples, radar.num_ramps)
    age = (np.arange(radar.num_samples) - start[:, None]) % radar.num_samples
    phase = 0.5 * age**2 / length - 0.5 * age + rng.uniform(size=(radar.num_ramps, 1))
    return age < length, np.exp(2j * np.pi * phase)
