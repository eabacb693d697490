"""Range migration: when an object moves too far within a frame to be one line.

An object at the velocity v moves by ``v P T_p`` in a frame. In range cells, m, its line has
satellites of about ``20 log10(m) - 6`` dB: -46 dB for a hundredth of a cell. With
`ChirpSequence.range_migration` estimators model them.
"""

from collections.abc import Iterator
from dataclasses import replace
from typing import Final, NamedTuple

import numpy as np

from vsep._typing import ComplexArray
from vsep.kernels.moving_atoms import STATIONARY
from vsep.signal.dithered_spectra import dithered_spectrum
from vsep.signal.radar import ChirpSequence
from vsep.units import to_db

SATELLITE_DB: Final = -6.0  # of an object that moves by one range cell
VISIBLE_DB: Final = 10.0  # over the noise: satellites that are found as objects
CERTAIN_DB: Final = 18.0  # over the noise: what is no maximum of the noise
_NONE, _LEAST = 1e-9, 1e-6  # to the largest cell: no noise at all, and what is then taken for it
_FEWEST = 8  # ramps and samples
_LOUD, _USUAL = 3.0, 0.9  # times this quantile of the magnitudes: bursts


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
    """Return the moving object of a frame with the strongest satellites, if visible.

    Parameters
    ----------
    received : (P, N) or (A, P, N) complex
        Antennas count together, as for an estimator.
    radar : ChirpSequence
        That of the frame.
    """
    if min(received.shape[-2:]) < _FEWEST:
        return None
    windows = [np.blackman(count + 2)[1:-1] for count in received.shape[-2:]]
    window = np.outer(*windows)
    magnitude = np.abs(received)
    usual = np.quantile(magnitude, _USUAL, axis=(-2, -1), keepdims=True)
    received = np.where(magnitude > _LOUD * usual, 0.0, received)  # bursts become gaps
    loss = window.size * np.sum(window**2) / np.sum(window) ** 2
    maps = np.abs(_spectra(received * window, radar)) ** 2
    noise, most = float(np.median(maps)) / np.log(2.0), float(maps.max())
    if most == 0.0:
        return None
    noise = noise if noise > _NONE * most else _LEAST * most
    power = maps.reshape(-1, *maps.shape[-2:]).sum(axis=0)
    # Beside a maximum is its own main lobe.
    for step, axis in ((1, 0), (-1, 0), (1, 1), (-1, 1)):
        power = np.where(power < np.roll(power, step, axis), 0.0, power)
    course = power.max(axis=1)
    velocity = np.abs(radar.velocity_from_doppler(np.fft.fftfreq(len(course)).astype(np.float64)))
    cells = velocity / radar.one_cell_mps
    level_db = to_db(course / noise * loss)
    satellites_db = level_db + 2.0 * to_db(np.maximum(cells, 1e-9)) + SATELLITE_DB
    # No side lobe of a gap in the samples is larger than its share.
    gaps = np.sum(window * (received == 0), axis=(-2, -1)).max() / np.sum(window)
    gaps = gaps / max(1.0 - gaps, 1e-9)
    satellites_db[level_db < max(CERTAIN_DB, level_db.max() + 2.0 * to_db(gaps))] = -np.inf
    worst = int(np.argmax(satellites_db))
    if satellites_db[worst] < VISIBLE_DB:
        return None
    return Walker(float(velocity[worst]), float(level_db[worst]), float(cells[worst]))


def _spectra(frames: ComplexArray, radar: ChirpSequence) -> ComplexArray:
    """Range-Doppler spectra of frames (P, N) or (A, P, N), in the order of a DFT."""
    if radar.dither is None:
        return np.asarray(np.fft.ifft2(frames))
    signals = frames.reshape(-1, *radar.shape)
    resting = replace(radar.dither, motion=STATIONARY)
    dopplers = np.fft.fftfreq(radar.num_ramps).astype(np.float64)
    spectra = dithered_spectrum(signals, resting, dopplers, radar.num_samples)
    return np.asarray(spectra.reshape(frames.shape) / (radar.num_ramps * radar.num_samples))


def migration_remark(received: ComplexArray, radar: ChirpSequence) -> Iterator[str]:
    """Say if a moving object of a frame has visible satellites, or would have."""
    walker = visible_walker(received, radar)
    if walker is None:
        return
    sentence = (
        f"An object at {walker.velocity_mps:.3g} m/s, {walker.level_db:.0f} dB over the noise, "
        f"moves by {walker.cells:.2g} range cells within the frame"
    )
    if radar.motion.coupling:
        yield f"{sentence}, which is modelled; range_migration: neglected leaves it out."
        return
    yield (
        f"{sentence}: it will be found with satellites of about {walker.satellites_db:.0f} dB "
        "beside it, which are no objects. range_migration: modelled, fewer ramps or a smaller "
        "sweep avoid them."
    )
