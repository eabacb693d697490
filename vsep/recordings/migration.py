"""Range migration: when an object moves too far within a frame to be one line.

An object at the velocity v moves by ``v P T_p`` in a frame. In range cells, m, its line has
satellites of about ``20 log10(m) - 6`` dB: -46 dB for a hundredth of a cell. With
`ChirpSequence.range_migration` estimators model them.
"""

from collections.abc import Iterator
from typing import Final

import numpy as np

from vsep._typing import ComplexArray
from vsep.signal.radar import ChirpSequence
from vsep.units import to_db

SATELLITE_DB: Final = -6.0  # of an object that moves by one range cell
VISIBLE_DB: Final = 13.0  # over the noise of a frame: what is found as an object
_DYNAMIC = 1e-6  # of the window's side lobes, which are no noise
_FEWEST = 8  # ramps and samples


def migration_remark(received: ComplexArray, radar: ChirpSequence) -> Iterator[str]:
    """Say if the strongest moving object of a frame (P, N) has satellites, or would have."""
    if min(received.shape) < _FEWEST:
        return
    window = np.hanning(received.shape[0])[:, None] * np.hanning(received.shape[1])
    power = np.abs(np.fft.ifft2(received * window)) ** 2
    noise = max(float(np.median(power)) / np.log(2.0), _DYNAMIC * float(power.max()))
    if noise <= 0.0:
        return
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
        return
    sentence = (
        f"An object at {velocity[worst]:.3g} m/s, {level_db[worst]:.0f} dB over the noise, moves "
        f"by {cells[worst]:.2g} range cells within the frame"
    )
    if radar.range_migration:
        yield f"{sentence}, which is modelled; range_migration: neglected leaves it out."
        return
    yield (
        f"{sentence}: it will be found with satellites of about "
        f"{2.0 * to_db(cells[worst]) + SATELLITE_DB:.0f} dB beside it, which are no objects. "
        "range_migration: modelled, fewer ramps or a smaller sweep avoid them."
    )
