"""Thirty objects over 70 dB, received with an oscillator and a receiver that are not perfect."""

import numpy as np

from tests.vsep.impaired_bench import Bursts, burst, separated_points
from tests.vsep.noise_bench import model_of, nearest
from vsep.inference.deviations import state_deviations
from vsep.signal.impairments import ReceiverImpairments, impaired
from vsep.units import wrap_frequency

SHAPE = 32, 256
MODEL = model_of(*SHAPE)
RATE_HZ = MODEL.sample_rate_hz
NUM_OBJECTS, SNR_DB = 30, (10.0, 80.0)
IMPAIRED = {
    "jitter": ReceiverImpairments(phase_jitter_rad=5e-3),
    "phase noise": ReceiverImpairments(phase_noise_rad=10e-3),
    "images": ReceiverImpairments(iq_gain_db=0.5, iq_phase_deg=3.0),
    "offset": ReceiverImpairments(dc_offset=5.0),
    "all": ReceiverImpairments(
        phase_jitter_rad=5e-3,
        phase_noise_rad=10e-3,
        iq_gain_db=0.5,
        iq_phase_deg=3.0,
        dc_offset=5.0,
    ),
}


def lines(points, levels_db, shape, rng):
    """(P, N) sum of lines of a component SNR over noise of power one, with random phases."""
    ramps, samples = np.arange(shape[0])[:, None], np.arange(shape[1])
    frame = np.zeros(shape, dtype=np.complex128)
    for (beat, doppler), level_db in zip(points, levels_db, strict=True):
        phase = rng.uniform() + beat * samples + doppler * ramps
        amplitude = np.sqrt(10.0 ** (level_db / 10.0) / frame.size)
        frame += amplitude * np.exp(-2j * np.pi * phase)
    return frame


def noise(shape, rng):
    draws = rng.standard_normal((2, *shape)) / np.sqrt(2.0)
    return draws[0] + 1j * draws[1]


def scene(impairments, seed, *, share_of_ramps=0.0):
    """Points (30, 2), their levels in dB, the frame, and what the receiver did to it."""
    rng = np.random.default_rng(seed)
    points, levels_db = separated_points(rng), rng.uniform(*SNR_DB, NUM_OBJECTS)
    ideal = lines(points, levels_db, SHAPE, rng) + noise(SHAPE, rng)
    for ramp in range(SHAPE[0]):
        if rng.uniform() < share_of_ramps:
            ideal[ramp] += burst(Bursts(), rng)
    if impairments is None:
        return points, levels_db, ideal, None
    received, truth = impaired(ideal, impairments, noise_power=1.0, sample_rate_hz=RATE_HZ, rng=rng)
    return points, levels_db, received, truth


def false_and_missed(objects, points):
    """Objects farther than a cell from all points, and points without an object within a cell."""
    found = np.column_stack([objects.beats, objects.dopplers])
    cells = np.abs(wrap_frequency(found[:, None] - points)) * SHAPE[::-1]
    apart = cells.max(axis=2)
    return int(np.sum(apart.min(axis=1) > 1.0)), int(np.sum(apart.min(axis=0) > 1.0))


def within_a_deviation(state, points):
    """How many beats and Dopplers lie within one deviation of their points."""
    objects, std = state.objects, state_deviations(state, SHAPE)
    counts = np.zeros(2, dtype=np.int64)
    for point in points:
        found = nearest(objects, point, SHAPE)
        if found is not None:
            index, errors = found
            counts += np.abs(errors) < [std.beats[index], std.dopplers[index]]
    return counts
