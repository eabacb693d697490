"""Range migration: when an object moves too far within a frame to be one line.

An object at the velocity v moves by ``v P T_p`` in a frame. In range cells, m, its line has
satellites of about ``20 log10(m) - 6`` dB: -46 dB for a hundredth of a cell. With
`ChirpSequence.range_migration` estimators model them.
"""

from collections.abc import Iterator
from typing import Final, NamedTuple

import numpy as np

from vsep._typing import ComplexArray
from vsep.signal.radar import ChirpSequence
from vsep.units import to_db

SATELLITE_DB: Final = -6.0  # of an object that moves by one range cell
VISIBLE_DB: Final = 13.0  # over the noise of a frame: what is found as an object
_DYNAMIC = 1e-6  # of the window's side lobes, which are no noise
_FEWEST = 8  # ramps and samples


class Walker(NamedTuple):
    """The object of a frame with the strongest satellites."""

    velocity_mps: float  #: modulo the first interval of Doppler frequency
    level_db: float  #: over the noise of the frame
    cells: float  #: that it moves by, at this velocity

    @property
    def satellites_db(self) -> float:
        """Level of the satellites, to that of the object."""
        return float(2.0 * to_db(self.cells) + SATELLITE_DB)


def visible_walker(received: ComplexArray, radar: ChirpSequence) -> Walker | None:
    """Return the moving object of a frame (P, N) with the strongest satellites, if visible."""
    if min(received.shape) < _FEWEST:
        return None
    window = np.hanning(received.shape[0])[:, None] * np.hanning(received.shape[1])
    power = np.abs(np.fft.ifft2(received * window)) ** 2
    noise = max(float(np.median(power)) / np.log(2.0), _DYNAMIC * float(power.max()))
    if noise <= 0.0:
        return None
    course = power.max(axis=1)
    doppler = np.fft.fftfreq(len(course)).astype(np.float64)
    velocity = np.abs(radar.velocity_from_doppler(doppler))
    cells = velocity / radar.one_cell_mps
    # Of a window's main lobe three cells belong to what stands still.
    cells[np.abs(doppler) * len(course) < 2.5] = 0.0
    # Beside a maximum its own main lobe
    cells[(course < np.roll(course, 1)) | (course < np.roll(course, -1))] = 0.0
    level_db = to_db(np.maximum(course, 1e-300) / noise)
    satellites_db = level_db + 2.0 * to_db(np.maximum(cells, 1e-9)) + SATELLITE_DB
    worst = int(np.argmax(satellites_db))
    if satellites_db[worst] < VISIBLE_DB:
        return None
    return Walker(float(velocity[worst]), float(level_db[worst]), float(cells[worst]))


def migration_remark(received: ComplexArray, radar: ChirpSequence) -> Iterator[str]:
    """Say if a moving object of a frame (P, N) has visible satellites, or would have."""
    walker = visible_walker(received, radar)
    if walker is None:
        return
    sentence = (
        f"An object at {walker.velocity_mps:.3g} m/s, {walker.level_db:.0f} dB over the noise, "
        f"moves by {walker.cells:.2g} range cells within the frame"
    )
    if radar.migration.coupling:
        yield f"{sentence}, which is modelled; range_migration: neglected leaves it out."
        return
    yield (
        f"{sentence}: it will be found with satellites of about {walker.satellites_db:.0f} dB "
        "beside it, which are no objects. range_migration: modelled, fewer ramps or a smaller "
        "sweep avoid them."
    )
