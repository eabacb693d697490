"""What the tests of compressive sensing share: large frames with bursts in every ramp."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from vsep.presets.scenes import preset_radar
from vsep.signal.filters import NoFilter
from vsep.signal.motion import moving_scenes
from vsep.signal.scene import Channel, Scene
from vsep.signal.simulate import simulate

# The radar of Simulation II with 256 ramps: cells of 0.6 m and 0.3 m/s.
RADAR = replace(preset_radar("simulation-2-a"), num_ramps=256)


class GapScene(NamedTuple):
    """A frame whose flagged samples hold nothing of use, its objects, and the mask."""

    received: np.ndarray
    objects: np.ndarray
    mask: np.ndarray


def gap_sequence(seed, *, share, snr_db, num_frames=1):
    """Frames of ten slowly moving objects, every 50 ms one.

    The levels of the objects are spread over 20 dB, their speeds over +-9.5 m/s: up to one range
    cell from frame to frame. `snr_db` is per sample. In every ramp one block, this share of it, is
    lost; it begins anywhere and wraps around the ramp's end. Noise and blocks are new in each
    frame.
    """
    rng = np.random.default_rng(seed)
    weights = 10.0 ** (-rng.uniform(0.0, 1.0, 10)) * np.exp(2j * np.pi * rng.uniform(size=10))
    objects = Channel(
        delays_s=rng.uniform(20e-9, 230e-9, 10),
        dopplers_hz=rng.uniform(-5e3, 5e3, 10),
        weights=weights,
    )
    size = RADAR.num_ramps * RADAR.num_samples
    scene = Scene(objects=objects, snr_db=snr_db + 10.0 * np.log10(size))
    for now in moving_scenes(RADAR, scene, num_frames):
        observation = simulate(RADAR, now, anti_aliasing_filter=NoFilter(), rng=rng)
        start = rng.integers(0, RADAR.num_samples, RADAR.num_ramps)
        age = (np.arange(RADAR.num_samples) - start[:, None]) % RADAR.num_samples
        mask = age < round(share * RADAR.num_samples)
        received = np.where(mask, 100.0, observation.received)
        yield GapScene(received, observation.truth.object_signal, mask)


def gap_scene(seed, **options):
    """Return the first frame of `gap_sequence`."""
    return next(gap_sequence(seed, **options))


def advanced(solver, operator, measured, iterations):
    """Return the state of a sparse solver after some steps."""
    state = solver.init(operator, measured)
    for _ in range(iterations):
        state = solver.step(operator, measured, state)
    return state


def pylops_matrix(matrix):
    """Return an explicit operator as PyLops takes it."""
    import pylops

    columns = np.array([matrix.forward(unit) for unit in np.eye(matrix.num_cells)]).T
    return pylops.MatrixMult(columns, dtype="complex128")


def sparse_problem(seed, *, shape=(8, 16), share=0.3, noise=0.01, occupied=4):
    """Clean samples of a few occupied cells on the grid: (frame, mask, spectrum)."""
    rng = np.random.default_rng(seed)
    spectrum = np.zeros(shape, dtype=complex)
    cells = rng.choice(spectrum.size, occupied, replace=False)
    spectrum.ravel()[cells] = np.exp(2j * np.pi * rng.uniform(size=occupied))
    frame = np.fft.fft2(spectrum, norm="ortho")
    draws = rng.standard_normal((2, *shape))
    frame += noise * (draws[0] + 1j * draws[1])
    return frame, rng.uniform(size=shape) < share, spectrum
