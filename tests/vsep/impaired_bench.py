"""Weak objects under bursts that no model explains: clipped, switched in the band, misfiltered."""

from dataclasses import dataclass

import numpy as np

from tests.vsep.noise_bench import FILTER, model_of
from vsep.signal.filters import ButterworthFilter
from vsep.units import wrap_frequency

SHAPE = 32, 256
MODEL = model_of(*SHAPE)
NUM_OBJECTS, SNR_DB = 30, (10.0, 22.0)
OVERSAMPLED = 8


@dataclass(frozen=True)
class Bursts:
    """Bursts of about this length in samples and level over the noise, and what is wrong."""

    length: float = 30.0
    level_db: float = 40.0
    share_of_ramps: float = 0.5
    number: int = 1  #: in such a ramp
    switched: bool = False
    clipped: bool = False
    anti_aliasing_filter: object = FILTER


IMPAIRED = {
    "matched": Bursts(),
    "clipped": Bursts(clipped=True),
    "switched on or off in the band": Bursts(level_db=60.0, switched=True),
    "through another filter": Bursts(
        anti_aliasing_filter=ButterworthFilter(cutoff_hz=2.5e6, order=6)
    ),
    "long": Bursts(length=150.0),
    "in every ramp": Bursts(share_of_ramps=1.0),
    "four in every ramp": Bursts(share_of_ramps=1.0, number=4),
    "four in half of the ramps": Bursts(number=4),
    "of four samples": Bursts(length=4.0, share_of_ramps=1.0),
}


def scene(bursts, seed):
    """Points (30, 2) of the objects, and the frame with bursts and noise."""
    rng = np.random.default_rng(seed)
    points = separated_points(rng)
    received = rng.standard_normal((2, *SHAPE)) / np.sqrt(2.0)
    received = received[0] + 1j * received[1]
    ramps, samples = np.arange(SHAPE[0])[:, None], np.arange(SHAPE[1])
    for beat, doppler in points:
        level = 10.0 ** (rng.uniform(*SNR_DB) / 10.0) / received.size
        phase = rng.uniform() + beat * samples + doppler * ramps
        received += np.sqrt(level) * np.exp(-2j * np.pi * phase)
    for ramp in range(SHAPE[0]):
        if rng.uniform() < bursts.share_of_ramps:
            for _ in range(bursts.number):
                received[ramp] += burst(bursts, rng)
    if bursts.clipped:
        limit = 0.5 * 10.0 ** (bursts.level_db / 20.0)
        received = np.clip(received.real, -limit, limit) + 1j * np.clip(
            received.imag, -limit, limit
        )
    return points, received


def missed(objects, points):
    """Points without an object within a cell."""
    if objects.num_components == 0:
        return len(points)
    found = np.column_stack([objects.beats, objects.dopplers])
    cells = np.abs(wrap_frequency(found[:, None] - points[None])) * SHAPE[::-1]
    return int(np.sum(cells.max(axis=2).min(axis=0) > 1.0))


def separated_points(rng):
    points = np.empty((0, 2))
    while len(points) < NUM_OBJECTS:
        point = np.array([rng.uniform(-0.24, 0.24), rng.uniform(-0.5, 0.5)])
        cells = np.abs(wrap_frequency(points - point)) * SHAPE[::-1]
        if not len(points) or np.all(cells.max(axis=1) > 3.0):
            points = np.vstack([points, point])
    return points


def burst(bursts, rng):
    """One chirp of two to three paths through the receiver's filter, exactly."""
    size = 3 * SHAPE[1] * OVERSAMPLED
    time = (np.arange(size) - SHAPE[1] * OVERSAMPLED) / OVERSAMPLED  # in samples
    slope = rng.choice([-1.0, 1.0]) * 0.5 / (bursts.length * rng.uniform(0.7, 1.4))
    centre = rng.uniform(10.0, SHAPE[1] - 10.0)
    in_front = np.abs(slope * (time - centre)) < 3.5
    course = np.zeros(size, dtype=np.complex128)
    for path in range(3):
        weight = (1.0 if path == 0 else 0.3 * rng.uniform()) * np.exp(2j * np.pi * rng.uniform())
        delayed = 0.0 if path == 0 else rng.uniform(-0.01, 0.01) * time
        cycles = 0.5 * slope * (time - centre) ** 2 + delayed
        course += weight * np.where(in_front, np.exp(2j * np.pi * cycles), 0.0)
    if bursts.switched:
        edge = centre + rng.uniform(-0.4, 0.4) * bursts.length
        course *= (time > edge) if rng.uniform() < 0.5 else (time < edge)
    frequency_hz = np.fft.fftfreq(size) * OVERSAMPLED * 1e7
    response = bursts.anti_aliasing_filter.response(frequency_hz)
    filtered = np.fft.ifft(np.fft.fft(course) * response)
    inside = slice(SHAPE[1] * OVERSAMPLED, 2 * SHAPE[1] * OVERSAMPLED, OVERSAMPLED)
    level_db = bursts.level_db + rng.uniform(-6.0, 3.0)
    return filtered[inside] * 10.0 ** (level_db / 20.0)
